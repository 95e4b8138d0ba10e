"""Which shots a demonstration plays."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from compass_ros.cells import Cell
from compass_ros.errors import ConfigError
from compass_ros.simulation import Simulator
from compass_ros.types import Floats

START_M = (0.062, 0.13)
"""Distance of the pusher's start from the first object's centre: clear of its rim, and within the stroke."""
CLEAR_M = 0.062
"""Least distance of the pusher's start from the centre of any object."""
MOVED_M = 0.05
"""A shot has to move the first object this far in the nominal simulator; one that misses it shows nothing."""
JOLT = (1e-4, 1e-4, 1e-3, 1e-3)
"""Standard deviations of x, y [m], angle [rad] and velocity [m/s] from one try of a shot to the next."""
APART_M = 0.01
"""Tries of a shot end no further apart (median, nominal simulator): what never comes out alike teaches little."""
_TRIES, _CANDIDATES = 8, 1000


def draw_shots(cell: Cell, count: int, seed: int) -> tuple[dict[str, float], ...]:
    """`count` actions by name (x, y, angle, velocity), every other one from all that the robot can do.

    Such wide shots reach walls and objects from more sides than the action space does, which tells more about their
    parameters. Raises ConfigError where the cell has no such shots.
    """
    names = [field.name for field in cell.action]
    if names != ["x", "y", "angle", "velocity"]:
        raise ConfigError(f"cell '{cell.name}': expected an action of x, y, angle and velocity, found {names}")
    rng = np.random.default_rng(seed)
    narrow = _useful(cell, np.array([(field.low, field.high) for field in cell.action]), rng)
    wide = _useful(cell, cell.reach, rng)
    rows = [next(wide if i % 2 else narrow) for i in range(count)]
    return tuple(dict(zip(names, row.tolist(), strict=True)) for row in rows)


def _useful(cell: Cell, box: Floats, rng: np.random.Generator) -> Iterator[Floats]:
    """(4,) actions from a box (4, 2) that start clear of the objects, move the first, and come out alike again."""
    simulator = Simulator(cell, threads=1)
    rest = simulator.observe(cell.defaults[None], box.mean(axis=1)[None], np.zeros((1, 1)))[0, 0].reshape(-1, 2)
    last = 0
    candidate = 0
    while candidate - last < _CANDIDATES:
        candidate += 1
        action = np.round(rng.uniform(*box.T), 4)
        distance = np.linalg.norm(action[:2] - rest, axis=1)
        if not START_M[0] <= distance[0] <= START_M[1] or distance.min() < CLEAR_M:
            continue
        tries = np.vstack([action, rng.normal(action, JOLT, (_TRIES, 4))])
        values = np.tile(cell.defaults, (len(tries), 1))
        seen = simulator.observe(values, tries, np.full((len(tries), 1), cell.duration))
        ends = seen[:, 0].reshape(len(tries), -1, 2)
        apart = np.linalg.norm(ends[1:] - ends[0], axis=2).max(axis=1)
        if np.linalg.norm(ends[0, 0] - rest[0]) >= MOVED_M and np.median(apart) <= APART_M:
            last = candidate
            yield action
    raise ConfigError(f"cell '{cell.name}': none of {_CANDIDATES} shots in its reach shows anything")
