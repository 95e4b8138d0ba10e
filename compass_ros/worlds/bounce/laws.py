"""The laws of the bouncing ball by name: what a perfect observer may call each, and how it is drawn."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from scipy.spatial.transform import Rotation

from compass_ros.types import Floats
from compass_ros.worlds import optics
from compass_ros.worlds.bounce.ball import Contact, Extra, Grip, Loose, Push, Rig
from compass_ros.worlds.draw import log_uniform
from compass_ros.worlds.flight.drag import DENSITY
from compass_ros.worlds.flight.lift import LIFTS
from compass_ros.worlds.optics import Optics
from compass_ros.worlds.world import UNKNOWN

PLATES = ("plate1", "plate2")
_SLIDES = 0.02
"""Slip under which friction fades, so that grip has a derivative [m/s]."""


@dataclass(frozen=True)
class Drawn:
    """A law with its numbers. What is made of a rig holds for the world's true parameters."""

    classes: tuple[str, ...]
    quantities: Mapping[str, float]
    source: str
    sites: tuple[str, ...] = ("ball",)
    extra: Callable[[Rig], Extra] | None = None
    grip: Grip | None = None
    push: Callable[[Rig], Push] | None = None
    optics: Optics | None = None
    loose: Loose | None = None
    heats: float = 0.0
    """Share by which the ball's stiffness falls from the first recording to the last."""


def surfaces(rng: Generator) -> tuple[str, ...]:
    """One plate, the other, or both."""
    return (PLATES[:1], PLATES[1:], PLATES)[int(rng.integers(3))]


def hunt_crossley(rng: Generator) -> Drawn:
    """F = F_elastic (1 + 3/2 a x'), so that e = 1 - a v; a of 0.08 to 0.32 s/m for steel to ivory, less for glass."""
    loss = float(log_uniform(rng, 0.003, 0.12))
    source = "Hunt and Crossley (1975), J. Appl. Mech. 42, 440"
    of = lossy(loss)
    return Drawn(("rate_dependent_restitution",), {"loss_sm": loss}, source, surfaces(rng), extra=lambda rig: of)


def lossy(loss_sm: float) -> Extra:
    """What Hunt and Crossley add to an elastic force."""
    return lambda c: np.asarray(1.5 * loss_sm * c.force * c.closing)


def viscoelastic(rng: Generator) -> Drawn:
    """Dissipation of a Hertz contact, proportional to the root of the depth: e = 1 - C v^(1/5)."""
    share = float(log_uniform(rng, 0.1, 0.8))

    def of(rig: Rig) -> Extra:
        give = rig.give("plate1")
        size = share * give.damping * rig.mass / np.sqrt(give.width_m / 2)
        return lambda c: np.asarray(size * np.sqrt(c.depth) * c.closing)

    source = "Kuwabara and Kono (1987), Jpn. J. Appl. Phys. 26, 1230; Falcon et al. (1998), Eur. Phys. J. B 3, 45"
    return Drawn(("rate_dependent_restitution", "parameter"), {"share": share}, source, surfaces(rng), extra=of)


def adhesion(rng: Generator) -> Drawn:
    """A tacky plate holds a sphere with 2 pi w r while they part; coming together they gain next to nothing."""
    work = float(log_uniform(rng, 0.3, 6.0))  # of pressure-sensitive tapes: Gent (1996)

    def of(rig: Rig) -> Extra:
        def hold(c: Contact) -> Floats:
            parting = 0.5 * (1 - np.tanh(c.closing / 0.02))
            return np.asarray(-2 * np.pi * work * rig.radius * parting * np.tanh(c.depth / 2e-4))

        return hold

    source = "Derjaguin, Muller, Toporov (1975), J. Colloid Interface Sci. 53, 314; Gent (1996), Langmuir 12, 4492"
    return Drawn(("adhesion",), {"work_jm2": work}, source, surfaces(rng), extra=of)


