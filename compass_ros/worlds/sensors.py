"""What sensors make of a motion: noise, steps, lost frames, late stamps, clocks; changes in units of the noise."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TypeVar

import numpy as np
from numpy.random import Generator

from compass_ros.types import Bools, Floats, Ints

L = TypeVar("L")
START_NS = 1_000_000_000
"""Stamp of the first moment of a recording."""


def stepped(value: Floats, step: float) -> Floats:
    """What an encoder that counts in `step` shows: the nearest multiple."""
    return np.asarray(np.round(value / step) * step)


def noisy(value: Floats, sigma: float, rng: Generator) -> Floats:
    """White Gaussian noise of one standard deviation `sigma` on every number."""
    return np.asarray(value + sigma * rng.normal(size=value.shape))


def total_noise(sigma: float, step: float) -> float:
    """Standard deviation of white noise and of the rounding to a step, which is uniform over it."""
    return float(np.hypot(sigma, step / np.sqrt(12)))


def kept(count: int, lost: float, rng: Generator) -> Bools:
    """(count,) which frames arrive; each is lost with the probability `lost`, never the first or the last."""
    arrives = rng.random(count) >= lost
    arrives[[0, -1]] = True
    return np.asarray(arrives)


def stamps(time_s: Floats, drift_ppm: float = 0.0, jitter_s: float = 0.0, rng: Generator | None = None) -> Ints:
    """(F,) stamps of frames at (F,) increasing moments, by a clock that is fast by `drift_ppm`.

    With jitter each stamp is late by the size of a normal number, and at least one nanosecond after the one before.
    """
    shown = time_s * (1 + 1e-6 * drift_ppm)
    if rng is not None and jitter_s > 0:
        shown = shown + jitter_s * np.abs(rng.normal(size=len(time_s)))
    found = START_NS + np.round(shown * 1e9).astype(np.int64)
    order = np.arange(len(found))
    return np.asarray(np.maximum.accumulate(found - order) + order)


def strength(with_laws: Floats, without: Floats, noise: Floats | float) -> float:
    """rms of a change of (..., C) signals, over one standard deviation of the noise of each, (C,) or one for all."""
    return float(np.sqrt(np.mean(((with_laws - without) / noise) ** 2)))


def strengths(
    laws: Mapping[str, L], see: Callable[[Mapping[str, L]], Floats], noise: Floats | float
) -> tuple[dict[str, float], float]:
    """`strength` of each law where the others stay, and of all together.

    Args:
        laws: Of the world, by name.
        see: (N, C) what the sensors would show without noise, in the same frames for any laws.
        noise: As `strength` takes it.
    """
    full = see(laws)
    alone = {left: strength(full, see({n: law for n, law in laws.items() if n != left}), noise) for left in laws}
    return alone, strength(full, see({}), noise) if laws else 0.0
