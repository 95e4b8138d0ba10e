"""The air-hockey table for tests: one compiled simulator, and shots that reach every wall and the bar."""

from __future__ import annotations

from functools import cache

import numpy as np

from compass_ros.cells import Cell, load
from compass_ros.simulation import Simulator
from compass_ros.simulation.effects import Attached, Effect
from compass_ros.types import Floats

DESCRIBED = np.array([-0.225, 0.075, 0.0, 0.45])
"""The paper's shot: pusher, puck 1, puck 2, right wall, goal."""
WIDE = np.array([[-0.123, 0.094, 0.09, 0.75], [-0.252, -0.063, -0.15, 0.546], [-0.168, 0.097, -0.164, 0.661]])
"""Three shots within the arm's reach that together feel all 64 parameters."""

KINDS = {"table", "lying", "planar", "wall", "contacts", "tool_drive", "camera"}
"""The kinds of site that it has."""


def on_table(kind: Effect) -> bool:
    """Whether an effect can act on it without a name."""
    return bool(KINDS & set(kind.on)) and not kind.by_name


@cache
def cell() -> Cell:
    return load("air_hockey")


@cache
def simulator() -> Simulator:
    return Simulator(cell(), threads=2)


def attached(kind: Effect) -> Attached:
    """An effect on all of the table that it can act on, on one wall of those."""
    if kind.on_walls:
        return Attached(kind, ("right_wall",))
    return Attached(kind, ("puck1", "puck2") if kind.moves else ())


def actions(count: int, seed: int = 0) -> Floats:
    """(count, 4) shots drawn from the paper's action box."""
    low, high = np.array([(a.low, a.high) for a in cell().action]).T
    return np.asarray(np.random.default_rng(seed).uniform(low, high, (count, 4)))


def values(given: dict[str, float] | None = None, count: int = 1) -> Floats:
    """(count, 64) the defaults with the given ones in place."""
    return np.tile(cell().values(given or {}), (count, 1))
