"""Episodes as the checks see them, and back."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from compass_ros.cells.limits import Limits
from compass_ros.checks.finding import Finding
from compass_ros.checks.frozen import frozen
from compass_ros.checks.interleaved import interleaved
from compass_ros.checks.series import Kind, Level, Series, level
from compass_ros.checks.stamps import jumping_clock
from compass_ros.checks.wrapped import unwrapped
from compass_ros.types import Episode, Floats, Track

EXPECTED_TURN = 0.05
"""Noise of a quaternion's numbers that is expected of any sensor: a turn by six degrees."""


@dataclass(frozen=True)
class Signal:
    """One tracked object in all recordings, mended where that is sure."""

    name: str
    tracks: Mapping[str, Track]
    """By recording."""
    series: tuple[Series, ...]
    """Its position or angle."""
    level: Level
    findings: tuple[Finding, ...]


def signal(name: str, tracks: Mapping[str, Track], limits: Limits, expected: float) -> Signal:
    """Look at all recordings of one object. `expected` [m or rad]: the noise that the cell expects.

    Where values of two kinds take turns, nothing else that jumps is looked for: it would be the same thing again.
    """
    raw = [_place(recording, track, limits) for recording, track in tracks.items()]
    strange = [one for one in interleaved(raw, level(raw, expected)) if one.kind in ("zeros", "constant")]
    if strange:
        return Signal(name, tracks, tuple(raw), level(raw, expected), (*strange, *_turned(tracks)))
    whole = [_series(recording, track, "other", slice(None)) for recording, track in tracks.items()]
    thawed = frozen(whole, level(whole, expected))
    new = {one.recording: _with(tracks[one.recording], one) for one in thawed.series}
    place = [_place(recording, track, limits) for recording, track in new.items()]
    straight = unwrapped(place, level(place, expected))
    new = {one.recording: _placed(new[one.recording], one.value) for one in straight.series}
    known = level(straight.series, expected)
    if mixed := interleaved(straight.series, known):
        return Signal(name, tracks, tuple(raw), known, (*mixed, *_turned(tracks)))
    found = (*thawed.findings, *straight.findings, *jumping_clock(straight.series, known), *_turned(new))
    return Signal(name, new, straight.series, known, found)


def _turned(tracks: Mapping[str, Track]) -> tuple[Finding, ...]:
    """What takes turns in the orientations, of poses."""
    turns = [_orientation(recording, track) for recording, track in tracks.items() if track.quantity == "pose"]
    return interleaved(turns, level(turns, EXPECTED_TURN)) if turns else ()


def _series(recording: str, track: Track, kind: Kind, columns: slice) -> Series:
    return Series(recording, track.object, kind, track.stamp_ns, track.value[:, columns])


def _place(recording: str, track: Track, limits: Limits) -> Series:
    """Position or angle, without the orientation of a pose."""
    return replace(_series(recording, track, limits.kind, slice(0, 3)), low=limits.low, high=limits.high)


def _orientation(recording: str, track: Track) -> Series:
    """Quaternions with the signs of one motion: q and -q are the same turn."""
    one = _series(recording, replace(track, object=f"orientation of {track.object}"), "orientation", slice(3, 7))
    flips = np.where(np.sum(one.value[1:] * one.value[:-1], axis=1) < 0, -1.0, 1.0)
    return replace(one, value=one.value * np.concatenate([[1.0], np.cumprod(flips)])[:, None])


def _with(track: Track, one: Series) -> Track:
    """The track with the samples that are left."""
    if len(one.stamp_ns) == len(track.stamp_ns):
        return track
    keep = np.isin(track.stamp_ns, one.stamp_ns)
    std = None if track.std is None else track.std[keep]
    return replace(track, stamp_ns=track.stamp_ns[keep], value=track.value[keep], std=std)


def _placed(track: Track, place: Floats) -> Track:
    if np.array_equal(track.value[:, : place.shape[1]], place):
        return track
    return replace(track, value=np.concatenate([place, track.value[:, place.shape[1] :]], axis=1))


def labels(episodes: Sequence[Episode]) -> list[str]:
    """A name for each recording: the episode's, or its path where several have one name."""
    names = [e.name for e in episodes]
    return [e.name if names.count(e.name) == 1 else e.source or f"{e.name} #{i}" for i, e in enumerate(episodes)]
