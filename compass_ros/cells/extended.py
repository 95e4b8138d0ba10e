"""A cell with code of its own, and further parameters that are plain fields of its scene."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import mujoco

from compass_ros.cells.cell import Cell
from compass_ros.cells.dynamics import Dynamics, Sliding
from compass_ros.cells.fields import Fields
from compass_ros.types import Floats, Ints


class Extended:
    """`Dynamics` that hands the first parameters to the cell's own code and writes the others itself."""

    def __init__(self, own: Dynamics, cell: Cell, count: int) -> None:
        """`count`: parameters that are the own code's; they come first."""
        self._own, self._count = own, count
        rest = list(enumerate(cell.spec.parameters))[count:]
        self._fields = Fields(own.model, rest, str(cell.path))

    @property
    def model(self) -> mujoco.MjModel:
        return self._own.model

    def apply(self, models: Sequence[mujoco.MjModel], values: Floats) -> None:
        self._own.apply(models, values[:, : self._count])
        self._fields.write(models, values)

    @property
    def first(self) -> Floats:
        return self._own.first

    def start(self, values: Floats, inputs: Floats) -> tuple[Floats, Floats]:
        return self._own.start(values[:, : self._count], inputs)

    def controls(self, values: Floats, inputs: Floats, steps: int) -> Floats:
        return self._own.controls(values[:, : self._count], inputs, steps)

    def sliding(self, values: Floats) -> tuple[Sliding, ...]:
        return self._own.sliding(values[:, : self._count])

    def columns(self) -> Ints:
        return self._own.columns()

    def observe(self, values: Floats, positions: Floats) -> Floats:
        return self._own.observe(values[:, : self._count], positions)

    def poses(self, values: Floats, positions: Floats) -> Mapping[str, Floats]:
        return self._own.poses(values[:, : self._count], positions)
