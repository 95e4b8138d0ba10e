"""Two pucks, a pusher, four rails and a bar in the plane: places, turns and soft contacts (worlds/soft.py)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from compass_ros.types import Floats
from compass_ros.worlds import soft
from compass_ros.worlds.soft import Give

STEP_S = 0.001
SLIDES_MS = 0.03
"""Slip at which the friction of rims has three quarters of its size: as fast as steps of 1 ms can follow."""
PUCKS = ("puck1", "puck2")
REST = np.array([[-0.15, 0.0], [-0.075, -0.075]])
"""Of the pucks in the cell's drawing [m]."""
TURNING = 9.75e-6 / 0.03
"""Moment of inertia of a puck over its mass [m^2]."""
RAILS = ("front_wall", "back_wall", "left_wall", "right_wall")
_AT = np.array([[0.45, 0.0], [-0.45, 0.0], [0.0, 0.225], [0.0, -0.225]])
_INTO = np.array([[-1.0, 0.0], [1.0, 0.0], [0.0, -1.0], [0.0, 1.0]])
_YIELDS = np.array([2 / 3, 2 / 3, 1.0])
"""What softens a contact beside the inverse masses of its bodies: the mean over three directions, of which a puck moves
in two (MuJoCo's documentation, `body_invweight0`)."""
BODIES = (*PUCKS, "pusher")
FIXED = (*RAILS, "obstacle")
CONTACTS = (
    *((puck, fixed) for puck in PUCKS for fixed in FIXED),
    ("puck1", "puck2"),
    ("puck1", "pusher"),
    ("puck2", "pusher"),
)
STATE = 18
"""Columns of a state: x, y of the three bodies, two turns, their rates (8 each), and the way of each puck."""


@dataclass(frozen=True)
class Touch:
    """One contact in S shots."""

    depth: Floats
    closing: Floats
    slip: Floats
    """Of the first body's rim along the normal turned by a quarter to the left [m/s]."""
    force: Floats
    """Of the plain contact [N]."""


@dataclass(frozen=True)
class Puck:
    """One puck in S shots, free of contacts."""

    time: float
    place: Floats
    velocity: Floats
    other: Floats
    """(S, 2) place of the other puck."""
    way: Floats
    """(S,) slid so far [m]."""


Extra = Callable[[Touch], Floats]
Force = Callable[[Puck], Floats]
"""(S, 2) over the puck's mass [m/s^2]."""
Ratio = Callable[[Puck], Floats]
"""(S, 1) or (S, 2) friction over that of the cell."""
Told = Callable[[float], Floats]


@dataclass(frozen=True)
class Physics:
    """What a world has beyond its cell; pucks and surfaces by name."""

    forces: Mapping[str, tuple[Force, ...]]
    ratios: Mapping[str, tuple[Ratio, ...]]
    extras: Mapping[str, tuple[Extra, ...]]
    """Normal force, by the second partner of a contact; of two pucks `puck2`."""
    grips: Mapping[str, float]
    """Coulomb's coefficient, likewise."""
    drive: Callable[[Told], Told] | None = None
    strokes: Floats | float = 1.0
    """(S,) speed of the pusher over what it would be."""
    carried: Floats | float = 1.0
    """(S,) lift of the cushion over that of the cell."""


PLAIN = Physics({}, {}, {}, {})


