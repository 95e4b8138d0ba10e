"""Double-Bouncing-Ball: the scene and its YAML say everything but how a contact feels the mass of the ball."""

from __future__ import annotations

from collections.abc import Sequence

import mujoco

from compass_ros.cells.cell import Cell
from compass_ros.cells.mjcf import Mjcf
from compass_ros.types import Floats

_STIFFNESS, _DAMPING = 0, 1
"""Places in a direct solref."""


class BouncingBall(Mjcf):
    """`Dynamics` of the ball between its plates.

    MuJoCo divides a contact's stiffness and damping by the mass that it pushes, so that all balls would bounce alike.
    Rubber has a stiffness in N/m: the YAML's numbers hold for the default mass and are smaller for a heavier ball.
    """

    def __init__(self, cell: Cell) -> None:
        super().__init__(cell)
        self._mass = cell.index("ball@dyna@mass")
        self._nominal = cell.parameters[self._mass].default

    def apply(self, models: Sequence[mujoco.MjModel], values: Floats) -> None:
        super().apply(models, values)
        for model, mass in zip(models, values[:, self._mass], strict=True):
            model.pair_solref[:, [_STIFFNESS, _DAMPING]] *= self._nominal / mass
