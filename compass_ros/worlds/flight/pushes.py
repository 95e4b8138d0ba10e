"""What air does to a ball, as accelerations of its centre of mass."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.random import Generator
from scipy.spatial.transform import Rotation

from compass_ros.types import Floats
from compass_ros.worlds.flight.ball import Acceleration, Ball
from compass_ros.worlds.flight.drag import DENSITY, KINEMATIC

Wind = Callable[[float, Floats], Floats]
"""Time [s] and place (3,) [m]: velocity of the air (3,) [m/s]."""
Curve = Callable[[Floats], Floats]
KARMAN = 0.40


def still(time: float, place: Floats) -> Floats:
    """Air at rest."""
    return np.zeros(3)


def drag(ball: Ball, coefficient: Curve, wind: Wind = still, share: float = 1.0) -> Acceleration:
    """Against the motion relative to the air; `share` scales the published coefficient."""
    factor = 0.5 * DENSITY * ball.area_m2 / ball.mass_kg * share

    def push(time: float, place: Floats, velocity: Floats, turned: Floats) -> Floats:
        relative = velocity - wind(time, place)
        speed = float(np.linalg.norm(relative))
        reynolds = np.maximum(2 * ball.radius_m * speed / KINEMATIC, 1.0)
        return np.asarray(-factor * coefficient(np.asarray(reynolds)) * speed * relative)

    return push


def constant(coefficient: float) -> Curve:
    """The same at every Reynolds number."""
    return lambda reynolds: np.full_like(reynolds, coefficient)


def lift(ball: Ball, coefficient: Curve, spin_rads: Floats, share: float = 1.0) -> Acceleration:
    """Magnus: along spin x velocity. Only the part of the spin across the velocity counts (Nathan 2008)."""
    factor = 0.5 * DENSITY * ball.area_m2 / ball.mass_kg * share

    def push(time: float, place: Floats, velocity: Floats, turned: Floats) -> Floats:
        speed = float(np.linalg.norm(velocity))
        across = np.cross(spin_rads, velocity)
        size = float(np.linalg.norm(across))
        if size < 1e-12:
            return np.zeros(3)
        spin = ball.radius_m * size / speed**2
        return np.asarray(factor * coefficient(np.asarray(spin)) * speed**2 * across / size)

    return push


def buoyancy(ball: Ball) -> Acceleration:
    """Archimedes, and the air that a sphere carries along, half of what it displaces: g (1 - a) / (1 + a / 2), a the
    ratio of air to ball. H. Lamb (1932), Hydrodynamics, section 92."""
    ratio = DENSITY * ball.volume_m3 / ball.mass_kg
    change = (1 - ratio) / (1 + ratio / 2) - 1
    return lambda time, place, velocity, turned: np.array([0.0, 0.0, ball.gravity * change])


def boundary_layer(friction_speed: float, heading: float, roughness_m: float) -> Wind:
    """Wind over ground: u = (u* / kappa) ln((z + z0) / z0). R. B. Stull (1988), Boundary Layer Meteorology, 9.7.1."""
    along = np.array([np.cos(heading), np.sin(heading), 0.0])

    def wind(time: float, place: Floats) -> Floats:
        height = max(float(place[2]), 0.0)
        return np.asarray(friction_speed / KARMAN * np.log((height + roughness_m) / roughness_m) * along)

    return wind


def turbulence(rms: float, length_m: float, mean_ms: float, rng: Generator, waves: int = 16) -> Wind:
    """Gusts across and along: sums of waves with random phases whose powers follow Dryden's spectrum,
    Phi(w) = s^2 2 L / (pi V) / (1 + (L w / V)^2), MIL-F-8785C (1980), section 3.7.2; frozen in time at one place."""
    edges = np.tan(np.linspace(0, np.pi / 2 * 0.98, waves + 1)) * mean_ms / length_m
    middle = 0.5 * (edges[1:] + edges[:-1])
    power = 2 / np.pi * np.diff(np.arctan(edges * length_m / mean_ms))
    size = rms * np.sqrt(2 * power / power.sum())
    phase = rng.uniform(0, 2 * np.pi, (3, waves))

    def wind(time: float, place: Floats) -> Floats:
        return np.asarray(np.sin(middle * time + phase) @ size * np.array([1.0, 1.0, 0.5]))

    return wind


def knuckle(size_ms2: float, spin_rads: Floats, orientation: Rotation) -> Acceleration:
    """Side force of a slowly turning ball with seams: F = F0 (sin 4a - 0.25 sin 8a + 0.08 sin 12a - 0.025 sin 16a), a
    the angle of the seam. R. G. Watts and E. Sawyer (1975), Am. J. Phys. 43, 960, as Giordano (1997) fits it; sideways
    in the horizontal plane."""
    first = float(np.arctan2(*orientation.apply([1.0, 0.0, 0.0])[[1, 0]]))
    sense = 1.0 if spin_rads[2] >= 0 else -1.0

    def push(time: float, place: Floats, velocity: Floats, turned: Floats) -> Floats:
        angle = first + sense * float(np.linalg.norm(turned))
        wave = sum(c * np.sin(n * angle) for n, c in ((4, 1.0), (8, -0.25), (12, 0.08), (16, -0.025)))
        side = np.array([-velocity[1], velocity[0], 0.0])
        return np.asarray(size_ms2 * wave * side / max(float(np.linalg.norm(side)), 1e-9))

    return push


def plume(peak_ms: float, width_m: float, x_m: float, coefficient: Curve, ball: Ball) -> Acceleration:
    """What rises over a heater: w = peak exp(-((x - x0) / width)^2), of a plume's Gaussian profile: B. R. Morton,
    G. Taylor, J. S. Turner (1956), Proc. R. Soc. A 234, 1; drag in that air less drag in still air."""

    def wind(time: float, place: Floats) -> Floats:
        return np.array([0.0, 0.0, peak_ms * np.exp(-(((place[0] - x_m) / width_m) ** 2))])

    moving, quiet = drag(ball, coefficient, wind), drag(ball, coefficient)
    return lambda time, place, velocity, turned: np.asarray(
        moving(time, place, velocity, turned) - quiet(time, place, velocity, turned)
    )