@dataclass(frozen=True)
class Rig:
    """The cell with its true parameters."""

    values: Mapping[str, float]

    @cached_property
    def radii(self) -> Floats:
        return np.array([self.values[f"{name}@shape@radius"] for name in BODIES])

    @cached_property
    def masses(self) -> Floats:
        """(3,) that contacts and forces move [kg]."""
        return np.array([self.values[f"{n}@dyna@mass"] + self.values[f"{n}@dyna@armature"] for n in BODIES])

    def gives(self) -> list[Give]:
        return [soft.mean(self._own(a), self._own(b)) for a, b in CONTACTS]

    def _own(self, name: str) -> Give:
        v = self.values
        return Give(
            10000.0,
            -v[f"{name}@dyna@damping"],
            v[f"{name}@dyna@impedance"],
            0.95,
            v[f"{name}@dyna@impedance_width"],
            0.5,
            v[f"{name}@dyna@impedance_power"],
        )

    def rails(self) -> Floats:
        """(4, 2) directions into the table."""
        yaw = np.array([self.values[f"{name}@pose@yaw"] for name in RAILS])
        x, y = _INTO.T
        return np.stack([np.cos(yaw) * x - np.sin(yaw) * y, np.sin(yaw) * x + np.cos(yaw) * y], axis=1)

    def meet(self, place: Floats) -> tuple[Floats, Floats]:
        """(S, 13) depths, negative apart, and (S, 13, 2) directions to the first partner, for (S, 3, 2) places."""
        v, into, radii = self.values, self.rails(), self.radii
        depth, normal = np.empty((len(place), 13)), np.empty((len(place), 13, 2))
        bar = np.array([v["obstacle@pose@x"], v["obstacle@pose@y"]])
        half = 0.5 * np.array([v["obstacle@shape@width"], v["obstacle@shape@length"]])
        c, s = np.cos(v["obstacle@pose@yaw"]), np.sin(v["obstacle@pose@yaw"])
        turn = np.array([[c, s], [-s, c]])
        for k in range(2):
            own = slice(5 * k, 5 * k + 4)
            depth[:, own] = radii[k] - np.einsum("srk,rk->sr", place[:, k, None] - _AT, into)
            normal[:, own] = into
            local = (place[:, k] - bar) @ turn.T
            distance, away = _apart(local - np.clip(local, -half, half))
            depth[:, 5 * k + 4], normal[:, 5 * k + 4] = radii[k] - distance, away @ turn
        for row, (a, b) in enumerate(((0, 1), (0, 2), (1, 2)), start=10):
            distance, normal[:, row] = _apart(place[:, a] - place[:, b])
            depth[:, row] = radii[a] + radii[b] - distance
        return depth, normal


def _apart(vector: Floats) -> tuple[Floats, Floats]:
    distance = np.maximum(np.sqrt(np.sum(vector**2, axis=1)), 1e-12)
    return distance, vector / distance[:, None]


@dataclass(frozen=True)
class Strokes:
    """What the pusher is told in S shots: LEVELS of its speed at the knots, straight lines between them."""

    knots: Floats
    """(6, S) [s]"""
    size: Floats
    """(S,) [m/s]"""
    along: Floats
    """(S, 2) heading."""


LEVELS = np.array([0.0, 1.0, 1.0, -1.0, -1.0, 0.0])


def strokes(values: Mapping[str, float], commands: Floats, aim: Floats, faster: Floats | float = 1.0) -> Strokes:
    """A ramp up, a stroke, a turn, the way back, a ramp down, along the commanded heading.

    `commands`: (S, 4) place x, y of the pusher, angle from the line to (2,) `aim`, speed.
    """
    ramp, settle, stroke = (values[f"pusher@actuation@{name}"] for name in ("ramp_time", "settle_time", "stroke"))
    speed, away = commands[:, 3], aim - commands[:, :2]
    heading = np.arctan2(away[:, 1], away[:, 0]) + commands[:, 2]
    out = stroke / speed
    corners = np.cumsum([np.full_like(speed, ramp), out, np.full_like(speed, settle), out], axis=0)
    knots = np.concatenate([np.zeros((1, len(speed))), corners, corners[-1:] + ramp])
    size = np.asarray(values["pusher@actuation@vel_discount"] * speed * faster)
    return Strokes(knots, size, np.stack([np.cos(heading), np.sin(heading)], axis=1))


def told_by(values: Mapping[str, float], commands: Floats, faster: Floats | float = 1.0) -> Told:
    """Velocity of the pusher (`strokes`) towards puck 1."""
    asked = strokes(values, commands, REST[0], faster)

    def told(time: float) -> Floats:
        share = np.array([np.interp(time, asked.knots[:, s], LEVELS) for s in range(len(asked.size))])
        return np.asarray((asked.size * share)[:, None] * asked.along)

    return told


def play(rig: Rig, commands: Floats, duration_s: float, physics: Physics = PLAIN) -> Floats:
    """(T + 1, S, 18) states of S shots."""
    first = np.zeros((len(commands), STATE))
    first[:, :4], first[:, 4:6] = REST.ravel(), commands[:, :2]
    asked = told_by(rig.values, commands, physics.strokes)
    told = asked if physics.drive is None else physics.drive(asked)
    return soft.march(motion(rig, told, physics), first, duration_s, STEP_S)


