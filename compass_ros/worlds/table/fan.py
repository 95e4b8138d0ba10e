"""The table over a fan, compiled: the pucks, pusher, rails and soft contacts of `discs.py`, and a lift that is another
one at each place and moment. Without rims that rub, so that pucks need not turn."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import exp, sqrt, tanh

import numpy as np
from numpy.random import Generator

from compass_ros.types import Floats, Ints
from compass_ros.worlds.arms.chain import compiled
from compass_ros.worlds.table import discs
from compass_ros.worlds.table.discs import BODIES, CONTACTS, PUCKS, REST, STEP_S, Rig

_SWEEPS = 60
_FULL = 0.99
"""Most of a puck's weight that air carries here: a film that lifts it off would be another table."""


@dataclass(frozen=True)
class Fan:
    """A fan under the middle of the table. A jet's mean pressure is Gaussian across (Pope 2000, Turbulent Flows, 5.1);
    what the holes far from it give is what the plenum holds."""

    edge: float
    """Share of a puck's weight that is carried far from the middle."""
    centre: float
    """The same above the fan."""
    width_m: float = 0.15
    """Standard deviation of the Gaussian."""
    shot: float = 0.005
    """By how much the share is off from one shot to the next, one standard deviation."""
    gust: float = 0.015
    """By how much it wanders within a shot, one standard deviation."""
    memory_s: float = 0.3
    """Correlation time of that: exp(-t / memory)."""

    def wander(self, shots: int, steps: int, rng: Generator) -> Floats:
        """(shots, steps + 1) what is added to the share at each step: an Ornstein-Uhlenbeck process and a constant."""
        keep = exp(-STEP_S / self.memory_s)
        out = np.empty((shots, steps + 1))
        state = rng.standard_normal(shots)
        fresh = rng.standard_normal((steps, shots)) * sqrt(1 - keep**2)
        out[:, 0] = state
        for i in range(steps):
            state = keep * state + fresh[i]
            out[:, i + 1] = state
        return np.asarray(self.gust * out + self.shot * rng.standard_normal((shots, 1)))


def even(lift: float) -> Fan:
    """One that carries the same everywhere and always."""
    return Fan(lift, lift, shot=0.0, gust=0.0)


def play(
    values: Mapping[str, float], commands: Floats, duration_s: float, fan: Fan, rng: Generator, rest: Floats = REST
) -> Floats:
    """(S, T + 1, 4) x, y of both pucks in S shots, 1 ms apart [m].

    Args:
        values: The cell's parameters; its lift and spins are not used.
        commands: (S, 4) as the cell's action names them.
        duration_s: How long.
        fan: What carries the pucks.
        rng: Of the fan's chance.
        rest: (2, 2) where the pucks begin [m].
    """
    rig, steps = Rig(values), round(duration_s / STEP_S)
    told = discs.strokes(values, commands, rest[0])
    numbers = np.array([list(vars(g).values()) for g in rig.gives()])
    bodies = [[BODIES.index(a), BODIES.index(b) if b in BODIES else -1] for a, b in CONTACTS]
    v = values
    bar = np.array([v["obstacle@pose@x"], v["obstacle@pose@y"], v["obstacle@pose@yaw"],
                    0.5 * v["obstacle@shape@width"], 0.5 * v["obstacle@shape@length"]])  # fmt: skip
    own = np.array([[v[f"{n}@dyna@{w}"] for w in ("friction_sliding", "friction_creep", "mass")] for n in PUCKS])
    servo = np.array([v["pusher@actuation@servo_gain"], v["pusher@dyna@joint_damping"], v["env@dyna@gravity"]])
    carried = np.array([fan.edge, fan.centre, fan.width_m])
    out = np.empty((len(commands), steps + 1, 4))
    wander = fan.wander(len(commands), steps, rng)
    for s in range(len(commands)):
        state = np.zeros(12)
        state[:4], state[4:6] = rest.ravel(), commands[s, :2]
        _march(state, out[s], told.knots[:, s].copy(), told.along[s] * told.size[s], wander[s], carried, servo, own,
               rig.masses, rig.radii, rig.rails(), bar, numbers, np.array(bodies))  # fmt: skip
    return out


