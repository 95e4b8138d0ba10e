"""The laws of the table by name: cushions, rails, air and drives of real ones."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from compass_ros.types import Floats
from compass_ros.worlds import film
from compass_ros.worlds.draw import log_uniform
from compass_ros.worlds.film import Camera, either
from compass_ros.worlds.flight.drag import DENSITY
from compass_ros.worlds.optics import Optics
from compass_ros.worlds.table.discs import PUCKS, RAILS, Extra, Force, Puck, Ratio, Told, Touch
from compass_ros.worlds.world import UNKNOWN

CAMERA = Camera((0, 1), np.array([0.0, 0.0]), 0.9, 0.225)
MASS_KG, RADIUS_M, HEIGHT_M = 0.03, 0.0255, 0.01
_CYLINDER = 1.1 * 2 * RADIUS_M * HEIGHT_M
"""Drag coefficient times area of a puck's rim [m^2]: S. F. Hoerner (1965), Fluid-Dynamic Drag, 3.9."""
GRAVITY = 9.81


@dataclass(frozen=True)
class Drawn:
    """A law with its numbers."""

    classes: tuple[str, ...]
    quantities: Mapping[str, float]
    source: str
    sites: tuple[str, ...] = PUCKS
    force: Force | None = None
    ratio: Ratio | None = None
    extra: Extra | None = None
    grip: float = 0.0
    drive: Callable[[Told], Told] | None = None
    optics: Optics | None = None
    heading_rad: float = 0.0
    jitter: float = 0.0
    """One standard deviation of the share by which a stroke's speed is off."""
    tiring: float = 0.0
    """Share by which the cushion's lift falls from the first shot to the last."""


def pucks(rng: Generator) -> tuple[str, ...]:
    """Both, or one."""
    return (PUCKS, PUCKS, PUCKS[:1], PUCKS[1:])[int(rng.integers(4))]


def partners(rng: Generator) -> tuple[str, ...]:
    """One rail, all rails, or what pucks meet beside them."""
    return ((str(rng.choice(RAILS)),), RAILS, ("obstacle",), PUCKS)[int(rng.integers(4))]


def in_air(velocity: Floats) -> Floats:
    """(S, 2) drag of the rim over the mass, for velocities of the air against the puck [m/s^2]."""
    speed = np.sqrt(np.sum(velocity**2, axis=1, keepdims=True))
    return np.asarray(0.5 * DENSITY * _CYLINDER * speed * velocity / MASS_KG)


def slope(rng: Generator) -> Drawn:
    """Feet that were not levelled: 0.5 to 8 mm/m."""
    angle, turn = float(log_uniform(rng, 5e-4, 8e-3)), float(rng.uniform(-np.pi, np.pi))
    push = GRAVITY * np.sin(angle) * np.array([np.cos(turn), np.sin(turn)])
    numbers = {"angle_rad": angle, "towards_rad": turn}
    source = "Galilei (1638), Discorsi: fall along a plane"
    return Drawn(("table_tilt", "gravity_tilt"), numbers, source, force=lambda p: np.tile(push, (len(p.place), 1)))


def sag(rng: Generator) -> Drawn:
    """A top that hangs between its legs, w = w0 cos(pi x / L) cos(pi y / W), after its first mode: pucks seek the
    middle."""
    depth = float(log_uniform(rng, 2e-4, 3e-3))

    def force(p: Puck) -> Floats:
        kx, ky = np.pi / 0.9, np.pi / 0.45
        x, y = kx * p.place[:, 0], ky * p.place[:, 1]
        down = np.stack([kx * np.sin(x) * np.cos(y), ky * np.cos(x) * np.sin(y)], axis=1)
        return np.asarray(-GRAVITY * depth * down)

    source = "Timoshenko and Woinowsky-Krieger (1959), Theory of Plates and Shells, 30"
    return Drawn(("point_attraction",), {"depth_m": depth}, source, force=force)


