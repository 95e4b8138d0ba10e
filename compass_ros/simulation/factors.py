"""The K factors of a state: which numbers of an observation they are, and how far two of them lie apart."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from compass_ros.cells import Cell
from compass_ros.cells.signals import Signal
from compass_ros.cells.spec import FactorSpec
from compass_ros.types import Floats

_ANGLES = {"roll": 0, "pitch": 1, "yaw": 2}


def factor_distance(cell: Cell, a: Floats, b: Floats) -> Floats:
    """(..., K) distance by factor between (..., C) observations: 2-norm of positions [m], absolute angle [rad]."""
    a, b = np.broadcast_arrays(a, b)
    return np.stack([_distance(factor, cell.signal(factor.object), a, b) for factor in cell.factors], axis=-1)


def _distance(factor: FactorSpec, signal: Signal, a: Floats, b: Floats) -> Floats:
    start = signal.first
    if factor.part in signal.numbers and signal.jointed:
        column = start + signal.numbers.index(factor.part)
        return np.asarray(np.abs(a[..., column] - b[..., column]))
    if factor.part in ("all", "position"):
        position = slice(start, start + (signal.size if signal.jointed else min(signal.size, 3)))
        return np.asarray(np.linalg.norm(a[..., position] - b[..., position], axis=-1))
    quaternion = [start + 4, start + 5, start + 6, start + 3]  # scipy wants the scalar last
    rotation_a, rotation_b = (Rotation.from_quat(x[..., quaternion].reshape(-1, 4)) for x in (a, b))
    if factor.part == "orientation":
        return np.asarray((rotation_a.inv() * rotation_b).magnitude().reshape(a.shape[:-1]))
    axis = _ANGLES[factor.part]
    difference = rotation_a.as_euler("xyz")[:, axis] - rotation_b.as_euler("xyz")[:, axis]
    return np.asarray(np.abs(np.angle(np.exp(1j * difference))).reshape(a.shape[:-1]))