def grip(rng: Generator) -> Drawn:
    """Coulomb's friction at the bounce turns the ball until it rolls: Garwin (1969), Cross (2002)."""
    friction = float(log_uniform(rng, 0.005, 0.5))
    source = "Garwin (1969), Am. J. Phys. 37, 88; Cross (2002), Am. J. Phys. 70, 1093"
    classes = ("tangential_impulse", "friction_cone")
    return Drawn(classes, {"friction": friction}, source, surfaces(rng), grip=rubbing(friction))


def rubbing(friction: float) -> Grip:
    """Against the slip, in proportion to what presses."""
    return lambda contact, pressing: np.asarray(-friction * pressing * np.tanh(contact.slip / _SLIDES))


def felt_drag(rng: Generator) -> Drawn:
    """Felt drags more than the smooth sphere of the drawing: 0.55 to 0.65 for new tennis balls, 0.47 bald."""
    beyond = float(rng.uniform(0.05, 0.35))

    def of(rig: Rig) -> Push:
        factor = 0.5 * DENSITY * np.pi * rig.radius**2 * beyond
        return lambda time, place, velocity, spin: np.asarray(
            -factor * np.linalg.norm(velocity, axis=1)[:, None] * velocity
        )

    source = "Mehta and Pallis (2001), Sports Eng. 4, 177"
    return Drawn(("quadratic_drag", "viscous_drag", "parameter"), {"beyond": beyond}, source, push=of)


def magnus(rng: Generator) -> Drawn:
    """A ball that is let go with a spin; the plates of the cell do not change it."""
    spin, name = float(rng.choice([-1.0, 1.0]) * rng.uniform(30, 150)), str(rng.choice(list(LIFTS)))
    curve = LIFTS[name].coefficient

    def of(rig: Rig) -> Push:
        factor = 0.5 * DENSITY * np.pi * rig.radius**2

        def push(time: float, place: Floats, velocity: Floats, turning: Floats) -> Floats:
            speed = np.maximum(np.linalg.norm(velocity, axis=1), 1e-6)
            lift = factor * curve(rig.radius * abs(spin) / speed) * speed * np.sign(spin)
            return np.asarray(lift[:, None] * np.stack([velocity[:, 1], -velocity[:, 0]], axis=1))

        return push

    return Drawn(("magnus",), {"spin_rads": spin}, f"{name}: {LIFTS[name].source}", push=of)


def draught(rng: Generator) -> Drawn:
    """Air that a fan moves along the table: steady wind beyond what the drawing's bounds allow."""
    speed = float(rng.choice([-1.0, 1.0]) * log_uniform(rng, 0.4, 3.0))

    def of(rig: Rig) -> Push:
        factor = rig.values["env@dyna@air_density"] * rig.values["ball@dyna@drag"] * np.pi * rig.radius**2
        blown = np.array([speed, 0.0])

        def push(time: float, place: Floats, velocity: Floats, spin: Floats) -> Floats:
            moving, still = velocity - blown, velocity
            of_speed = [np.linalg.norm(v, axis=1)[:, None] * v for v in (moving, still)]
            return np.asarray(-factor * (of_speed[0] - of_speed[1]))

        return push

    return Drawn(("wind", "crosswind", "parameter"), {"speed_ms": speed}, "Newton (1687), II.40: drag in wind", push=of)


def latency(rng: Generator) -> Drawn:
    """Exposure, readout and transfer of industrial cameras: milliseconds to two frames."""
    late = float(log_uniform(rng, 1e-3, 2.5e-2))
    fault = Optics(stamp=lambda time_s: np.asarray(time_s + late))
    return Drawn(("latency", "camera_latency"), {"late_s": late}, "EMVA 1288 (2021), section 2", optics=fault)


def clock_drift(rng: Generator) -> Drawn:
    excess = float(rng.choice([-1.0, 1.0]) * log_uniform(rng, 1e-3, 1e-2))
    fault = Optics(stamp=optics.fast_clock(excess))
    return Drawn(("clock_drift",), {"excess": excess}, "SMPTE 170M (2004): 1000/1001", optics=fault)


def camera_scale(rng: Generator) -> Drawn:
    ratio = 1 + float(rng.choice([-1.0, 1.0]) * log_uniform(rng, 2e-3, 2e-2))
    fault = Optics(place=optics.scaled(ratio, np.zeros(3)))
    source = "wand calibration: Chiari et al. (2005), Gait and Posture 21, 197"
    return Drawn(("camera_scale", "scale"), {"ratio": ratio}, source, optics=fault)


