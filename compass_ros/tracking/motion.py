"""Motion of one object between images: a Kalman filter with constant velocity.

The filter predicts where to look, keeps identities and bridges occlusions. What is published of a seen object is the
measurement itself, never the filtered position, which would lag behind every collision.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from compass_ros.types import Floats

_FIRST_SPEED_STD = 1.0
"""Speed of an object seen for the first time [m/s]."""


@dataclass(frozen=True)
class Motion:
    """Position and velocity of one object at a time."""

    stamp_ns: int
    seen_ns: int
    """Stamp of the last image in which the object was seen."""
    mean: Floats
    """(4,) x, y [m], vx, vy [m/s] in the frame `table`."""
    covariance: Floats
    """(4, 4)."""


def first_motion(stamp_ns: int, xy: Floats, covariance: Floats) -> Motion:
    """Motion from the first sighting: position (2,) [m] with covariance (2, 2), velocity unknown."""
    spread = np.diag([0.0, 0.0, _FIRST_SPEED_STD**2, _FIRST_SPEED_STD**2])
    spread[:2, :2] = covariance
    return Motion(stamp_ns, stamp_ns, np.array([*xy, 0.0, 0.0]), spread)


def predict(motion: Motion, stamp_ns: int, acceleration_std: float) -> Motion:
    """Motion at a later stamp. `acceleration_std` [m/s^2]: constant over the interval, unknown."""
    dt = (stamp_ns - motion.stamp_ns) * 1e-9
    step = np.eye(4)
    step[0, 2] = step[1, 3] = dt
    gain = np.array([[dt * dt / 2, 0], [0, dt * dt / 2], [dt, 0], [0, dt]])
    covariance = step @ motion.covariance @ step.T + gain @ gain.T * acceleration_std**2
    return Motion(stamp_ns, motion.seen_ns, step @ motion.mean, covariance)


def correct(predicted: Motion, xy: Floats, covariance: Floats) -> Motion:
    """Motion after a measurement (2,) [m] with covariance (2, 2) at the predicted stamp.

    A measurement far from the prediction means a collision: the old velocity is forgotten and the new one is learnt
    from the next image.
    """
    innovation = xy - predicted.mean[:2]
    total = predicted.covariance[:2, :2] + covariance
    if innovation @ np.linalg.solve(total, innovation) > 25.0:
        loosened = predicted.covariance + np.diag([0.0, 0.0, _FIRST_SPEED_STD**2, _FIRST_SPEED_STD**2])
        dt = max((predicted.stamp_ns - predicted.seen_ns) * 1e-9, 1e-3)
        # the unknown new velocity has acted for up to dt, which ties the position's error to the velocity's
        loosened[:2, :2] += np.eye(2) * (_FIRST_SPEED_STD * dt) ** 2
        loosened[:2, 2:] += np.eye(2) * _FIRST_SPEED_STD**2 * dt
        loosened[2:, :2] += np.eye(2) * _FIRST_SPEED_STD**2 * dt
        predicted = Motion(predicted.stamp_ns, predicted.seen_ns, predicted.mean, loosened)
        total = predicted.covariance[:2, :2] + covariance
    gain = np.linalg.solve(total, predicted.covariance[:2]).T
    mean = predicted.mean + gain @ innovation
    keep = np.eye(4)
    keep[:, :2] -= gain
    posterior = keep @ predicted.covariance @ keep.T + gain @ covariance @ gain.T
    return Motion(predicted.stamp_ns, predicted.stamp_ns, mean, posterior)
