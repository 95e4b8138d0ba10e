"""Twelve shots worth recording: within reach, pushing a puck, unlike each other, and not chaotic."""

from __future__ import annotations

import numpy as np
from numpy.random import Generator

from compass_ros.cells import Cell
from compass_ros.concealed.table import TIME_STEP, Table
from compass_ros.errors import DataError
from compass_ros.simulation import Simulator
from compass_ros.types import Bools, Floats

POOL = 80
"""Commands that are tried."""
NEAREST, FARTHEST = 0.062, 0.13
"""Distance of the pusher from puck 1 at the start [m]; it never starts nearer than the first to any puck."""
CALM, LIVELY = 0.250, 0.005
"""Sensitivity to the speed of the push, rms distance per 0.1 of vel_discount [m]: chaotic above, dull below."""
STEADY = 0.050
"""The same for its direction, per 0.01 rad."""
SETTLED = 0.002
"""What a finer clock may move, rms [m]: a graze that the time step decides tells of numerics alone."""
_SPEED_STEP = 0.01
_ANGLE_STEPS = (0.002, 0.01)  # rad; two, since a graze shows at one of them
_REST = np.array([[-0.15, 0.0], [-0.075, -0.075]])
_HALF = np.array([0.45, 0.225])
_BAR = (np.array([0.1, 0.0]), np.array([0.0125, 0.09]))
_RADIUS = 0.0255
_STRIDE = 2
_MARGIN = 0.0005  # m


def choose_shots(cell: Cell, values: Floats, count: int, rng: Generator) -> Floats:
    """(count, A) commands from the cell's reach, for a table whose true parameters are the (P,) values.

    A shot is left out where it is chaotic: for the default parameters, as a plan would find, or for the true ones, as
    a robot finds that repeats it and sees the pucks scatter; and where the time step decides how it goes on. Raises
    DataError where too few are left.
    """
    pool = _in_reach(cell, rng)
    simulator = Simulator(cell, threads=1)

    def paths(of: Floats, speed: float = 0.0, angle: float = 0.0) -> Floats:
        many, turned = np.tile(of, (len(pool), 1)), pool.copy()
        many[:, cell.index("pusher@actuation@vel_discount")] += speed
        turned[:, 2] += angle
        return np.asarray(simulator.motion(many, turned, cell.duration).positions[:, ::_STRIDE])

    planned, real = paths(cell.defaults), paths(values)
    by_speed = [
        _distance(paths(of, speed=_SPEED_STEP), path) * 0.1 / _SPEED_STEP
        for of, path in ((cell.defaults, planned), (values, real))
    ]
    by_angle = [_distance(paths(values, angle=step), real) * 0.01 / step for step in _ANGLE_STEPS]
    keep = (np.min(by_speed, axis=0) > LIVELY) & (np.max(by_speed, axis=0) < CALM) & (np.max(by_angle, axis=0) < STEADY)
    bias = np.array([values[cell.index(f"env@camera@bias_{axis}")] for axis in "xy"])
    keep[keep] = (
        _distance(_finer(cell, values, pool[keep], simulator.time_step, real.shape[1]) + np.tile(bias, 2), real[keep])
        < SETTLED
    )
    if keep.sum() < count:
        raise DataError(f"{cell.name}: only {keep.sum()} of {len(pool)} shots are fit to be used, {count} are needed")
    features = _features(pool, planned, simulator.time_step * _STRIDE)
    return np.asarray(pool[keep][_diverse(features[keep], count, rng)])


def _finer(cell: Cell, values: Floats, inputs: Floats, time_step: float, frames: int) -> Floats:
    """(N, T, 4) the same paths as a world plays them, at the times of the plain ones."""
    played = Table(cell, values, inputs, TIME_STEP).play()
    return np.asarray(
        played.position[:: round(_STRIDE * time_step / TIME_STEP)]
        .transpose(1, 0, 2, 3)
        .reshape(len(inputs), -1, 4)[:, :frames]
    )


def _distance(one: Floats, other: Floats) -> Floats:
    """(N,) rms distance of (N, T, 4) paths of two pucks [m]."""
    return np.asarray(np.sqrt(np.mean(np.sum((one - other) ** 2, axis=2) / 2, axis=1)))


def _in_reach(cell: Cell, rng: Generator) -> Floats:
    """(POOL, A) commands whose pusher starts at the right distances and heads for a puck."""
    low, high = cell.reach.T
    found: list[Floats] = []
    while len(found) < POOL:
        command = rng.uniform(low, high)
        away = np.linalg.norm(_REST - command[:2], axis=1)
        if not (NEAREST < away[0] < FARTHEST and away[1] > NEAREST):
            continue
        line = np.arctan2(*(_REST[0] - command[:2])[::-1]) + command[2]
        direction = np.array([np.cos(line), np.sin(line)])
        ahead = (_REST - command[:2]) @ direction
        beside = np.abs((_REST - command[:2]) @ np.array([-direction[1], direction[0]]))
        if np.any((ahead > 0) & (ahead < FARTHEST) & (beside < 0.03)):
            found.append(command)
    return np.array(found)


def _features(pool: Floats, paths: Floats, dt: float) -> Floats:
    """(N, M) what makes shots differ: command, first motion of each puck, what each puck touches."""
    speed = pool[:, 3:4] / 0.2
    angle = np.arctan2(_REST[0, 1] - pool[:, 1], _REST[0, 0] - pool[:, 0])[:, None]
    parts = [speed, np.cos(angle), np.sin(angle)]
    for puck in (0, 1):
        path = paths[:, :, 2 * puck : 2 * puck + 2]
        first = path[:, min(round(0.5 / dt), path.shape[1] - 1)] - path[:, 0]
        parts.extend((first / 0.1, 0.7 * _touches(path)))
    parts.append(_meet(paths)[:, None] * 0.7)
    return np.hstack(parts)


def _touches(path: Floats) -> Bools:
    """(N, 5) whether a puck touches the walls (low x, low y, high x, high y) and the bar."""
    margin = _RADIUS + _MARGIN
    walls = np.concatenate([(path < -_HALF + margin).any(axis=1), (path > _HALF - margin).any(axis=1)], axis=1)
    gap = np.maximum(np.abs(path - _BAR[0]) - _BAR[1], 0)
    return np.concatenate([walls, (np.linalg.norm(gap, axis=2) < margin).any(axis=1, keepdims=True)], axis=1)


def _meet(paths: Floats) -> Bools:
    return np.asarray((np.linalg.norm(paths[:, :, :2] - paths[:, :, 2:], axis=2) < 2 * _RADIUS + _MARGIN).any(axis=1))


def _diverse(features: Floats, count: int, rng: Generator) -> list[int]:
    """Indices of shots as unlike as can be: from a random one on, always the farthest from those chosen."""
    chosen = [int(rng.integers(len(features)))]
    nearest = np.linalg.norm(features - features[chosen[0]], axis=1)
    while len(chosen) < count:
        chosen.append(int(np.argmax(nearest)))
        nearest = np.minimum(nearest, np.linalg.norm(features - features[chosen[-1]], axis=1))
    return chosen