def camera_rotation(rng: Generator) -> Drawn:
    angle = float(rng.choice([-1.0, 1.0]) * log_uniform(rng, 2e-3, 2e-2))
    fault = Optics(level=Rotation.from_rotvec([0.0, angle, 0.0]))
    source = "Chiari et al. (2005), Gait and Posture 21, 197"
    return Drawn(("camera_rotation", "rotation"), {"angle_rad": angle}, source, optics=fault)


def lens(rng: Generator) -> Drawn:
    k1 = float(rng.choice([-1.0, 1.0]) * log_uniform(rng, 0.02, 0.2))
    p1, p2 = (float(x) for x in rng.normal(0, 1e-3, 2))
    place = optics.lens(k1, 0.1 * k1, p1, p2, np.array([0.0, 0.3]), 1.2, (0, 2))
    source = "Brown (1966), Photogramm. Eng. 32, 444"
    return Drawn(("lens_distortion",), {"k1": k1, "distance_m": 1.2}, source, optics=Optics(place=place))


def loose_plate(rng: Generator) -> Drawn:
    """A plate on a clamp that gives and rings, so that a bounce depends on what the plate is at."""
    plate = str(rng.choice(PLATES))
    mass, frequency = float(log_uniform(rng, 0.5, 8.0)), float(log_uniform(rng, 20, 120))
    loose = Loose(plate, mass, mass * (2 * np.pi * frequency) ** 2, 2 * 0.03 * mass * 2 * np.pi * frequency)
    numbers = {"mass_kg": mass, "frequency_hz": frequency}
    source = "den Hartog (1956), Mechanical Vibrations, 2.2"
    return Drawn((UNKNOWN,), numbers, source, (plate,), loose=loose)


def warming(rng: Generator) -> Drawn:
    """Rubber softens as it warms, from recording to recording. Allen, Bowen, Haake (2013), Sports Eng. 16: squash."""
    share = float(rng.uniform(0.05, 0.3))
    return Drawn((UNKNOWN,), {"share": share}, "Lewis, Arnold, Griffiths (2011), Meas. Sci. Technol. 22", heats=share)


def camera_shake(rng: Generator) -> Drawn:
    size, frequency = float(log_uniform(rng, 1e-3, 8e-3)), float(rng.uniform(3.0, 12.0))
    fault = Optics(shake=optics.shaking(size, frequency, float(rng.uniform(0, 6.28)), np.array([0.3, 0.0, 1.0])))
    return Drawn((UNKNOWN,), {"size_m": size, "frequency_hz": frequency}, "a mast's first mode", optics=fault)


def charged(rng: Generator) -> Drawn:
    """A charged ball over a grounded plate at z = 0.2 m: it is drawn to its image, F = k q^2 / (4 d^2)."""
    charge = float(log_uniform(rng, 5e-8, 2.5e-7))

    def of(rig: Rig) -> Push:
        def push(time: float, place: Floats, velocity: Floats, spin: Floats) -> Floats:
            distance = np.maximum(np.abs(place[:, 1] - 0.2), 0.03)
            down = -np.sign(place[:, 1] - 0.2) * 8.99e9 * charge**2 / (4 * distance**2)
            return np.stack([np.zeros(len(place)), np.where(np.abs(place[:, 0] - 0.06) < 0.12, down, 0.0)], axis=1)

        return push

    return Drawn((UNKNOWN,), {"charge_c": charge}, "Jackson (1999), Classical Electrodynamics, 2.1", push=of)


DRAW: Mapping[str, Callable[[Generator], Drawn]] = {
    f.__name__: f
    for f in (
        *(hunt_crossley, viscoelastic, adhesion, grip, felt_drag, magnus, draught, latency, clock_drift, camera_scale),
        *(camera_rotation, lens, loose_plate, warming, camera_shake, charged),
    )
}
OUTSIDE = ("loose_plate", "warming", "camera_shake", "charged")
KNOWN = tuple(name for name in DRAW if name not in OUTSIDE)
