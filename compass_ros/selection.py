"""Which recordings are fitted, which are kept for the end, and which windows of long ones are worth a simulation."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence

import numpy as np

from compass_ros.cells import Cell
from compass_ros.config import CalibrationConfig
from compass_ros.errors import DataError
from compass_ros.simulation.windows import least_motion, ranges
from compass_ros.types import Episode, Floats, Track

_NS = 1e-9
TOGETHER_S = 100.0
"""Of windows that are fitted: a budget. An SO-101 fitted to 40, 20 and 8 windows of 5 s is off by 6.1, 6.0 and 6.1 mrad
in the 135 windows of a week that it has not seen (docs/first-day.md)."""
WINDOWS = (10, 40)
"""Fewest and most of them."""


def evenly(episodes: Sequence[Episode], most: int) -> list[Episode]:
    """All episodes where they are not more than `most`; else so many of them, evenly over the order of recording.

    A calibration's time and memory grow with its episodes, its error bars shrink with their square root.
    """
    ordered = sorted(episodes, key=lambda e: (e.start_ns, e.name, e.source))
    if len(ordered) <= most:
        return ordered
    return [ordered[i] for i in np.round(np.linspace(0, len(ordered) - 1, most)).astype(int)]


def fitted(cell: Cell, cut: Sequence[Episode], config: CalibrationConfig) -> list[Episode]:
    """What is fitted of the windows of all recordings to fit."""
    if spec := cell.spec.windows:
        return unlike(cell, cut, config.windows or most_windows(spec.length_s))
    return evenly(cut, config.episodes)


def most_windows(length_s: float) -> int:
    """How many windows of a length are fitted where nobody says it."""
    return int(np.clip(round(TOGETHER_S / length_s), *WINDOWS))


def unlike(cell: Cell, windows: Sequence[Episode], most: int) -> list[Episode]:
    """All windows where they are not more than `most`; else so many that are as unlike each other as can be.

    Hours of slow motion say one thing a thousand times, and a second of a fast one what they cannot. A maximin distance
    design (Johnson, Moore and Ylvisaker 1990, J. Stat. Plan. Inference 26) on what each window holds (`traits`), made
    greedily: the one nearest to the middle of all, then always the one that is farthest from those chosen, which leaves
    no window farther from them than twice the least possible (Gonzalez 1985, Theor. Comput. Sci. 38). No simulation is
    needed, and none is believed.
    """
    ordered = sorted(windows, key=lambda e: (e.start_ns, e.name, e.source))
    if len(ordered) <= most:
        return ordered
    held = traits(cell, ordered)
    chosen = [int(np.argmin(np.sum((held - held.mean(axis=0)) ** 2, axis=1)))]
    away = np.full(len(ordered), np.inf)
    while len(chosen) < most:
        away = np.minimum(away, np.sum((held - held[chosen[-1]]) ** 2, axis=1))
        away[chosen] = -1.0
        chosen.append(int(np.argmax(away)))
    return [ordered[i] for i in sorted(chosen)]


def traits(cell: Cell, windows: Sequence[Episode]) -> Floats:
    """(W, n) mean, rms rate and largest rate of each number of the signals and inputs, in shares of their ranges.

    A number that is still in all windows is left out: its ranges would be those of its noise.
    """
    held = [{track.object: _within(track, window) for track in (*window.tracks, *window.inputs)} for window in windows]
    noise = {signal.name: least_motion(signal) for signal in cell.signals}
    names = dict.fromkeys(name for series in held for name in series)
    return np.concatenate([_of_series([s.get(name) for s in held], noise.get(name, 0.0)) for name in names], axis=1)


def _of_series(held: Sequence[tuple[Floats, Floats] | None], least: float) -> Floats:
    """(W, 3 D) of one signal or input in each window; one without it is as the mean of the others."""
    values = np.concatenate([found[1] for found in held if found])
    moving = [i for i, column in enumerate(values.T) if ranges(column[np.isfinite(column)], least)]
    out = np.full((len(held), 3, values.shape[1]), np.nan)
    for row, found in ((row, found) for row, found in enumerate(held) if found):
        time_s, value = found
        for column in moving:
            out[row, :, column] = _traits(time_s, value[:, column], least)
    flat = out.reshape(len(held), -1)
    seen = np.isfinite(flat)
    mean = np.where(seen, flat, 0.0).sum(axis=0) / np.maximum(seen.sum(axis=0), 1)
    flat = np.where(seen, flat, mean)
    size = np.ptp(flat, axis=0)
    return np.asarray((flat - flat.min(axis=0)) / np.where(size > 0, size, 1.0))


def _traits(time_s: Floats, values: Floats, least: float) -> tuple[float, float, float]:
    """Mean, rms rate and largest rate of (F,) values; no rate where they differ by no more than noise does."""
    seen = np.isfinite(values)
    if not seen.any():
        return np.nan, np.nan, np.nan
    mean = float(np.mean(values[seen]))
    if not ranges(values[seen], least):
        return mean, 0.0, 0.0
    rate = np.diff(values[seen]) / np.maximum(np.diff(time_s[seen]), _NS)
    return mean, float(np.sqrt(np.mean(rate**2))), float(np.max(np.abs(rate)))


def _within(track: Track, window: Episode) -> tuple[Floats, Floats]:
    """(F,) times [s] and (F, D) values while the window's signals are seen."""
    end_ns = max((int(t.stamp_ns[-1]) for t in window.tracks if len(t.stamp_ns)), default=window.start_ns)
    inside = (track.stamp_ns >= window.start_ns) & (track.stamp_ns <= end_ns)
    return (track.stamp_ns[inside] - window.start_ns) * _NS, track.value[inside]


def split(episodes: Sequence[Episode], config: CalibrationConfig) -> tuple[list[Episode], list[Episode]]:
    """Episodes to fit and episodes that are opened after the verdict; the choice depends on names and seed alone."""
    if not episodes:
        raise DataError("no episodes: nothing to calibrate with")

    def rank(episode: Episode) -> str:
        return hashlib.sha256(f"{config.seed}/{episode.name}".encode()).hexdigest()

    count = round(config.held_out_share * len(episodes)) if len(episodes) > 1 else 0
    chosen = {e.name for e in sorted(episodes, key=rank)[:count]}
    ordered = sorted(episodes, key=lambda e: (e.name, e.start_ns))
    return [e for e in ordered if e.name not in chosen], [e for e in ordered if e.name in chosen]