def desk_fan(rng: Generator) -> Drawn:
    """A round turbulent jet from beyond the rail at +y: u = 6 U d / s, Gaussian across with a half-width of 0.094 s."""
    speed, at = float(log_uniform(rng, 1.5, 6.0)), float(rng.uniform(-0.25, 0.3))

    def force(p: Puck) -> Floats:
        away = 0.45 - p.place[:, 1]
        axial = np.minimum(6 * speed * 0.1 / np.maximum(away, 0.1), speed)
        wind = axial * np.exp(-np.log(2) * ((p.place[:, 0] - at) / (0.094 * away + 0.05)) ** 2)
        blown = np.stack([np.zeros_like(wind), -wind], axis=1)
        return in_air(blown - p.velocity) - in_air(-p.velocity)

    numbers = {"speed_ms": speed, "x_m": at}
    return Drawn(("fan_field",), numbers, "Pope (2000), Turbulent Flows, 5.1", force=force)


def draught(rng: Generator) -> Drawn:
    """Air that moves over all of the table."""
    speed, turn = float(log_uniform(rng, 0.5, 4.0)), float(rng.uniform(-np.pi, np.pi))
    wind = speed * np.array([np.cos(turn), np.sin(turn)])
    numbers = {"speed_ms": speed, "towards_rad": turn}

    def force(p: Puck) -> Floats:
        return in_air(wind - p.velocity) - in_air(-p.velocity)

    return Drawn(("crosswind", "wind"), numbers, "Hoerner (1965), Fluid-Dynamic Drag, 3.9", force=force)


def vortex(rng: Generator) -> Drawn:
    """A vortex with a core, u = C / (2 pi r) (1 - exp(-r^2 / a^2)): what a blower's outlet leaves above the top."""
    around, core = either(rng, 0.4, 3.0), float(rng.uniform(0.05, 0.15))
    x, y = float(rng.uniform(-0.2, 0.25)), float(rng.uniform(-0.1, 0.1))

    def force(p: Puck) -> Floats:
        away = p.place - [x, y]
        square = np.sum(away**2, axis=1) + 1e-9
        turning = around / (2 * np.pi * square) * (1 - np.exp(-square / core**2))
        wind = turning[:, None] * np.stack([-away[:, 1], away[:, 0]], axis=1)
        return in_air(wind - p.velocity) - in_air(-p.velocity)

    numbers = {"circulation_m2s": around, "core_m": core, "x_m": x, "y_m": y}
    return Drawn(("swirl",), numbers, "Saffman (1992), Vortex Dynamics, 13.1 (Lamb and Oseen)", force=force)


def magnet(rng: Generator) -> Drawn:
    """A dipole under the top and one in the puck, both upright: F = 3 mu0 m m' r (4 h^2 - r^2) / (4 pi R^7)."""
    height, peak = float(rng.uniform(0.04, 0.09)), either(rng, 0.02, 0.4)
    x, y = float(rng.uniform(-0.2, 0.2)), float(rng.uniform(-0.12, 0.12))
    radii = np.linspace(0, 2 * height, 400)
    largest = np.max(radii * (4 * height**2 - radii**2) / (radii**2 + height**2) ** 3.5)

    def force(p: Puck) -> Floats:
        away = p.place - [x, y]
        square = np.sum(away**2, axis=1, keepdims=True)
        return np.asarray(-peak / largest * away * (4 * height**2 - square) / (square + height**2) ** 3.5)

    numbers = {"peak_ms2": peak, "height_m": height, "x_m": x, "y_m": y}
    source = "Yung, Landecker, Villani (1998), Magn. Electr. Sep. 9, 39"
    return Drawn(("point_attraction",), numbers, source, pucks(rng), force=force)


def magnets(rng: Generator) -> Drawn:
    """Upright dipoles in both pucks: F = 3 mu0 m^2 / (4 pi r^4)."""
    at_touch = either(rng, 0.3, 6.0)

    def force(p: Puck) -> Floats:
        away = p.place - p.other
        distance = np.maximum(np.sqrt(np.sum(away**2, axis=1, keepdims=True)), 2 * RADIUS_M)
        return np.asarray(at_touch * (2 * RADIUS_M / distance) ** 4 * away / distance)

    source = "Yung, Landecker, Villani (1998), Magn. Electr. Sep. 9, 39"
    return Drawn(("pair_attraction",), {"at_touch_ms2": at_touch}, source, force=force)


