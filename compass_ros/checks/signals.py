"""The signals of a cell as the checks see them: parts of one unit, and the recordings with what was mended."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from compass_ros.cells.limits import Limits
from compass_ros.cells.signals import Signal
from compass_ros.checks.finding import Finding
from compass_ros.checks.frozen import frozen, held
from compass_ros.checks.interleaved import KINDS, interleaved
from compass_ros.checks.series import Level, Series, level
from compass_ros.checks.stamps import jumping_clock
from compass_ros.checks.wrapped import unwrapped
from compass_ros.types import Episode, Track

EXPECTED_TURN = 0.05
"""Noise of a quaternion's numbers that is expected of any sensor: a turn by six degrees."""


@dataclass(frozen=True)
class Part:
    """Numbers of one unit: a joint's position, the position of a body, its orientation."""

    name: str
    first: int
    """Column of a track."""
    size: int
    limits: Limits
    expected: float
    """Noise [unit of the numbers]."""
    turns: bool = False
    """Whether it is an orientation."""
    step: float = 0.0
    """What the sensor counts in, as the cell says; 0: it says nothing."""

    @property
    def columns(self) -> slice:
        """Of a track."""
        return slice(self.first, self.first + self.size)


@dataclass(frozen=True)
class Looked:
    """One part in all recordings, after the checks."""

    part: Part
    series: tuple[Series, ...]
    level: Level
    findings: tuple[Finding, ...]


@dataclass(frozen=True)
class LookedAt:
    """One signal in all recordings."""

    tracks: Mapping[str, Track]
    """By recording; mended where that is sure."""
    parts: tuple[Looked, ...]
    findings: tuple[Finding, ...]


def parts(signal: Signal, limits: Sequence[Limits], expected: float) -> Iterator[Part]:
    """The parts of a signal. `expected`: the noise that the cell expects, where the signal states none."""
    noise = signal.noise or expected
    if signal.jointed:
        for i, number in enumerate(signal.numbers):
            name = signal.name if signal.size == 1 else f"{signal.name}.{number}"
            yield Part(name, i, 1, limits[i], noise, step=signal.step or 0.0)
        return
    yield Part(signal.name, 0, min(signal.size, 3), limits[0], noise)
    if signal.quantity == "pose":
        yield Part(f"orientation of {signal.name}", 3, 4, limits[0], EXPECTED_TURN, turns=True)


def look(tracks: Mapping[str, Track], of: Sequence[Part]) -> LookedAt:
    """Look at all recordings of one signal, by name, part by part.

    Where values of two kinds take turns in one of them, nothing else that jumps is looked for in any: it would be the
    same thing again.
    """
    raw = [_unchecked(tracks, part) for part in of]
    if strange := [
        one for looked in raw for one in interleaved(looked.series, looked.level) if one.kind != "two series"
    ]:
        return LookedAt(tracks, tuple(raw), tuple(strange))
    once, found = held(tracks, raw[0].level)
    done = [_checked(once, part) for part in of]
    mended = dict(once)
    for looked in done:
        mended = {name: _with(track, looked, name) for name, track in mended.items()}
    found += tuple(one for looked in done for one in looked.findings)
    if not any(one.kind in KINDS for one in found):
        found += jumping_clock(_together(done, mended))
    return LookedAt(mended, tuple(done), found)


def unlooked(tracks: Mapping[str, Track], of: Sequence[Part]) -> LookedAt:
    """The recordings as they are."""
    return LookedAt(tracks, tuple(_unchecked(tracks, part) for part in of), ())


def _unchecked(tracks: Mapping[str, Track], part: Part) -> Looked:
    series = tuple(_series(name, track, part) for name, track in tracks.items())
    return Looked(part, series, level(series, part.expected, part.step), ())


def _checked(tracks: Mapping[str, Track], part: Part) -> Looked:
    raw = _unchecked(tracks, part)
    straight = unwrapped(raw.series, raw.level)
    known = level(straight.series, part.expected, part.step)
    if mixed := interleaved(straight.series, known):
        return replace(raw, findings=mixed)
    return Looked(part, straight.series, known, (*frozen(straight.series, known), *straight.findings))


def _together(done: Sequence[Looked], tracks: Mapping[str, Track]) -> list[Series]:
    """The numbers of all parts but turns, as they were mended, over what tells two of their values apart; where all
    are there."""
    straight = [looked for looked in done if not looked.part.turns]
    apart = np.concatenate([looked.level.apart for looked in straight])
    out = []
    for name, track in tracks.items():
        value = np.concatenate([track.value[:, looked.part.columns] for looked in straight], axis=1) / apart
        seen = ~np.isnan(value).any(axis=1)
        out.append(Series(name, track.object, straight[0].part.limits.kind, track.stamp_ns[seen], value[seen]))
    return out


def _series(recording: str, track: Track, part: Part) -> Series:
    """A part of one recording, without the samples that lack it; of orientations with the signs of one motion."""
    value = track.value[:, part.columns]
    seen = ~np.isnan(value).any(axis=1)
    value = value[seen]
    kind = "orientation" if part.turns else part.limits.kind
    if part.turns and len(value):  # q and -q are the same turn
        flips = np.where(np.sum(value[1:] * value[:-1], axis=1) < 0, -1.0, 1.0)
        value = value * np.concatenate([[1.0], np.cumprod(flips)])[:, None]
    return Series(recording, part.name, kind, track.stamp_ns[seen], value, part.limits.low, part.limits.high)


def _with(track: Track, looked: Looked, recording: str) -> Track:
    """The track with the numbers of a part as they were mended."""
    one = next(one for one in looked.series if one.recording == recording)
    at = np.searchsorted(track.stamp_ns, one.stamp_ns)
    if looked.part.turns or np.array_equal(track.value[at, looked.part.columns], one.value):
        return track
    value = track.value.copy()
    value[at, looked.part.columns] = one.value
    return replace(track, value=value)


def labels(episodes: Sequence[Episode]) -> list[str]:
    """A name for each recording: the episode's, or its path where several have one name."""
    names = [e.name for e in episodes]
    return [e.name if names.count(e.name) == 1 else e.source or f"{e.name} #{i}" for i, e in enumerate(episodes)]
