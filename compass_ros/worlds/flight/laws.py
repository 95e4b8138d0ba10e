"""The laws of a flight by name: what a perfect observer may call each, and how it is drawn."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from scipy.spatial.transform import Rotation

from compass_ros.worlds import optics
from compass_ros.worlds.draw import log_uniform
from compass_ros.worlds.flight import pushes
from compass_ros.worlds.flight.ball import Acceleration, Ball, Throw
from compass_ros.worlds.flight.drag import SURFACES
from compass_ros.worlds.flight.lift import LIFTS
from compass_ros.worlds.optics import Optics
from compass_ros.worlds.world import UNKNOWN

Push = Callable[[Ball, Throw, pushes.Wind], Acceleration]
_MIDDLE = np.array([10.0, 0.0, 2.0])
"""Of the flights [m]: where the cameras look."""


@dataclass(frozen=True)
class Drawn:
    """A law with its numbers."""

    classes: tuple[str, ...]
    quantities: Mapping[str, float]
    source: str
    push: Push | None = None
    """For each throw, in the wind of the world."""
    wind: pushes.Wind | None = None
    """It moves the air; what it does goes through the drag."""
    optics: Optics | None = None


def drag(rng: Generator, surfaces: Sequence[str] = tuple(SURFACES)) -> Drawn:
    """Over these speeds the exponent of the force lies between 1 and 2.2: a crisis looks like a lower one."""
    name = str(rng.choice(list(surfaces)))
    share = float(rng.uniform(0.85, 1.15))  # scatter between balls of a kind: Goff et al. (2017), Eur. J. Phys. 38
    surface = SURFACES[name]

    def push(ball: Ball, throw: Throw, wind: pushes.Wind) -> Acceleration:
        return pushes.drag(ball, surface.coefficient, wind, share)

    crisis = {"football", "smooth", "baseball"}
    classes = ("quadratic_drag", "viscous_drag") if name in crisis else ("quadratic_drag",)
    return Drawn(classes, {"share": share}, f"{name}: {surface.source}", push)


def crisis(rng: Generator) -> Drawn:
    """A coefficient that falls with the speed, where the cell has a constant one: less force at speed, more below."""
    name = str(rng.choice(["football", "smooth", "baseball"]))

    def push(ball: Ball, throw: Throw, wind: pushes.Wind) -> Acceleration:
        real = pushes.drag(ball, SURFACES[name].coefficient, wind)
        known = pushes.drag(ball, pushes.constant(ball.known_drag), wind)
        return lambda *state: np.asarray(real(*state) - known(*state))

    return Drawn(("viscous_drag", "quadratic_drag", UNKNOWN), {}, f"{name}: {SURFACES[name].source}", push)


def magnus(rng: Generator) -> Drawn:
    name, share = str(rng.choice(list(LIFTS))), float(rng.uniform(0.85, 1.15))

    def push(ball: Ball, throw: Throw, wind: pushes.Wind) -> Acceleration:
        return pushes.lift(ball, LIFTS[name].coefficient, throw.spin_rads, share)

    return Drawn(("magnus",), {"share": share}, f"{name}: {LIFTS[name].source}", push)


def buoyancy(rng: Generator) -> Drawn:
    """Weight alone is less: in free flight a longer metre or a slower clock looks the same."""
    classes = ("buoyancy", "scale", "camera_scale", "clock_drift", "parameter")
    source = "Lamb (1932), Hydrodynamics, section 92"
    return Drawn(classes, {}, source, lambda ball, throw, wind: pushes.buoyancy(ball))


def wind(rng: Generator) -> Drawn:
    speed, heading = float(log_uniform(rng, 0.03, 0.3)), float(rng.uniform(-np.pi, np.pi))
    rough = float(log_uniform(rng, 3e-3, 5e-2))  # cut grass to a field: Stull (1988), figure 9.6
    numbers = {"friction_speed_ms": speed, "heading_rad": heading, "roughness_m": rough}
    blows = pushes.boundary_layer(speed, heading, rough)
    return Drawn(("wind",), numbers, "Stull (1988), Boundary Layer Meteorology, 9.7.1", wind=blows)


def clock_drift(rng: Generator) -> Drawn:
    """59.94 frames that were taken for 60, or quartz. What flies freely shows it as another gravity."""
    excess = float(rng.choice([-1.0, 1.0]) * (1 / 1001 if rng.random() < 0.5 else log_uniform(rng, 2e-4, 4e-3)))
    classes = ("clock_drift", "scale", "camera_scale", "buoyancy", "parameter")
    fault = Optics(stamp=optics.fast_clock(excess))
    return Drawn(classes, {"excess": excess}, "SMPTE 170M (2004): 1000/1001", optics=fault)


def camera_scale(rng: Generator) -> Drawn:
    ratio = 1 + float(rng.choice([-1.0, 1.0]) * log_uniform(rng, 1e-3, 1.5e-2))
    classes = ("camera_scale", "scale", "clock_drift", "buoyancy", "parameter")
    source = "wand calibration: Chiari et al. (2005), Gait and Posture 21, 197"
    return Drawn(classes, {"ratio": ratio}, source, optics=Optics(place=optics.scaled(ratio, np.zeros(3))))


def camera_rotation(rng: Generator) -> Drawn:
    """A frame that does not lie level. What flies freely shows it as a gravity that leans."""
    angle, about = float(log_uniform(rng, 2e-3, 2e-2)), float(rng.uniform(-np.pi, np.pi))
    level = Rotation.from_rotvec([angle * np.cos(about), angle * np.sin(about), 0.0])
    classes = ("camera_rotation", "rotation", "gravity_tilt", "parameter")
    source = "Chiari et al. (2005), Gait and Posture 21, 197"
    return Drawn(classes, {"angle_rad": angle, "about_rad": about}, source, optics=Optics(level=level))


def lens(rng: Generator) -> Drawn:
    """What a poor calibration leaves of a lens (k1 of -0.2 to -0.3 at wide angle): a share of it."""
    k1 = float(rng.choice([-1.0, 1.0]) * log_uniform(rng, 5e-3, 6e-2))
    k2, p1, p2 = (float(x) for x in rng.normal(0, 1, 3) * [0.1 * abs(k1), 1e-3, 1e-3])
    place = optics.lens(k1, k2, p1, p2, _MIDDLE[[0, 2]], 15.0, (0, 2))
    numbers = {"k1": k1, "k2": k2, "p1": p1, "p2": p2, "distance_m": 15.0}
    return Drawn(("lens_distortion",), numbers, "Brown (1966), Photogramm. Eng. 32, 444", optics=Optics(place=place))


def knuckle(rng: Generator) -> Drawn:
    """0.05 to 0.4 of the weight: Watts and Sawyer found up to 0.3 at 21 m/s."""
    share = float(log_uniform(rng, 0.05, 0.4))

    def push(ball: Ball, throw: Throw, wind: pushes.Wind) -> Acceleration:
        return pushes.knuckle(share * abs(ball.gravity), throw.spin_rads, throw.orientation)

    return Drawn((UNKNOWN,), {"share_of_weight": share}, "Watts and Sawyer (1975), Am. J. Phys. 43, 960", push)


def gusts(rng: Generator) -> Drawn:
    rms, length = float(log_uniform(rng, 0.7, 3.0)), float(rng.uniform(3.0, 15.0))
    blows = pushes.turbulence(rms, length, 6.0, rng)
    return Drawn((UNKNOWN,), {"rms_ms": rms, "length_m": length}, "MIL-F-8785C (1980), Dryden spectrum", wind=blows)


def plume(rng: Generator) -> Drawn:
    peak, width, at = float(log_uniform(rng, 1.0, 4.0)), float(rng.uniform(0.8, 2.0)), float(rng.uniform(5, 12))
    numbers = {"peak_ms": peak, "width_m": width, "x_m": at}

    def push(ball: Ball, throw: Throw, wind: pushes.Wind) -> Acceleration:
        return pushes.plume(peak, width, at, SURFACES["below_crisis"].coefficient, ball)

    return Drawn((UNKNOWN,), numbers, "Morton, Taylor, Turner (1956), Proc. R. Soc. A 234, 1", push)


def camera_shake(rng: Generator) -> Drawn:
    size, frequency = float(log_uniform(rng, 2e-3, 2e-2)), float(rng.uniform(3.0, 12.0))
    along = np.array([0.0, 0.3, 1.0])
    fault = Optics(shake=optics.shaking(size, frequency, float(rng.uniform(0, 2 * np.pi)), along))
    return Drawn((UNKNOWN,), {"size_m": size, "frequency_hz": frequency}, "a mast's first mode", optics=fault)


DRAW: Mapping[str, Callable[[Generator], Drawn]] = {
    "drag": drag,
    "crisis": crisis,
    "magnus": magnus,
    "wind": wind,
    "buoyancy": buoyancy,
    "clock_drift": clock_drift,
    "camera_scale": camera_scale,
    "camera_rotation": camera_rotation,
    "lens": lens,
    "knuckle": knuckle,
    "gusts": gusts,
    "plume": plume,
    "camera_shake": camera_shake,
}