def air_film(rng: Generator) -> Drawn:
    """Shear of the film under a puck, eta A v / h: 20 to 150 um of air."""
    gap = float(log_uniform(rng, 1e-5, 1.5e-4))
    rate = 1.81e-5 * np.pi * RADIUS_M**2 / (gap * MASS_KG)
    numbers = {"gap_m": gap, "rate_1s": rate}
    source = "Batchelor (1967), An Introduction to Fluid Dynamics, 4.8"
    return Drawn(("viscous_drag",), numbers, source, pucks(rng), force=lambda p: -rate * p.velocity)


def clogged(rng: Generator) -> Drawn:
    """Holes that are blocked: where no air comes, a puck rubs more."""
    more, radius = float(log_uniform(rng, 0.3, 4.0)), float(rng.uniform(0.04, 0.12))
    x, y = float(rng.uniform(-0.15, 0.3)), float(rng.uniform(-0.15, 0.15))

    def ratio(p: Puck) -> Floats:
        away = np.sqrt(np.sum((p.place - [x, y]) ** 2, axis=1, keepdims=True))
        return np.asarray(1 + more * 0.5 * (1 - np.tanh((away - radius) / 0.012)))

    numbers = {"more": more, "x_m": x, "y_m": y, "radius_m": radius}
    return Drawn(("friction_patch",), numbers, "Hamrock (2004), Fluid Film Lubrication, 15.4", ratio=ratio)


def weak_end(rng: Generator) -> Drawn:
    """Plenum pressure that falls with the way from the blower: the load that the air leaves grows along the table."""
    rise, turn = float(rng.uniform(0.3, 2.0)), float(rng.choice([0.0, np.pi / 2, np.pi, -np.pi / 2]))
    along = np.array([np.cos(turn), np.sin(turn)])

    def ratio(p: Puck) -> Floats:
        return np.asarray(np.clip(1 + rise * (p.place @ along), 0.1, 3.0)[:, None])

    numbers = {"rise_1m": rise, "towards_rad": turn}
    return Drawn(("friction_gradient",), numbers, "Hamrock (2004), Fluid Film Lubrication, 15.4", ratio=ratio)


def stribeck(rng: Generator) -> Drawn:
    more, at = float(rng.uniform(0.3, 2.0)), float(log_uniform(rng, 0.03, 0.2))
    power = float(rng.choice([0.5, 1.0]))

    def ratio(p: Puck) -> Floats:
        speed = np.sqrt(np.sum(p.velocity**2, axis=1, keepdims=True))
        return np.asarray(1 + more * np.exp(-((speed / at) ** power)))

    numbers = {"more": more, "speed_ms": at, "power": power}
    return Drawn(("stribeck_friction",), numbers, "Bo and Pavelescu (1982), Wear 82, 277", pucks(rng), ratio=ratio)


def brushed(rng: Generator) -> Drawn:
    over, turn = float(rng.uniform(0.2, 1.5)), float(rng.uniform(-np.pi / 2, np.pi / 2))
    axis = np.array([np.cos(turn), np.sin(turn)])

    def ratio(p: Puck) -> Floats:
        along = (p.velocity @ axis)[:, None] * axis
        safe = np.where(np.abs(p.velocity) < 1e-9, 1.0, p.velocity)
        return np.asarray((p.velocity + over * along) / safe)

    numbers = {"over": over, "angle_rad": turn}
    return Drawn(("anisotropic_friction",), numbers, "Zmitrowicz (1981), Int. J. Eng. Sci. 19, 1489", ratio=ratio)


def surging(rng: Generator) -> Drawn:
    """A blower that surges: the load that the air leaves swings. Greitzer (1976), J. Eng. Power 98, 190."""
    size, frequency = float(rng.uniform(0.3, 0.9)), float(rng.uniform(0.8, 4.0))

    def ratio(p: Puck) -> Floats:
        return np.full((len(p.place), 1), 1 + size * np.sin(2 * np.pi * frequency * p.time))

    numbers = {"size": size, "frequency_hz": frequency}
    return Drawn(("pulsating_lift",), numbers, "Greitzer (1976), J. Eng. Power 98, 190", ratio=ratio)


def lossy_rail(rng: Generator) -> Drawn:
    """Rubber and felt after Hunt and Crossley: e = 1 - a v on top of the plain rail."""
    loss = float(log_uniform(rng, 0.05, 1.0))

    def extra(t: Touch) -> Floats:
        return np.asarray(1.5 * loss * t.force * t.closing)

    source = "Hunt and Crossley (1975), J. Appl. Mech. 42, 440"
    return Drawn(("rate_dependent_restitution",), {"loss_sm": loss}, source, partners(rng), extra=extra)


