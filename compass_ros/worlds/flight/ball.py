"""The motion of one ball: Newton for its centre of mass, and a spin that nothing slows, since a sphere's inertia is
the same about all axes. Integrated by scipy's DOP853 at 1e-9."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from compass_ros.types import Floats


@dataclass(frozen=True)
class Ball:
    """What flies, and what pulls it down."""

    mass_kg: float
    radius_m: float
    gravity: float
    """Along z [m/s^2], negative."""
    centre_m: Floats
    """(3,) centre of mass against the tracked centre, in the ball's axes."""
    known_drag: float = 0.0
    """Drag coefficient that the cell has too, the same at every speed."""

    @property
    def area_m2(self) -> float:
        return float(np.pi * self.radius_m**2)

    @property
    def volume_m3(self) -> float:
        return float(4 / 3 * np.pi * self.radius_m**3)


@dataclass(frozen=True)
class Throw:
    """First state, of the centre of mass, in the world's axes."""

    position_m: Floats
    velocity_ms: Floats
    spin_rads: Floats
    """(3,) in the world's axes, constant."""
    orientation: Rotation


Acceleration = Callable[[float, Floats, Floats, Floats], Floats]
"""Time since the throw [s], position, velocity (3,), rotation vector since the throw (3,): acceleration (3,)."""


@dataclass(frozen=True)
class Flight:
    """A motion that can be asked at any time of [0, duration]."""

    centre: Callable[[Floats], Floats]
    """(F,) s -> (3, F) m, of the centre of mass."""
    throw: Throw
    ball: Ball

    def pose(self, time_s: Floats) -> Floats:
        """(F, 7) tracked centre and quaternion w, x, y, z; the quaternion's sign is continuous from w >= 0."""
        turned = Rotation.from_rotvec(np.outer(time_s, self.throw.spin_rads)) * self.throw.orientation
        place = self.centre(time_s).T - turned.apply(self.ball.centre_m)
        return np.concatenate([place, continuous(np.roll(turned.as_quat(), 1, axis=1))], axis=1)


def continuous(quaternions: Floats) -> Floats:
    """(F, 4) the same rotations, each with the sign that is nearest to the one before."""
    back = np.sum(quaternions[1:] * quaternions[:-1], axis=1) < 0
    flips = np.concatenate([[quaternions[0, 0] < 0], back])
    return np.asarray(quaternions * (1 - 2 * (np.cumsum(flips) % 2))[:, None])


def fly(ball: Ball, throw: Throw, duration_s: float, pushes: tuple[Acceleration, ...] = ()) -> Flight:
    """A flight under gravity and (3,) further accelerations [m/s^2]."""
    weight = np.array([0.0, 0.0, ball.gravity])

    def rate(time: float, state: Floats) -> Floats:
        turned = throw.spin_rads * time
        total = weight + sum((push(time, state[:3], state[3:], turned) for push in pushes), np.zeros(3))
        return np.concatenate([state[3:], total])

    first = np.concatenate([throw.position_m, throw.velocity_ms])
    found = solve_ivp(rate, (0.0, duration_s), first, "DOP853", dense_output=True, rtol=1e-9, atol=1e-9)
    return Flight(lambda time: np.asarray(found.sol(time)[:3]), throw, ball)
