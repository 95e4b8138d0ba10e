"""How far apart two observations are: each signal on its own manifold.

An orientation has three degrees of freedom and four numbers. What was measured is kept as its rotation vector in the
first three of its columns, with NaN in the fourth, so that an observation counts as many numbers as it has; the
difference is the rotation vector from the measured to the predicted orientation, in the measured body's frame (the
logarithm of SO(3); Sola, Deray and Atchuthan 2018, eq. 25).
"""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from compass_ros.cells import Cell
from compass_ros.types import Floats

_SCALAR_LAST = [1, 2, 3, 0]


def charted(cell: Cell, measured: Floats) -> Floats:
    """(..., C) what was measured, with quaternions as rotation vectors [rad]."""
    out = measured.copy()
    for quaternion in _orientations(cell):
        values = measured[..., quaternion]
        seen = ~np.isnan(values).any(axis=-1)
        vectors = np.full(values.shape, np.nan)
        vectors[seen, :3] = Rotation.from_quat(values[seen][:, _SCALAR_LAST]).as_rotvec() if seen.any() else 0.0
        out[..., quaternion] = vectors
    return out


def apart(cell: Cell, predicted: Floats, chart: Floats) -> Floats:
    """(..., C) predicted less what was measured (`charted`); NaN where nothing was."""
    out: Floats = predicted - chart
    for quaternion in _orientations(cell):
        here = np.broadcast_to(chart, out.shape)[..., quaternion][..., :3]
        turned = np.full((*here.shape[:-1], 4), np.nan)
        seen = ~np.isnan(here).any(axis=-1)
        if seen.any():
            there = Rotation.from_quat(predicted[..., quaternion][seen][:, _SCALAR_LAST])
            turned[seen, :3] = (Rotation.from_rotvec(here[seen]).inv() * there).as_rotvec()
        out[..., quaternion] = turned
    return out


def on_manifold(cell: Cell, sigma: Floats) -> Floats:
    """(..., C) standard deviations of the differences from those of the (..., C) observed numbers.

    A rotation by a small vector v moves a quaternion by |v| / 2, so the variances of its four numbers sum to a
    quarter of those of the three of v.
    """
    out = sigma.copy()
    for quaternion in _orientations(cell):
        out[..., quaternion] = 2 * np.sqrt(np.sum(sigma[..., quaternion] ** 2, axis=-1, keepdims=True) / 3)
    return out


def _orientations(cell: Cell) -> list[slice]:
    """Columns of the quaternions."""
    return [slice(s.first + 3, s.first + 7) for s in cell.signals if s.quantity == "pose"]
