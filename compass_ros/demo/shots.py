"""Which shots a demonstration plays."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from compass_ros.cells import Cell
from compass_ros.errors import ConfigError
from compass_ros.simulation import Simulator
from compass_ros.types import Floats

START_M = (0.062, 0.13)
"""Distance of the pusher's start from the first puck's centre: clear of its rim, and within the stroke."""
CLEAR_M = 0.062
"""Least distance of the pusher's start from the centre of any puck."""
MOVED_M = 0.05
"""A wide shot has to move the first puck this far in the nominal simulator; one that misses it shows nothing."""
WIDE_SHARE = 0.5
_TRIES = 1000


def draw_shots(cell: Cell, count: int, seed: int) -> tuple[dict[str, float], ...]:
    """`count` actions by name: half of them from the action space, half from all that the robot can do, in turn.

    Wide shots reach walls and pucks from more sides, which tells more about their parameters. Raises ConfigError where
    the cell has no such shots.
    """
    rng = np.random.default_rng(seed)
    names = [field.name for field in cell.action]
    low, high = np.array([(field.low, field.high) for field in cell.action]).reshape(-1, 2).T
    wide = _wide(cell, rng)
    rows = [
        next(wide) if int((i + 1) * WIDE_SHARE) > int(i * WIDE_SHARE) else rng.uniform(low, high) for i in range(count)
    ]
    return tuple(dict(zip(names, np.round(row, 4).tolist(), strict=True)) for row in rows)


def _wide(cell: Cell, rng: np.random.Generator) -> Iterator[Floats]:
    """Actions from the whole reach that start clear of the pucks and move the first one."""
    simulator = Simulator(cell, threads=1)
    middle = cell.reach.mean(axis=1)
    rest = simulator.observe(cell.defaults[None], middle[None], np.zeros((1, 1)))[0, 0].reshape(-1, 2)
    tries = 0
    while tries < _TRIES:
        tries += 1
        action = rng.uniform(*cell.reach.T)
        distance = np.linalg.norm(action[:2] - rest, axis=1)
        if not START_M[0] <= distance[0] <= START_M[1] or distance.min() < CLEAR_M:
            continue
        end = np.full((1, 1), cell.duration)
        moved = simulator.observe(cell.defaults[None], action[None], end)[0, 0, :2] - rest[0]
        if np.linalg.norm(moved) >= MOVED_M:
            tries = 0
            yield action
    raise ConfigError(f"cell '{cell.name}': none of {_TRIES} shots in its reach moves {cell.objects[0].name}")
