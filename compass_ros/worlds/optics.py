"""What cameras and their clocks do to what they see: changes of places, of moments and of stamps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from compass_ros.types import Floats

Points = Callable[[Floats], Floats]
"""(F, 3) true places [m] -> (F, 3) places as seen."""


@dataclass(frozen=True)
class Optics:
    """One fault of a camera; what it does not have is left as it is."""

    place: Points | None = None
    level: Rotation | None = None
    """How the frame lies that it was calibrated with: turns places about the origin, and orientations."""
    exposure: Callable[[Floats], Floats] | None = None
    """(F, 3) places -> (F,) how much later than its stamp each was taken [s]."""
    stamp: Callable[[Floats], Floats] | None = None
    """(F,) true moments [s] -> what the camera's clock shows."""
    shake: Callable[[Floats], Floats] | None = None
    """(F,) moments [s] -> (F, 3) added to what is seen [m]."""


def through(faults: tuple[Optics, ...], pose: Callable[[Floats], Floats], time_s: Floats) -> Floats:
    """(F, D) what is seen of `pose` (F,) -> (F, D) in frames at (F,) moments; the first three numbers are places."""
    late = np.zeros_like(time_s)
    for fault in faults:
        if fault.exposure is not None:
            late = late + fault.exposure(pose(time_s)[:, :3])
    seen = pose(time_s + late)
    for fault in faults:
        if fault.place is not None:
            seen = np.concatenate([fault.place(seen[:, :3]), seen[:, 3:]], axis=1)
        if fault.level is not None:
            seen = _levelled(seen, fault.level)
        if fault.shake is not None:
            seen = np.concatenate([seen[:, :3] + fault.shake(time_s), seen[:, 3:]], axis=1)
    return seen


def _levelled(seen: Floats, level: Rotation) -> Floats:
    """(F, 3) places, or (F, 7) with quaternions w, x, y, z, in a frame that is turned."""
    out = seen.copy()
    out[:, :3] = level.apply(seen[:, :3])
    if seen.shape[1] == 7:
        turned = (level * Rotation.from_quat(np.roll(seen[:, 3:], -1, axis=1))).as_quat()
        same = np.sign(np.sum(np.roll(turned, 1, axis=1) * seen[:, 3:], axis=1))
        out[:, 3:] = np.roll(turned, 1, axis=1) * same[:, None]
    return out


def shown(faults: tuple[Optics, ...], time_s: Floats) -> Floats:
    """(F,) what the clock shows at (F,) moments [s]."""
    for fault in faults:
        if fault.stamp is not None:
            time_s = fault.stamp(time_s)
    return time_s


def taken(faults: tuple[Optics, ...], shown_s: Floats) -> Floats:
    """(F,) when frames were taken whose stamps show (F,) moments [s], to first order in what the clock is off."""
    return 2 * shown_s - shown(faults, shown_s)


def scaled(ratio: float, origin: Floats) -> Points:
    """A calibration wand that is longer than it says: all lengths from the (3,) origin by `ratio`."""
    return lambda points: np.asarray(origin + ratio * (points - origin))


def lens(k1: float, k2: float, p1: float, p2: float, axis: Floats, dist_m: float, across: tuple[int, int]) -> Points:
    """A lens whose distortion was not taken out: (x, y) over the distance goes to

    x (1 + k1 r^2 + k2 r^4) + 2 p1 x y + p2 (r^2 + 2 x^2), y likewise. D. C. Brown (1966), Photogramm. Eng. 32, 444; A.
    E. Conrady (1919). `across`: which coordinates the picture has; `axis`: (2,) where the optical axis meets them [m].
    """
    first, second = across

    def place(points: Floats) -> Floats:
        x, y = (points[:, first] - axis[0]) / dist_m, (points[:, second] - axis[1]) / dist_m
        r2 = x**2 + y**2
        radial = 1 + k1 * r2 + k2 * r2**2
        out = points.copy()
        out[:, first] = axis[0] + dist_m * (x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x**2))
        out[:, second] = axis[1] + dist_m * (y * radial + 2 * p2 * x * y + p1 * (r2 + 2 * y**2))
        return out

    return place


def rolling(readout_s: float, coordinate: int, low: float, high: float) -> Callable[[Floats], Floats]:
    """Rows of a CMOS sensor read one after the other in `readout_s`: the row of `low` at the stamp, that of `high` at
    its end. C. Geyer, M. Meingast, S. Sastry (2005), OMNIVIS."""
    return lambda points: np.asarray(readout_s * (points[:, coordinate] - low) / (high - low))


def fast_clock(excess: float) -> Callable[[Floats], Floats]:
    """A clock that runs fast by the share `excess`."""
    return lambda time_s: np.asarray(time_s * (1 + excess))


def shaking(size_m: float, frequency_hz: float, phase: float, along: Floats) -> Callable[[Floats], Floats]:
    """A camera whose mast sways at its own frequency: a sine along (3,) `along`."""
    return lambda time_s: np.outer(size_m * np.sin(2 * np.pi * frequency_hz * time_s + phase), along)