@compiled
def _march(
    state: Floats, out: Floats, knots: Floats, told: Floats, wander: Floats, carried: Floats, servo: Floats,
    own: Floats, masses: Floats, radii: Floats, rails: Floats, bar: Floats, gives: Floats, pairs: Ints,
) -> None:  # fmt: skip
    """The classical fourth-order Runge-Kutta rule in equal steps."""
    slopes, there, h = np.zeros((5, 12)), np.empty(12), STEP_S
    out[0] = state[:4]
    for i in range(len(out) - 1):
        for stage in range(4):
            ahead = (0.0, 0.5, 0.5, 1.0)[stage]
            for j in range(12):
                there[j] = state[j] + ahead * h * slopes[stage, j]
            now = wander[i] + ahead * (wander[i + 1] - wander[i])
            at = (i + ahead) * h
            _rate(slopes[stage + 1], there, at, now, knots, told, carried, servo, own, masses, radii, rails, bar, gives,
                  pairs)  # fmt: skip
        for j in range(12):
            state[j] += h / 6 * (slopes[1, j] + 2 * slopes[2, j] + 2 * slopes[3, j] + slopes[4, j])
        for j in range(4):
            out[i + 1, j] = state[j]


@compiled
def _rate(
    out: Floats, state: Floats, time: float, wander: float, knots: Floats, told: Floats, carried: Floats, servo: Floats,
    own: Floats, masses: Floats, radii: Floats, rails: Floats, bar: Floats, gives: Floats, pairs: Ints,
) -> None:  # fmt: skip
    """Rates of (12,) places and velocities of both pucks and the pusher."""
    place, velocity = state[:6].reshape(3, 2), state[6:].reshape(3, 2)
    force = np.zeros((3, 2))
    share = _stroke(time, knots)
    for axis in range(2):
        force[2, axis] = servo[0] * (share * told[axis] - velocity[2, axis]) - servo[1] * velocity[2, axis]
    for k in range(2):
        square = place[k, 0] ** 2 + place[k, 1] ** 2
        lift = carried[0] + (carried[1] - carried[0]) * exp(-0.5 * square / carried[2] ** 2) + wander
        load = servo[2] * (1 - min(max(lift, 0.0), _FULL))
        speed = sqrt(velocity[k, 0] ** 2 + velocity[k, 1] ** 2) + 1e-12
        rubbed = own[k, 0] * load * tanh(speed / own[k, 1]) / speed * own[k, 2]
        for axis in range(2):
            force[k, axis] = -rubbed * velocity[k, axis]
    _press(force, place, velocity, masses, radii, rails, bar, gives, pairs)
    for i in range(6):
        out[i] = state[6 + i]
    for k in range(3):
        for axis in range(2):
            out[6 + 2 * k + axis] = force[k, axis] / masses[k]


@compiled
def _stroke(time: float, knots: Floats) -> float:
    """Share of its speed that the pusher is told: up, on, turn, back, down."""
    levels = (0.0, 1.0, 1.0, -1.0, -1.0, 0.0)
    for i in range(5):
        if time < knots[i + 1]:
            share: float = max(time - knots[i], 0.0) / (knots[i + 1] - knots[i])
            return levels[i] + (levels[i + 1] - levels[i]) * share
    return 0.0


