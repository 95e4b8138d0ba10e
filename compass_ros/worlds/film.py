"""Faults of one fixed camera and its clock, drawn: by name, with what a perfect observer may call them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from scipy.spatial.transform import Rotation

from compass_ros.types import Floats
from compass_ros.worlds import optics
from compass_ros.worlds.draw import log_uniform
from compass_ros.worlds.optics import Optics
from compass_ros.worlds.world import UNKNOWN


@dataclass(frozen=True)
class Camera:
    """How it stands to what it films."""

    across: tuple[int, int]
    """The two coordinates that its picture has."""
    centre: Floats
    """(2,) where its axis meets them [m]."""
    distance_m: float
    half_height_m: float
    """Of what it sees along the second coordinate."""

    @property
    def axis(self) -> Floats:
        """(3,) along which it looks."""
        out = np.ones(3)
        out[list(self.across)] = 0.0
        return out


@dataclass(frozen=True)
class Fault:
    """A drawn one."""

    classes: tuple[str, ...]
    quantities: Mapping[str, float]
    source: str
    optics: Optics


def either(rng: Generator, low: float, high: float) -> float:
    """Of both signs, its size uniform in the logarithm."""
    return float(rng.choice([-1.0, 1.0]) * log_uniform(rng, low, high))


def latency(rng: Generator, camera: Camera) -> Fault:
    """Exposure, readout and transfer of industrial cameras: a millisecond to two frames."""
    late = float(log_uniform(rng, 1e-3, 2.5e-2))
    fault = Optics(stamp=lambda time_s: np.asarray(time_s + late))
    return Fault(("latency", "camera_latency"), {"late_s": late}, "EMVA 1288 (2021), section 2", fault)


def clock_drift(rng: Generator, camera: Camera) -> Fault:
    """59.94 frames a second that were taken for 60, and worse clocks."""
    excess = either(rng, 1e-3, 1e-2)
    return Fault(("clock_drift",), {"excess": excess}, "SMPTE 170M (2004)", Optics(stamp=optics.fast_clock(excess)))


def clock_wander(rng: Generator, camera: Camera) -> Fault:
    """A clock that is disciplined over a network: its offset swings. D. L. Mills (1991), IEEE Trans. Commun. 39."""
    size, period, phase = float(log_uniform(rng, 3e-3, 2e-2)), float(rng.uniform(0.5, 1.5)), float(rng.uniform(0, 6.28))

    def stamp(time_s: Floats) -> Floats:
        return np.asarray(time_s + size * (np.sin(2 * np.pi * time_s / period + phase) - np.sin(phase)))

    numbers = {"size_s": size, "period_s": period}
    return Fault((UNKNOWN,), numbers, "Mills (1991), IEEE Trans. Commun. 39, 1482", Optics(stamp=stamp))


def camera_scale(rng: Generator, camera: Camera) -> Fault:
    ratio = 1 + either(rng, 2e-3, 2e-2)
    fault = Optics(place=optics.scaled(ratio, np.zeros(3)))
    source = "wand calibration: Chiari et al. (2005), Gait and Posture 21, 197"
    return Fault(("camera_scale", "scale"), {"ratio": ratio}, source, fault)


def camera_rotation(rng: Generator, camera: Camera) -> Fault:
    angle = either(rng, 2e-3, 2e-2)
    fault = Optics(level=Rotation.from_rotvec(angle * camera.axis))
    source = "Chiari et al. (2005), Gait and Posture 21, 197"
    return Fault(("camera_rotation", "rotation"), {"angle_rad": angle}, source, fault)


def lens(rng: Generator, camera: Camera) -> Fault:
    """What a calibration leaves of a wide lens (k1 of -0.3 to -0.1): some of it, or all."""
    k1 = either(rng, 0.02, 0.3)
    p1, p2 = (float(x) for x in rng.normal(0, 1e-3, 2))
    place = optics.lens(k1, -0.1 * k1, p1, p2, camera.centre, camera.distance_m, camera.across)
    numbers = {"k1": k1, "k2": -0.1 * k1, "p1": p1, "p2": p2, "distance_m": camera.distance_m}
    return Fault(("lens_distortion",), numbers, "Brown (1966), Photogramm. Eng. 32, 444", Optics(place=place))


def rolling_shutter(rng: Generator, camera: Camera) -> Fault:
    """Rows one after the other: 8 to 33 ms a picture for consumer sensors."""
    readout = either(rng, 8e-3, 3.3e-2)
    row = camera.across[1]
    low = float(camera.centre[1]) - camera.half_height_m
    late = optics.rolling(readout, row, low, low + 2 * camera.half_height_m)
    source = "Geyer, Meingast, Sastry (2005), OMNIVIS"
    return Fault(("rolling_shutter",), {"readout_s": readout}, source, Optics(exposure=late))


def camera_shake(rng: Generator, camera: Camera) -> Fault:
    size, frequency = float(log_uniform(rng, 1e-3, 8e-3)), float(rng.uniform(3.0, 12.0))
    along = np.zeros(3)
    along[list(camera.across)] = (0.4, 1.0)
    fault = Optics(shake=optics.shaking(size, frequency, float(rng.uniform(0, 6.28)), along))
    numbers = {"size_m": size, "frequency_hz": frequency}
    return Fault((UNKNOWN,), numbers, "den Hartog (1956), Mechanical Vibrations, 2.3", fault)


DRAW: Mapping[str, Callable[[Generator, Camera], Fault]] = {
    f.__name__: f
    for f in (latency, clock_drift, camera_scale, camera_rotation, lens, rolling_shutter, clock_wander, camera_shake)
}
OUTSIDE = ("clock_wander", "camera_shake")
