"""A sensor that is mounted askew.

observed = R true, R the rotation by the vector (x, y, z) in the sensor's frame, for each triple of a position, wrench,
gyroscope or accelerometer. Source: error of the extrinsic calibration; `camera_rotation` in three dimensions.
"""

from __future__ import annotations

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from compass_ros.simulation.effects.effect import Context, Effect, Quantity, Sample
from compass_ros.simulation.sites import Site
from compass_ros.types import Floats

_VECTORS = ("xyz", "position", "wrench", "gyro", "accelerometer")


def _sensing(sample: Sample, numbers: Floats, context: Context) -> Sample:
    turned = Rotation.from_rotvec(numbers).as_matrix()  # (B, 3, 3)
    absent = ~numbers.any(axis=1)[:, None, None]

    def rotated(time: Floats) -> Floats:
        seen = sample(time)
        out = seen.copy()
        for site in context.sites:
            for first in range(0, len(site.columns), 3):
                triple = list(site.columns[first : first + 3])
                out[:, :, triple] = np.einsum("bij,bfj->bfi", turned, seen[:, :, triple])
        return np.where(absent, seen, out)

    return rotated


def _unable(model: mujoco.MjModel, site: Site) -> str:
    whole = site.quantity in _VECTORS and len(site.columns) % 3 == 0
    return "" if whole else f"it is no vector in space, but {site.quantity}"


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
