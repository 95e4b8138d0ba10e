"""A cell as a scene sees it, and the suite's simulator at a world's true parameters."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from compass_ros.cells import Cell, load
from compass_ros.simulation import Simulator
from compass_ros.types import Floats
from compass_ros.worlds.world import Task


def task_of(name: str) -> tuple[Cell, Task]:
    cell = load(name)
    return cell, Task(cell.name, cell.hash, cell.model_path, cell.parameters)


def simulated(cell: Cell, values: Mapping[str, float], inputs: Floats, time_s: Floats) -> Floats:
    """(E, F, C) what the suite's simulator shows for (E, A) inputs at (E, F) moments."""
    row = cell.values({name: float(value) for name, value in values.items()})
    return np.asarray(Simulator(cell, threads=1).observe(np.tile(row, (len(inputs), 1)), inputs, time_s))
