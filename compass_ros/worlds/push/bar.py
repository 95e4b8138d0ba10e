"""A rigid bar on three point feet in the plane, with inertia: Goyal, Ruina, Papadopoulos (1991), Wear 143, 307, whose
limit surface is here the exact one of three points. The load of each foot follows from the balance of moments."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from compass_ros.types import Floats
from compass_ros.worlds import soft
from compass_ros.worlds.soft import Give

STEP_S = 0.0005
FEET = np.array([[-0.008, -0.07], [-0.008, 0.07], [0.016, 0.0]])
"""(3, 2) in the bar's axes [m]; with the sizes below, of the cell's drawing."""
HALF = np.array([0.02, 0.08])
HEIGHT_M = 0.00799
"""Of the centre of mass, where the tool pushes too."""
INERTIA = 0.00068
MASS_KG = 0.3
"""Of the drawing: its moment of inertia goes with the mass."""
TOOL_KG, TOOL_M, TOOL_X = 8.0, 0.012, -0.036
GRAVITY = 9.81
PHASE_S = 0.6
CREEP_MS = 0.002
"""Slip at which friction has three quarters of its size."""


@dataclass(frozen=True)
class Feet:
    """The feet in S shots."""

    place: Floats
    """(S, 3, 2) on the table [m]."""
    slip: Floats
    """(S, 3, 2) velocities [m/s]."""
    angle: Floats
    """(S,) of the bar [rad]."""
    path: Floats
    """(S,) way of the bar so far [m]."""


Friction = Callable[[Feet], Floats]
"""(S, 3, 2) force of each foot over its load; against the slip where it is Coulomb's."""


Told = Callable[[float], Floats]
"""Time -> (S, 2) velocity that the servos are told [m/s]."""
Drive = Callable[[Told], Told]


@dataclass(frozen=True)
class Physics:
    """The bar and its table."""

    friction: Friction
    drive: Drive | None = None
    """None: the servos are told what was commanded."""
    push_friction: float = 0.0
    """Coulomb's, of the tool on the bar's side."""


@dataclass(frozen=True)
class Rig:
    """The cell with its true parameters."""

    values: Mapping[str, float]

    @property
    def centre(self) -> Floats:
        """(2,) of mass, in the bar's axes [m]."""
        return np.array([self.values[f"bar@dyna@centre_{axis}"] for axis in "xy"])

    @property
    def give(self) -> Give:
        return Give(10000.0, -self.values["tool@contact@damping"], 0.01, 0.95, 0.006)


def coulomb(coefficient: float) -> Friction:
    """The same in each direction, at each speed and place."""
    return lambda feet: -coefficient * direction(feet.slip)


def direction(slip: Floats) -> Floats:
    """(..., 2) unit vectors along the slip, shorter where it creeps."""
    speed = np.sqrt(np.sum(slip**2, axis=-1, keepdims=True)) + 1e-12
    return np.asarray(slip / speed * np.tanh(speed / CREEP_MS))


def play(rig: Rig, commands: Floats, duration_s: float, physics: Physics) -> Floats:
    """(T + 1, S, 11) states of S shots: centre of mass, angle, their rates, tool, its rate, way of the bar.

    `commands`: (S, 5) as the cell's action names them.
    """
    first = np.zeros((len(commands), 11))
    first[:, :2] = rig.centre
    first[:, 6], first[:, 7] = TOOL_X, commands[:, 0]
    told = told_by(commands * rig.values["tool@actuation@vel_discount"])
    return soft.march(motion(rig, told, physics), first, duration_s, STEP_S)


