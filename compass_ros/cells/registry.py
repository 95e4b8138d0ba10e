"""Which code gives a cell's YAML its meaning."""

from __future__ import annotations

from dataclasses import replace

from compass_ros.cells.air_hockey import AirHockey
from compass_ros.cells.bouncing_ball import BouncingBall
from compass_ros.cells.cell import Cell
from compass_ros.cells.dynamics import Dynamics
from compass_ros.cells.extended import Extended
from compass_ros.cells.mjcf import Mjcf
from compass_ros.errors import ConfigError, nearest

DYNAMICS: dict[str, type[AirHockey] | type[Mjcf]] = {
    "air_hockey": AirHockey,
    "bouncing_ball": BouncingBall,
    "mjcf": Mjcf,
}


def dynamics_of(cell: Cell) -> Dynamics:
    """The dynamics that the cell names. Raises ConfigError with the nearest known name."""
    name = cell.spec.dynamics
    if name not in DYNAMICS:
        raise ConfigError(
            f"{cell.path}: dynamics: unknown '{name}'; known: {', '.join(DYNAMICS)}{nearest(name, DYNAMICS)}"
        )
    hand_made = tuple(p for p in cell.spec.parameters if not p.field)
    if issubclass(DYNAMICS[name], Mjcf) or len(hand_made) == len(cell.spec.parameters):
        return DYNAMICS[name](cell)
    own = replace(cell, spec=replace(cell.spec, parameters=hand_made))
    return Extended(DYNAMICS[name](own), cell, len(hand_made))