@compiled
def _meet(
    which: Ints, depth: Floats, normal: Floats, place: Floats, radii: Floats, rails: Floats, bar: Floats, pairs: Ints
) -> int:
    """Fill in the rows of the contacts that touch, how deep and in which direction; how many there are."""
    many = 0
    c, s = np.cos(bar[2]), np.sin(bar[2])
    for row in range(13):
        a, b = pairs[row, 0], pairs[row, 1]
        if row < 10 and row % 5 < 4:
            side = row % 5
            n = rails[side]
            at = (0.45, -0.45, 0.225, -0.225)[side]
            x, y = place[a, 0] - (at if side < 2 else 0.0), place[a, 1] - (at if side >= 2 else 0.0)
            deep, nx, ny = radii[a] - (x * n[0] + y * n[1]), n[0], n[1]
        elif row < 10:
            x, y = place[a, 0] - bar[0], place[a, 1] - bar[1]
            lx, ly = c * x + s * y, c * y - s * x
            ax, ay = lx - min(max(lx, -bar[3]), bar[3]), ly - min(max(ly, -bar[4]), bar[4])
            far = max(sqrt(ax * ax + ay * ay), 1e-12)
            deep, nx, ny = radii[a] - far, (c * ax - s * ay) / far, (s * ax + c * ay) / far
        else:
            x, y = place[a, 0] - place[b, 0], place[a, 1] - place[b, 1]
            far = max(sqrt(x * x + y * y), 1e-12)
            deep, nx, ny = radii[a] + radii[b] - far, x / far, y / far
        if deep > 0:
            which[many], depth[many], normal[many, 0], normal[many, 1] = row, deep, nx, ny
            many += 1
    return many


@compiled
def _press(
    force: Floats, place: Floats, velocity: Floats, masses: Floats, radii: Floats, rails: Floats, bar: Floats,
    gives: Floats, pairs: Ints,
) -> None:  # fmt: skip
    """Add what contacts press to (3, 2) forces."""
    which, depth, normal = np.empty(13, np.int64), np.empty(13), np.empty((13, 2))
    many = _meet(which, depth, normal, place, radii, rails, bar, pairs)
    if many == 0:
        return
    lacking, softness, pressed = np.empty(many), np.empty(many), np.zeros(many)
    for i in range(many):
        a, b, g, n = pairs[which[i], 0], pairs[which[i], 1], gives[which[i]], normal[i]
        x = min(max(depth[i] / g[4], 0.0), 1.0)
        rise = x ** g[6] / g[5] ** (g[6] - 1) if x <= g[5] else 1 - (1 - x) ** g[6] / (1 - g[5]) ** (g[6] - 1)
        share = g[2] + rise * (g[3] - g[2])
        closing = -(velocity[a, 0] * n[0] + velocity[a, 1] * n[1])
        free = (force[a, 0] * n[0] + force[a, 1] * n[1]) / masses[a]
        weight = _yields(a) / masses[a]
        if b >= 0:
            closing += velocity[b, 0] * n[0] + velocity[b, 1] * n[1]
            free -= (force[b, 0] * n[0] + force[b, 1] * n[1]) / masses[b]
            weight += _yields(b) / masses[b]
        lacking[i] = g[0] / g[3] ** 2 * share * depth[i] + g[1] / g[3] * closing - free
        softness[i] = (1 - share) / share * weight
    for _ in range(_SWEEPS if many > 1 else 1):
        for i in range(many):
            total, row = 0.0, 0.0
            for j in range(many):
                both = _both(pairs[which[i]], normal[i], pairs[which[j]], normal[j], masses)
                if i == j:
                    row = both + softness[i]
                else:
                    total += both * pressed[j]
            pressed[i] = max(0.0, (lacking[i] - total) / row)
    for i in range(many):
        a, b = pairs[which[i], 0], pairs[which[i], 1]
        for axis in range(2):
            force[a, axis] += pressed[i] * normal[i, axis]
            if b >= 0:
                force[b, axis] -= pressed[i] * normal[i, axis]


@compiled
def _yields(body: int) -> float:
    """As `discs._YIELDS`."""
    return 1.0 if body == 2 else 2 / 3


@compiled
def _both(one: Ints, n: Floats, other: Ints, m: Floats, masses: Floats) -> float:
    """Acceleration of separation in one contact for a unit of force in another [1/kg]."""
    along, total = n[0] * m[0] + n[1] * m[1], 0.0
    for i in range(2):
        for j in range(2):
            if one[i] >= 0 and one[i] == other[j]:
                total += (1.0 if i == j else -1.0) * along / masses[one[i]]
    return total