def rough_rim(rng: Generator) -> Drawn:
    """Coulomb's impulse along a rail, with spin: Brach (1991), Mechanical Impact Dynamics."""
    friction = float(log_uniform(rng, 0.01, 0.4))
    classes = ("tangential_impulse", "friction_cone")
    source = "Brach (1991), Mechanical Impact Dynamics, 6"
    return Drawn(classes, {"friction": friction}, source, partners(rng), grip=friction)


def crooked(rng: Generator) -> Drawn:
    """A tool that was mounted turned: all strokes go off to the same side."""
    angle = either(rng, 3e-3, 5e-2)
    source = "ISO 9283 (1998), pose accuracy"
    return Drawn(("heading_bias",), {"angle_rad": angle}, source, ("pusher",), heading_rad=angle)


def unsteady(rng: Generator) -> Drawn:
    """Strokes that do not repeat: speed off by a few per cent, another one each time."""
    size = float(log_uniform(rng, 0.005, 0.06))
    source = "ISO 9283 (1998), path velocity repeatability"
    return Drawn(("stroke_jitter",), {"share": size}, source, ("pusher",), jitter=size)


def late_drive(rng: Generator) -> Drawn:
    late = float(log_uniform(rng, 0.004, 0.08))
    source = "Andersen et al. (2015), ICAR: delays of UR robots"
    sites = ("pusher_vx", "pusher_vy")
    return Drawn(("actuation_delay",), {"late_s": late}, source, sites, drive=lambda told: lambda t: told(t - late))


def weak_drive(rng: Generator) -> Drawn:
    most = float(rng.uniform(0.2, 0.36))

    def drive(told: Told) -> Told:
        def reached(time: float) -> Floats:
            asked = told(time)
            speed = np.sqrt(np.sum(asked**2, axis=1, keepdims=True))
            return np.asarray(asked * np.minimum(1.0, most / np.maximum(speed, 1e-9)))

        return reached

    source = "Krause, Wasynczuk, Sudhoff (2013), Electric Machinery, 2.5: speed at the voltage limit"
    sites = ("pusher_vx", "pusher_vy")
    return Drawn(("velocity_saturation",), {"most_ms": most}, source, sites, drive=drive)


def tiring(rng: Generator) -> Drawn:
    """A filter that clogs: from shot to shot the cushion carries less."""
    share = float(rng.uniform(0.01, 0.08))
    source = "Brown (1993), Air Filtration, 7"
    return Drawn((UNKNOWN,), {"share": share}, source, tiring=share)


def grooved(rng: Generator) -> Drawn:
    """Joints between boards: friction repeats along the table."""
    size, period, phase = float(rng.uniform(0.5, 1.0)), float(rng.uniform(0.05, 0.12)), float(rng.uniform(0, 6.28))

    def ratio(p: Puck) -> Floats:
        return np.asarray(1 + size * np.sin(2 * np.pi * p.place[:, :1] / period + phase))

    numbers = {"size": size, "period_m": period}
    return Drawn((UNKNOWN,), numbers, "Fagiani and Barbieri (2014), Tribol. Int. 76: textures", ratio=ratio)


def of_camera(name: str) -> Callable[[Generator], Drawn]:
    def drawn(rng: Generator) -> Drawn:
        fault = film.DRAW[name](rng, CAMERA)
        return Drawn(fault.classes, fault.quantities, fault.source, optics=fault.optics)

    return drawn


_OWN = (
    *(slope, sag, desk_fan, draught, vortex, magnet, magnets, air_film, clogged, weak_end, stribeck, brushed, surging),
    *(lossy_rail, rough_rim, crooked, unsteady, late_drive, weak_drive, tiring, grooved),
)
DRAW: Mapping[str, Callable[[Generator], Drawn]] = {f.__name__: f for f in _OWN} | {
    name: of_camera(name) for name in film.DRAW
}
OUTSIDE = ("tiring", "grooved", *film.OUTSIDE)
KNOWN = tuple(name for name in DRAW if name not in OUTSIDE)
