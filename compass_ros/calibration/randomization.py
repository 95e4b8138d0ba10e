"""Causality-guided domain randomisation (Algorithm 2 of the paper)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from compass_ros.types import Bools, Floats, Parameter


@dataclass(frozen=True)
class Box:
    """Where parameters are randomised and may move in one iteration: low <= value <= high, equal where fixed."""

    low: Floats
    """(P,)"""
    high: Floats
    """(P,)"""


def active_parameters(psi: Floats, threshold: float) -> Bools:
    """(P, K) -> (P,) whether max_k psi_rk > threshold."""
    return np.asarray(psi.max(axis=1) > threshold)


def randomised_box(values: Floats, active: Bools, parameters: tuple[Parameter, ...]) -> Box:
    """The interval value +- half-width of each active parameter, cut at its bounds; a point for the others."""
    half = np.where(active, [p.half_width for p in parameters], 0.0)
    low = np.maximum(values - half, np.minimum(values, [p.low for p in parameters]))
    high = np.minimum(values + half, np.maximum(values, [p.high for p in parameters]))
    return Box(low, high)


def randomise(box: Box, count: int, generator: np.random.Generator) -> Floats:
    """(count, P) values drawn uniformly from the box."""
    return box.low + (box.high - box.low) * generator.random((count, len(box.low)))
