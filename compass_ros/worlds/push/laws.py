"""The laws of the pushed bar by name: frictions of real surfaces, and drives that are not what they were told."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from compass_ros.types import Floats
from compass_ros.worlds import film
from compass_ros.worlds.draw import log_uniform
from compass_ros.worlds.film import Camera
from compass_ros.worlds.optics import Optics
from compass_ros.worlds.push.bar import PHASE_S, Drive, Feet, Told
from compass_ros.worlds.world import UNKNOWN

CAMERA = Camera((0, 1), np.array([0.1, 0.0]), 0.8, 0.25)
Ratio = Callable[[Feet], Floats]
"""(S, 3, 1) or (S, 3, 2): friction of each foot over that of the cell, by component of the slip."""


@dataclass(frozen=True)
class Drawn:
    """A law with its numbers."""

    classes: tuple[str, ...]
    quantities: Mapping[str, float]
    source: str
    sites: tuple[str, ...] = ("bar",)
    ratio: Ratio | None = None
    viscous_1s: float = 0.0
    """Of each foot: force over load and slip, times g [1/s]."""
    drive: Drive | None = None
    push_friction: float = 0.0
    optics: Optics | None = None


def speed_of(feet: Feet) -> Floats:
    """(S, 3, 1) [m/s]."""
    return np.asarray(np.sqrt(np.sum(feet.slip**2, axis=2, keepdims=True)))


def stribeck(rng: Generator) -> Drawn:
    """1 + a exp(-(v / vs)^n): n of 1/2 to 1 for dry metals (Bo and Pavelescu), 2 by Armstrong-Helouvry."""
    more, at = float(rng.choice([1.0, 1.0, -0.5]) * rng.uniform(0.15, 1.2)), float(log_uniform(rng, 0.02, 0.15))
    power = float(rng.choice([0.5, 1.0, 2.0]))

    def ratio(feet: Feet) -> Floats:
        return np.asarray(1 + more * np.exp(-((speed_of(feet) / at) ** power)))

    numbers = {"more": more, "speed_ms": at, "power": power}
    source = "Bo and Pavelescu (1982), Wear 82, 277; Armstrong-Helouvry (1991), Control of Machines with Friction"
    return Drawn(("stribeck_friction",), numbers, source, ratio=ratio)


def film_of_oil(rng: Generator) -> Drawn:
    """Shear of a thin film: force in proportion to the slip."""
    rate = float(log_uniform(rng, 0.4, 12.0))
    source = "Armstrong-Helouvry (1991), Control of Machines with Friction, 2.3"
    return Drawn(("viscous_drag",), {"rate_1s": rate}, source, viscous_1s=rate)


def brushed(rng: Generator) -> Drawn:
    """Force = -C s, s the direction of slip, C with other coefficients along and across the brushing."""
    over, turn = float(rng.uniform(0.1, 0.8)), float(rng.uniform(-np.pi / 2, np.pi / 2))
    axis = np.array([np.cos(turn), np.sin(turn)])

    def ratio(feet: Feet) -> Floats:
        along = np.einsum("sfk,k->sf", feet.slip, axis)[:, :, None] * axis
        scaled = feet.slip + over * along
        return np.asarray(scaled / np.where(np.abs(feet.slip) < 1e-9, 1.0, feet.slip))

    source = "Zmitrowicz (1981), Int. J. Eng. Sci. 19, 1489"
    return Drawn(("anisotropic_friction",), {"over": over, "angle_rad": turn}, source, ratio=ratio)


def spill(rng: Generator) -> Drawn:
    """A stain of dust or oil, with an edge of a centimetre: cleanliness alone moves friction by a factor of two."""
    change = float(rng.choice([-1.0, 1.0]) * rng.uniform(0.15, 0.7))
    x, y, radius = float(rng.uniform(0.02, 0.12)), float(rng.uniform(-0.08, 0.08)), float(rng.uniform(0.03, 0.08))

    def ratio(feet: Feet) -> Floats:
        away = np.sqrt(np.sum((feet.place - [x, y]) ** 2, axis=2, keepdims=True))
        return np.asarray(1 + change * 0.5 * (1 - np.tanh((away - radius) / 0.01)))

    numbers = {"change": change, "x_m": x, "y_m": y, "radius_m": radius}
    return Drawn(("friction_patch",), numbers, "Rabinowicz (1995), Friction and Wear of Materials, 4.10", ratio=ratio)


def wedge(rng: Generator) -> Drawn:
    """Friction that grows across the table, as humidity of paper and board does."""
    slope, turn = float(rng.uniform(0.5, 5.0)), float(rng.uniform(-np.pi, np.pi))
    along = np.array([np.cos(turn), np.sin(turn)])

    def ratio(feet: Feet) -> Floats:
        return np.asarray(np.clip(1 + slope * (feet.place @ along), 0.1, 3.0)[:, :, None])

    source = "Yu, Bauza, Fazeli, Rodriguez (2016), IROS: friction of MIT's pushing boards by place"
    return Drawn(("friction_gradient",), {"slope_1m": slope, "angle_rad": turn}, source, ratio=ratio)


def rubbing_tool(rng: Generator) -> Drawn:
    """Coulomb friction where the tool touches: Lynch and Mason (1996), stable pushing."""
    friction = float(log_uniform(rng, 0.03, 0.8))
    source = "Lynch and Mason (1996), Int. J. Robot. Res. 15, 533"
    classes = ("tangential_impulse", "friction_cone")
    return Drawn(classes, {"friction": friction}, source, ("tool", "bar"), push_friction=friction)


_TOOL = ("tool_vx", "tool_vy")


def late_drive(rng: Generator) -> Drawn:
    """Fieldbus and controller: a few to 120 ms between command and motion."""
    late = float(log_uniform(rng, 0.006, 0.12))

    def drive(told: Told) -> Told:
        return lambda time: told(time - late)

    source = "Andersen et al. (2015), ICAR: delays of UR robots"
    return Drawn(("actuation_delay",), {"late_s": late}, source, _TOOL, drive=drive)


def slow_drive(rng: Generator) -> Drawn:
    """A speed loop of first order: what was commanded arrives with a time constant."""
    constant = float(log_uniform(rng, 0.015, 0.25))

    def drive(told: Told) -> Told:
        def filtered(time: float) -> Floats:
            out, before = 0.0 * told(0.0), 0.0 * told(0.0)
            for start in (0.0, PHASE_S, 2 * PHASE_S):
                if time > start:
                    after = told(start)
                    out, before = out + (after - before) * (1 - np.exp(-(time - start) / constant)), after
            return np.asarray(out)

        return filtered

    source = "Franklin, Powell, Emami-Naeini (2015), Feedback Control of Dynamic Systems, 3.3"
    return Drawn(("first_order_lag",), {"constant_s": constant}, source, _TOOL, drive=drive)


def weak_drive(rng: Generator) -> Drawn:
    """A drive that reaches only so much speed on each axis."""
    most = float(rng.uniform(0.15, 0.36))

    def drive(told: Told) -> Told:
        return lambda time: np.clip(told(time), -most, most)

    source = "Krause, Wasynczuk, Sudhoff (2013), Electric Machinery, 2.5: speed at the voltage limit"
    return Drawn(("velocity_saturation",), {"most_ms": most}, source, _TOOL, drive=drive)


def run_in(rng: Generator) -> Drawn:
    """Friction that falls with the way that was slid since the bar was put down."""
    more, way = float(rng.uniform(0.2, 1.2)), float(rng.uniform(0.02, 0.08))

    def ratio(feet: Feet) -> Floats:
        return np.asarray(1 + more * np.exp(-feet.path / way))[:, None, None]

    source = "Blau (2005), Tribol. Int. 38, 1007"
    return Drawn((UNKNOWN,), {"more": more, "way_m": way}, source, ratio=ratio)


def corrugated(rng: Generator) -> Drawn:
    """A grooved board: friction repeats with the place."""
    depth, period = float(rng.uniform(0.2, 0.8)), float(rng.uniform(0.03, 0.08))
    phase = float(rng.uniform(0, 2 * np.pi))

    def ratio(feet: Feet) -> Floats:
        return np.asarray(1 + depth * np.sin(2 * np.pi * feet.place[:, :, :1] / period + phase))

    source = "Fagiani and Barbieri (2014), Tribol. Int. 76: periodic textures"
    return Drawn((UNKNOWN,), {"depth": depth, "period_m": period}, source, ratio=ratio)


def of_camera(name: str) -> Callable[[Generator], Drawn]:
    def drawn(rng: Generator) -> Drawn:
        fault = film.DRAW[name](rng, CAMERA)
        return Drawn(fault.classes, fault.quantities, fault.source, optics=fault.optics)

    return drawn


_OWN = (stribeck, film_of_oil, brushed, spill, wedge, rubbing_tool, late_drive, slow_drive, weak_drive)
_SEEN = ("latency", "camera_scale", "camera_rotation", "rolling_shutter", "camera_shake")
"""What shows where a bar moves by some centimetres; a lens and a clock would not."""
_OUTSIDE = (run_in, corrugated)
DRAW: Mapping[str, Callable[[Generator], Drawn]] = {f.__name__: f for f in (*_OWN, *_OUTSIDE)} | {
    name: of_camera(name) for name in _SEEN
}
OUTSIDE = ("run_in", "corrugated", "camera_shake")
KNOWN = tuple(name for name in DRAW if name not in OUTSIDE)
