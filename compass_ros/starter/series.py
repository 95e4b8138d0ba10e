"""All that recordings hold of a robot, read before anybody says what is wanted of them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from compass_ros.episodes import Source, find_bags, read_bag
from compass_ros.episodes.survey import Held, survey
from compass_ros.errors import BagError
from compass_ros.starter.motion import Column, period
from compass_ros.starter.names import tokens
from compass_ros.types import Floats, Track

MOST = 12
"""Recordings that are looked at, evenly among all: names, rates and delays are the same in all of them."""
_COMMANDS = {"command", "commands", "cmd", "target", "targets", "desired", "reference", "goal", "setpoint", "setpoints"}
_NS = 1e-9


@dataclass(frozen=True)
class Series:
    """One thing that a topic holds, in each recording."""

    held: Held
    tracks: tuple[Track, ...]

    @property
    def names(self) -> tuple[str, ...]:
        return self.held.names

    @property
    def asked(self) -> bool:
        """Whether its messages are requests by their type: trajectories, a controller's reference or output."""
        by_type = self.held.type.endswith(("/JointTrajectory", "/MultiDOFCommand"))
        return by_type or self.held.part in ("reference", "output")

    @property
    def hinted(self) -> bool:
        """Whether its topic is called as a command."""
        return bool(_COMMANDS & {*tokens(self.held.topic)})

    @property
    def period_s(self) -> float:
        """Between two messages: the median."""
        return float(np.median([period(Column(t.stamp_ns, t.value[:, 0])) for t in self.tracks]))

    def columns(self, number: int) -> list[Column]:
        """One of its numbers in each recording, without gaps."""
        out = []
        for track in self.tracks:
            seen = ~np.isnan(track.value[:, number])
            out.append(Column(track.stamp_ns[seen], track.value[seen, number]))
        return out


@dataclass(frozen=True)
class Recordings:
    """What was found in the bags."""

    bags: tuple[Path, ...]
    """Those that were looked at."""
    count: int
    """Of all bags."""
    series: tuple[Series, ...]
    seconds: tuple[float, ...]
    """Length of each recording that was looked at."""
    notes: tuple[str, ...]
    """What could not be read, and why."""
    cell: str = ""
    cell_hash: str = ""
    """Whose recordings the first of them says that they are; empty where it says nothing."""


def read_all(paths: Iterable[str | Path]) -> Recordings:
    """Read the bags that paths name. Raises BagError where one cannot be read, or nothing in it can."""
    every = find_bags(paths)
    bags = [every[i] for i in np.unique(np.linspace(0, len(every) - 1, min(MOST, len(every))).round().astype(int))]
    shared, notes = _in_all([survey(bag) for bag in bags])
    if not shared:
        raise BagError(f"{bags[0]}: nothing in it can be read as joints, poses or sensors of a robot")
    sources = {held: held.source(str(i)) for i, held in enumerate(shared)}
    found: dict[Held, list[Track]] = {held: [] for held in shared}
    for bag in bags:
        tracks, said = _tracks(bag, sources)
        for held, track in tracks.items():
            found[held].append(track)
        notes += said
    whole = tuple(Series(held, tuple(tracks)) for held, tracks in found.items() if len(tracks) == len(bags))
    seconds = tuple(_seconds(whole, i) for i in range(len(bags)))
    first = read_bag(bags[0], ()).episode
    return Recordings(tuple(bags), len(every), whole, seconds, tuple(notes), first.cell, first.cell_hash)


def _in_all(surveys: Sequence[Sequence[Held]]) -> tuple[list[Held], list[str]]:
    """What all recordings hold, with the names that are in all of them."""
    by_key = [{(h.topic, h.quantity, h.part, h.names if h.quantity == "pose" else ()): h for h in s} for s in surveys]
    shared, notes = [], []
    for key, held in by_key[0].items():
        if not all(key in other for other in by_key):
            notes.append(f"{held.topic} ({held.quantity}) is not in every recording")
            continue
        names = tuple(n for n in held.names if all(n in other[key].names for other in by_key))
        if names:
            shared.append(replace(held, names=names))
    return shared, notes


def _tracks(bag: Path, sources: Mapping[Held, Source]) -> tuple[dict[Held, Track], list[str]]:
    """The tracks of a bag; what cannot be read is told apart from the rest by reading each alone."""
    try:
        episode = read_bag(bag, [*sources.values()]).episode
    except BagError as error:
        if len(sources) == 1:
            return {}, [f"not read: {error}"]
        found: dict[Held, Track] = {}
        notes: list[str] = []
        for held, source in sources.items():
            own, said = _tracks(bag, {held: source})
            found |= own
            notes += said
        return found, notes
    return {held: episode.track(source.object) for held, source in sources.items()}, []


def _seconds(series: Sequence[Series], recording: int) -> float:
    """For how long all of them are there."""
    stamps = [one.tracks[recording].stamp_ns for one in series]
    return float(min(s[-1] for s in stamps) - max(s[0] for s in stamps)) * _NS if stamps else 0.0


def rates(column: Column) -> Floats:
    """(n,) its derivative, by differences."""
    time = (column.stamp_ns - column.stamp_ns[0]) * _NS
    return np.asarray(np.gradient(column.value, time)) if len(time) > 1 else np.zeros(len(time))
