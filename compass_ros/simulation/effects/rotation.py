"""A sensor that is mounted askew.

observed = R true, R the rotation by the vector (x, y, z) in the sensor's frame, for each triple of a position, wrench,
gyroscope or accelerometer, and for a pose's orientation. Source: error of the extrinsic calibration; `camera_rotation`
in three dimensions.
"""

from __future__ import annotations

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from compass_ros.simulation.effects.effect import Context, Effect, Quantity, Sample
from compass_ros.simulation.sites import Site
from compass_ros.types import Floats

_VECTORS = ("xyz", "position", "pose", "wrench", "gyro", "accelerometer")
_POSE = 7
"""Numbers of a pose."""


def _sensing(sample: Sample, numbers: Floats, context: Context) -> Sample:
    turn = Rotation.from_rotvec(numbers)
    matrix, quaternion = turn.as_matrix(), turn.as_quat()[:, None]  # (B, 3, 3), (B, 1, 4) with the scalar last
    absent = ~numbers.any(axis=1)[:, None, None]

    def rotated(time: Floats) -> Floats:
        seen = sample(time)
        out = seen.copy()
        for site in context.sites:
            vectors = site.columns[:3] if len(site.columns) == _POSE else site.columns
            for first in range(0, len(vectors), 3):
                triple = list(vectors[first : first + 3])
                out[:, :, triple] = np.einsum("bij,bfj->bfi", matrix, seen[:, :, triple])
            if len(site.columns) == _POSE:
                out[:, :, site.columns[3:]] = product(quaternion, seen[:, :, site.columns[3:]])
        return np.where(absent, seen, out)

    return rotated


def product(one: Floats, other: Floats) -> Floats:
    """(B, F, 4) of a (B, 1, 4) quaternion with the scalar last and (B, F, 4) with it first, as these are."""
    v, w, scalar, vector = one[..., :3], one[..., 3:], other[..., :1], other[..., 1:]
    along = np.sum(v * vector, axis=-1, keepdims=True)
    return np.concatenate([w * scalar - along, w * vector + scalar * v + np.cross(v, vector)], axis=-1)


def _unable(model: mujoco.MjModel, site: Site) -> str:
    whole = len(site.columns) == _POSE if site.quantity == "pose" else not len(site.columns) % 3
    return "" if site.quantity in _VECTORS and whole else "it is no vector in space"


EFFECT = Effect(
    name="rotation",
    channel="sensing",
    quantities=tuple(Quantity(axis, "rad", -0.3, 0.3, 0.02) for axis in "xyz"),
    sentence="a rotation of the sensor",
    on=("camera", "sensor"),
    sensing=_sensing,
    unable=_unable,
    by_name=True,
)
