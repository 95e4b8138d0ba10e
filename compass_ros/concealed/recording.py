"""From motion to episodes: frames, stamps and the errors of a tracker."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from scipy.signal import lfilter

from compass_ros.cells import Cell
from compass_ros.concealed.law import PUCKS, Ingredient
from compass_ros.concealed.table import Played
from compass_ros.types import Episode, Floats, Track

RATE = 60.0  # Hz
BEFORE = 0.25  # s of still frames before the command
_EPOCH_NS = 1_750_000_000_000_000_000
_PAUSE_NS = 20_000_000_000
_STAMP_LIMIT = 0.4 / RATE  # s; frames keep their order


@dataclass(frozen=True)
class TrackerNoise:
    """Errors of the recorded positions and stamps."""

    sigma: float = 1e-3
    """[m] of each coordinate."""
    correlation: float = 0.0
    """From one frame to the next, AR(1)."""
    stamp_jitter: float = 0.0
    """[s]."""
    outliers: float = 0.0
    """Share of the frames with another `outlier_sigma` [m] on top."""
    outlier_sigma: float = 8e-3
    missing: float = 0.0
    """Share of the frames in which a puck is not seen."""

    @property
    def repeated(self) -> float:
        """Frames that one independent measurement is worth."""
        return (1 + self.correlation) / (1 - self.correlation)


NOISES = {
    "white": TrackerNoise(),
    "tracker": TrackerNoise(correlation=0.6, stamp_jitter=1.5e-3, outliers=0.007, missing=0.03),
    "none": TrackerNoise(sigma=0.0),
}


def frame_times(duration: float, shots: int, rng: Generator) -> Floats:
    """(S, F) true times of the frames since the command [s]; the camera does not wait for the command."""
    count = int((BEFORE + duration) * RATE)
    phase = rng.uniform(0, 1 / RATE, (shots, 1))
    return np.asarray(-BEFORE + phase + np.arange(count) / RATE)


def seen(played: Played, ingredients: Sequence[Ingredient], time_s: Floats, bias: Floats) -> Floats:
    """(S, F, 4) positions without noise, through the laws of the camera and with the cell's own (2,) bias."""
    sample = played.sample()
    for i in ingredients:
        if i.law.camera is not None:
            sample = i.law.camera(i.size, i.shape, sample)
    return np.asarray(sample(time_s) + np.tile(bias, 2))


def episodes(
    cell: Cell, inputs: Floats, time_s: Floats, positions: Floats, noise: TrackerNoise, rng: Generator
) -> tuple[list[Episode], dict[str, float]]:
    """One episode a shot, and the rms distance that noise alone makes in the frames after each command [m]."""
    out, floor = [], {}
    errors = _errors(positions.shape, noise, rng)
    jitter = np.clip(rng.normal(0, 1, time_s.shape) * noise.stamp_jitter, -_STAMP_LIMIT, _STAMP_LIMIT)
    visible = rng.random((*time_s.shape, 2)) >= noise.missing
    for shot in range(len(inputs)):
        name = f"shot_{shot:02d}"
        start = _EPOCH_NS + shot * _PAUSE_NS + int(rng.integers(1_000_000_000))
        stamps = start + np.round((time_s[shot] + jitter[shot]) * 1e9).astype(np.int64)
        tracks, squares = [], []
        for puck, label in enumerate(PUCKS):
            keep = visible[shot, :, puck]
            own = slice(2 * puck, 2 * puck + 2)
            tracks.append(Track(label, "xy", stamps[keep], (positions + errors)[shot, keep, own]))
            squares.append(np.sum(errors[shot, keep & (time_s[shot] >= 0), own] ** 2, axis=1))
        action = {field.name: float(value) for field, value in zip(cell.action, inputs[shot], strict=True)}
        out.append(Episode(name, cell.name, cell.hash, action, start, tuple(tracks)))
        floor[name] = float(np.sqrt(np.mean(np.concatenate(squares))))
    return out, floor


def _errors(shape: tuple[int, ...], noise: TrackerNoise, rng: Generator) -> Floats:
    """(S, F, 4) [m] correlated in time, of the same size in each frame but for outliers of both coordinates."""
    keep = noise.correlation
    fresh = rng.standard_normal((shape[0], shape[1] + 50, shape[2])) * np.sqrt(1 - keep**2)
    white = lfilter([1.0], [1.0, -keep], fresh, axis=1)[:, 50:]
    wild = np.repeat(rng.random((*shape[:2], 2)) < noise.outliers, 2, axis=2)
    return np.asarray(noise.sigma * white + wild * rng.standard_normal(shape) * noise.outlier_sigma)
