"""The window of each recording that is compared with the simulator: it must hold the motion."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from compass_ros.cells import Cell
from compass_ros.checks.finding import Finding
from compass_ros.checks.onset import first_motion, leaving
from compass_ros.checks.series import Level, Series
from compass_ros.checks.signals import Looked, LookedAt
from compass_ros.errors import DataError
from compass_ros.simulation import Simulator
from compass_ros.types import Episode

_NS = 1e-9
_OWN = 2.0
"""A still beginning is the motion's own where the simulator's lasts more than one part in so many of it: by which
factor a scene that is not calibrated may be wrong there."""


@dataclass(frozen=True)
class Windows:
    """Recordings with their starts set, those in which nothing moves, and what was found."""

    episodes: Mapping[str, Episode]
    still: tuple[str, ...]
    findings: tuple[Finding, ...]


def windows(
    cell: Cell, episodes: Mapping[str, Episode], signals: Mapping[str, LookedAt], wrong: Collection[str]
) -> Windows:
    """Move the start of passive recordings that begin before the motion to where it begins.

    Where a command says when time 0 is, it stays, and so does a start whose state the recording states, and that of
    recordings that are `wrong`. Recordings that are cut into windows are left to those who cut them.
    """
    if cell.spec.windows is not None:
        return Windows(episodes, (), ())
    driven = bool(cell.action or cell.spec.inputs)
    late: dict[str, tuple[int, ...]] = {}
    out, still, longest = {}, [], 0.0
    scene = cache(lambda: Simulator(cell, threads=1))
    looked = [(name, one) for name, signal in signals.items() for one in signal.parts if not one.part.turns]
    for name, episode in episodes.items():
        own = [(signal, part, one) for signal, part in looked for one in part.series if one.recording == name]
        stays = driven or episode.initial_state or name in wrong
        moved = episode if stays else _started(cell, scene, episode, own)
        if moved.start_ns != episode.start_ns:
            late[name] = ()
            longest = max(longest, (moved.start_ns - episode.start_ns) * _NS)
        if not any(_moves(cell, moved, one, part.level) for _, part, one in own):
            still.append(name)
        out[name] = moved
    looks = f"the motion begins up to {longest:.2g} s after the recording: time 0 is moved there"
    found = [Finding("late", "repaired", "start", late, looks)] if late else []
    if still:
        looks = f"nothing moves within {cell.duration:.3g} s of the {'command' if driven else 'start'}"
        everywhere = len(still) == len(episodes)
        found.append(Finding("still", "bad" if everywhere else "note", "start", dict.fromkeys(still, ()), looks))
    return Windows(out, tuple(still), tuple(found))


Seen = Sequence[tuple[str, Looked, Series]]
"""What is seen in one recording: the signal, the part of it, its samples."""


def _started(cell: Cell, scene: Callable[[], Simulator], episode: Episode, seen: Seen) -> Episode:
    """The episode with time 0 where something begins to move; where the cell knows of a release, so much earlier.

    What is tracked may stand still at first although the scene moves: a thing that falls towards it, say. Time 0 is as
    long before the motion as in the simulator then, or stays where the recording begins if that is about as long.
    """
    moment = first_motion([one for _, _, one in seen], [part.level for _, part, _ in seen])
    if moment is None:
        return episode
    release = cell.spec.release
    if release is None:
        if moment <= episode.start_ns:
            return episode
        moved = replace(episode, start_ns=moment)
        lead = round(_lead(scene(), moved, seen) / _NS)
        if not lead:
            return moved
        own = moment - episode.start_ns < _OWN * lead
        return episode if own else replace(episode, start_ns=max(moment - lead, episode.start_ns))
    lead = int(release.default_s / _NS)
    usual = abs(moment - episode.start_ns - lead) * _NS <= 3 * release.noise_s
    return episode if usual else replace(episode, start_ns=max(moment - lead, episode.start_ns))


def _lead(simulator: Simulator, episode: Episode, seen: Seen) -> float:
    """How long nothing that is tracked moves in the simulator at its defaults, from the state of an episode [s]."""
    cell = simulator.cell
    try:
        inputs = cell.inputs(episode)
    except DataError:  # too little is left of it; said where it is read
        return 0.0
    period = min(one.period_s for _, _, one in seen)
    time = np.arange(0.0, cell.duration, period if period > 0 else cell.control_dt)
    motion = simulator.observe(simulator.defaults[None], simulator.inputs(inputs[None]), time[None])[0]
    stamps, own = np.round(time / _NS).astype(np.int64), []
    for signal, part, one in seen:
        first = cell.signal(signal).first + part.part.first
        own.append(Series(one.recording, signal, one.kind, stamps, motion[:, first : first + part.part.size]))
    moment = first_motion(own, [part.level for _, part, _ in seen])
    return 0.0 if moment is None else moment * _NS


def _moves(cell: Cell, episode: Episode, one: Series, known: Level) -> bool:
    """Whether a signal leaves where it was within the window."""
    since = (one.stamp_ns - episode.start_ns) * _NS
    inside = (since >= 0) & (since <= cell.duration)
    return bool(inside.any()) and leaving(one.value[inside], known) is not None