def motion(rig: Rig, asked: Told, physics: Physics) -> Callable[[float, Floats], Floats]:
    """Time and (S, 11) states -> their rates. `asked`: what the servos are told, before a law of the drive."""
    v, give = rig.values, rig.give
    mass, gain = v["bar@dyna@mass"], v["tool@actuation@servo_gain"]
    inertia = INERTIA * mass / MASS_KG
    arms = FEET - rig.centre
    told = asked if physics.drive is None else physics.drive(asked)

    def rate(time: float, state: Floats) -> Floats:
        angle, turning, tool = state[:, 2], state[:, 5], state[:, 8:10]
        turn = _turn(angle)
        arm = np.einsum("sij,fj->sfi", turn, arms)
        slip = state[:, None, 3:5] + turning[:, None, None] * _left(arm)
        force = physics.friction(Feet(state[:, None, :2] + arm, slip, angle, state[:, 10]))
        loads = _loads(force, arm, mass)
        rubbed = np.einsum("sf,sfk->sk", loads, force)
        twist = np.einsum("sf,sfk,sfk->s", loads, force, _left(arm))
        servo = gain * (told(time) - tool)
        depth, normal, lever = _meet(state, turn, rig.centre)
        free = np.sum(normal * (rubbed / mass - servo / TOOL_KG), axis=1) + np.sum(normal * _left(lever), axis=1) * (
            twist / inertia
        )
        spread = np.sum(normal * _left(lever), axis=1)
        closing = np.sum(normal * (tool - state[:, 3:5]), axis=1) - spread * turning
        plain = 1 / TOOL_KG + 1 / mass
        share = give.impedance(np.maximum(depth, 0.0))
        own = plain + spread**2 / inertia + (1 - share) / share * plain
        pressed = np.maximum((give.reference(depth, closing) - free) / own, 0.0) * (depth > 0)
        contact = pressed[:, None] * normal
        if physics.push_friction:
            along = _left(normal)
            rub = np.sum(along * (tool - state[:, 3:5]), axis=1) - np.sum(along * _left(lever), axis=1) * turning
            contact = contact + (physics.push_friction * pressed * np.tanh(rub / CREEP_MS))[:, None] * along
        of_tool = np.sum(contact * _left(lever), axis=1)
        turned = (twist + of_tool) / inertia
        way = np.linalg.norm(state[:, 3:5], axis=1)[:, None]
        return np.concatenate(
            [state[:, 3:6], (rubbed + contact) / mass, turned[:, None], tool, (servo - contact) / TOOL_KG, way], axis=1
        )

    return rate


def told_by(commands: Floats) -> Told:
    """Two velocities of the tool, then rest; before the command, too."""
    still = np.zeros((len(commands), 2))

    def told(time: float) -> Floats:
        if time < 0 or time >= 2 * PHASE_S:
            return still
        return np.asarray(commands[:, 1:3] if time < PHASE_S else commands[:, 3:5])

    return told


def _turn(angle: Floats) -> Floats:
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([np.stack([c, -s], axis=1), np.stack([s, c], axis=1)], axis=1)


def _left(vector: Floats) -> Floats:
    """Turned by a quarter: what a unit of turning does to a point there."""
    return np.stack([-vector[..., 1], vector[..., 0]], axis=-1)


def _loads(force: Floats, arm: Floats, mass: float) -> Floats:
    """(S, 3) of the feet: they carry the weight and the moment of their own friction at the ground."""
    # rows: sum N = m g; sum N (x + h f_x) = 0; the same for y: friction N f at h below the centre
    rows = np.concatenate([np.ones((len(arm), 1, 3)), np.swapaxes(arm + HEIGHT_M * force, 1, 2)], axis=1)
    weight = np.array([[mass * GRAVITY], [0.0], [0.0]])
    return np.maximum(np.linalg.solve(rows, np.broadcast_to(weight, (len(arm), 3, 1)))[:, :, 0], 0.0)


def _meet(state: Floats, turn: Floats, centre: Floats) -> tuple[Floats, Floats, Floats]:
    """(S,) depth of the tool in the bar, (S, 2) direction from tool to bar, (S, 2) lever from the centre of mass."""
    local = np.einsum("sji,sj->si", turn, state[:, 6:8] - state[:, :2]) + centre
    nearest = np.clip(local, -HALF, HALF)
    away = local - nearest
    distance = np.maximum(np.sqrt(np.sum(away**2, axis=1)), 1e-12)
    normal = -np.einsum("sij,sj->si", turn, away / distance[:, None])
    lever = np.einsum("sij,sj->si", turn, nearest - centre)
    return TOOL_M - distance, normal, lever


def tracked(state: Floats, centre: Floats) -> Floats:
    """(F, 7) pose of the bar's middle from (F, 11) states of one shot."""
    place = state[:, :2] - np.einsum("fij,j->fi", _turn(state[:, 2]), centre)
    zero = np.zeros(len(state))
    half = 0.5 * state[:, 2]
    return np.stack([*place.T, zero + HEIGHT_M, np.cos(half), zero, zero, np.sin(half)], axis=1)
