"""The window of each recording that is compared with the simulator: it must hold the motion."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

from compass_ros.cells import Cell
from compass_ros.checks.finding import Finding
from compass_ros.checks.onset import first_motion, leaving
from compass_ros.checks.series import Level, Series
from compass_ros.checks.signals import Looked
from compass_ros.types import Episode

_NS = 1e-9


@dataclass(frozen=True)
class Windows:
    """Recordings with their starts set, those in which nothing moves, and what was found."""

    episodes: Mapping[str, Episode]
    still: tuple[str, ...]
    findings: tuple[Finding, ...]


def windows(cell: Cell, episodes: Mapping[str, Episode], looked: Sequence[Looked], wrong: Collection[str]) -> Windows:
    """Move the start of passive recordings that begin before the motion to where it begins.

    Where a command says when time 0 is, it stays, and so does a start whose state the recording states, and that of
    recordings that are `wrong`. Recordings that are cut into windows are left to those who cut them.
    """
    if cell.spec.windows is not None:
        return Windows(episodes, (), ())
    driven = bool(cell.action or cell.spec.inputs)
    late: dict[str, tuple[int, ...]] = {}
    out, still, longest = {}, [], 0.0
    for name, episode in episodes.items():
        series = [(one, part.level) for part in looked for one in part.series if one.recording == name]
        stays = driven or episode.initial_state or name in wrong
        moved = episode if stays else _started(cell, episode, series)
        if moved.start_ns != episode.start_ns:
            late[name] = ()
            longest = max(longest, (moved.start_ns - episode.start_ns) * _NS)
        if not any(_moves(cell, moved, *one) for one in series):
            still.append(name)
        out[name] = moved
    looks = f"the motion begins up to {longest:.2g} s after the recording: time 0 is moved there"
    found = [Finding("late", "repaired", "start", late, looks)] if late else []
    if still:
        looks = f"nothing moves within {cell.duration:.3g} s of the {'command' if driven else 'start'}"
        everywhere = len(still) == len(episodes)
        found.append(Finding("still", "bad" if everywhere else "note", "start", dict.fromkeys(still, ()), looks))
    return Windows(out, tuple(still), tuple(found))


def _started(cell: Cell, episode: Episode, series: Sequence[tuple[Series, Level]]) -> Episode:
    """The episode with time 0 where something begins to move; where the cell knows of a release, so much earlier."""
    moment = first_motion([one for one, _ in series], [known for _, known in series])
    if moment is None:
        return episode
    release = cell.spec.release
    if release is None:
        return replace(episode, start_ns=max(moment, episode.start_ns))
    lead = int(release.default_s / _NS)
    usual = abs(moment - episode.start_ns - lead) * _NS <= 3 * release.noise_s
    return episode if usual else replace(episode, start_ns=max(moment - lead, episode.start_ns))


def _moves(cell: Cell, episode: Episode, one: Series, known: Level) -> bool:
    """Whether a signal leaves where it was within the window."""
    since = (one.stamp_ns - episode.start_ns) * _NS
    inside = (since >= 0) & (since <= cell.duration)
    return bool(inside.any()) and leaving(one.value[inside], known) is not None