def motion(rig: Rig, told: Told, physics: Physics) -> Callable[[float, Floats], Floats]:
    """Time and (S, 18) states -> their rates."""
    v, gives, masses = rig.values, rig.gives(), rig.masses
    weight = v["env@dyna@gravity"] * (1 - v["table@dyna@lift"] * np.reshape(physics.carried, (-1, 1)))
    gain, drag = v["pusher@actuation@servo_gain"], v["pusher@dyna@joint_damping"]

    def rate(time: float, state: Floats) -> Floats:
        place, velocity = state[:, :6].reshape(-1, 3, 2), state[:, 8:14].reshape(-1, 3, 2)
        force = np.empty_like(velocity)
        force[:, 2] = gain * (told(time) - velocity[:, 2]) - drag * velocity[:, 2]
        for k, name in enumerate(PUCKS):
            puck = Puck(time, place[:, k], velocity[:, k], place[:, 1 - k], state[:, 16 + k])
            creep = v[f"{name}@dyna@friction_creep"]
            speed = np.sqrt(np.sum(puck.velocity**2, axis=1, keepdims=True)) + 1e-12
            rubbed = -v[f"{name}@dyna@friction_sliding"] * weight * np.tanh(speed / creep) * puck.velocity / speed
            for ratio in physics.ratios.get(name, ()):
                rubbed = rubbed * ratio(puck)
            for push in physics.forces.get(name, ()):
                rubbed = rubbed + push(puck)
            force[:, k] = rubbed * v[f"{name}@dyna@mass"]
        pressed, turned = _pressed(rig, physics, gives, place, velocity, state[:, 14:16], force)
        spin = turned / (TURNING * masses[:2])
        way = np.sqrt(np.sum(velocity[:, :2] ** 2, axis=2))
        moved = ((force + pressed) / masses[:, None]).reshape(-1, 6)
        return np.concatenate([state[:, 8:14], state[:, 14:16], moved, spin, way], axis=1)

    return rate


def _pressed(
    rig: Rig, physics: Physics, gives: list[Give], place: Floats, velocity: Floats, spin: Floats, force: Floats
) -> tuple[Floats, Floats]:
    """(S, 3, 2) contact forces and (S, 2) torques on the pucks."""
    total, torque = np.zeros_like(velocity), np.zeros_like(spin)
    depth, normal = rig.meet(place)
    active = np.flatnonzero((depth > 0).any(axis=0))
    if not len(active):
        return total, torque
    masses, depth, normal = rig.masses, depth[:, active], normal[:, active]
    pairs = [(BODIES.index(CONTACTS[c][0]), _second(c)) for c in active]
    jacobian = np.zeros((len(place), len(active), 3, 2))
    for i, (a, b) in enumerate(pairs):
        jacobian[:, i, a] = normal[:, i]
        if b is not None:
            jacobian[:, i, b] = -normal[:, i]
    closing = -np.einsum("scbk,sbk->sc", jacobian, velocity)
    free = np.einsum("scbk,sbk->sc", jacobian, force / masses[:, None])
    inverse = np.einsum("scbk,sdbk->scd", jacobian, jacobian / masses[:, None])
    share = np.stack([gives[c].impedance(depth[:, i]) for i, c in enumerate(active)], axis=1)
    aim = np.stack([gives[c].reference(depth[:, i], closing[:, i]) for i, c in enumerate(active)], axis=1)
    weight = _YIELDS / masses
    lighter = np.array([weight[a] + (weight[b] if b is not None else 0.0) for a, b in pairs])
    softness = (1 - share) / share * lighter
    touching = (depth > 0).astype(float)
    plain = soft.forces(inverse, softness, aim - free, touching)
    for i, (a, b) in enumerate(pairs):
        name, n = CONTACTS[active[i]][1], normal[:, i]
        along = np.stack([-n[:, 1], n[:, 0]], axis=1)
        other = velocity[:, b] if b is not None else 0.0
        slip = np.sum(along * (velocity[:, a] - other), axis=1) - rig.radii[a] * spin[:, a]
        if b == 1:
            slip = slip - rig.radii[1] * spin[:, 1]
        touch = Touch(np.maximum(depth[:, i], 0.0), closing[:, i], slip, plain[:, i])
        beyond = sum((extra(touch) for extra in physics.extras.get(name, ())), np.zeros(len(n)))
        pressing = (plain[:, i] + beyond) * touching[:, i]
        rub = -physics.grips.get(name, 0.0) * np.maximum(pressing, 0.0) * np.tanh(slip / SLIDES_MS)
        push = pressing[:, None] * n + rub[:, None] * along
        total[:, a] += push
        torque[:, a] -= rig.radii[a] * rub
        if b is not None:
            total[:, b] -= push
        if b == 1:
            torque[:, 1] -= rig.radii[1] * rub
    return total, torque


def _second(contact: int) -> int | None:
    """Body of the second partner; None: it stands fast."""
    name = CONTACTS[contact][1]
    return BODIES.index(name) if name in BODIES else None
