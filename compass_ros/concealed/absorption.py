"""What ordinary parameters would swallow of a change: its part along their tangents, held back by their priors."""

from __future__ import annotations

import numpy as np

from compass_ros.cells import Cell
from compass_ros.simulation import Simulator
from compass_ros.types import Floats

NOISE = 1e-3
"""Weight of recordings against priors: standard deviation of one coordinate [m]."""
_BIASES = ("env@camera@bias_x", "env@camera@bias_y")
_GEOMS = ("puck1", "puck2", "pusher", "front_wall", "back_wall", "left_wall", "right_wall", "obstacle")
STRONG = (
    *_BIASES,
    *(f"{name}@dyna@damping" for name in _GEOMS),
    *(f"{name}@dyna@friction_sliding" for name in ("puck1", "puck2")),
    *(f"pusher@actuation@{name}" for name in ("vel_discount", "stroke", "settle_time", "ramp_time")),
    *(f"{name}@pose@yaw" for name in ("front_wall", "back_wall", "left_wall", "right_wall")),
    *(f"{name}@shape@radius" for name in ("puck1", "puck2", "pusher")),
    "puck1@dyna@impedance_width",
)
"""Parameters that move the pucks by 0.3 mm rms or more within their randomisation half-width."""


def rms(change: Floats) -> float:
    """Root mean square distance of (..., 4) changes of x, y of both pucks [m]."""
    return float(np.sqrt(np.mean(change**2) * 2))


class Absorber:
    """The strongest parameters of the plain simulator around the (P,) true values, for (S, A) shots at (F,) times."""

    def __init__(self, cell: Cell, values: Floats, inputs: Floats, time_s: Floats) -> None:
        simulator = Simulator(cell, threads=1)
        times = np.tile(time_s, (len(inputs), 1))
        self.plain = simulator.observe(np.tile(values, (len(inputs), 1)), inputs, times)
        """(S, F, 4) what the plain simulator says, with its own time step."""
        columns = []
        for name in STRONG:
            index = cell.index(name)
            parameter = cell.parameters[index]
            if name in _BIASES:
                columns.append(
                    np.tile(parameter.half_width * np.eye(4)[_BIASES.index(name) :: 2].sum(axis=0), self._rows)
                )
                continue
            step = 0.05 * parameter.half_width * (1 if values[index] < parameter.default else -1)
            moved = np.tile(values, (len(inputs), 1))
            moved[:, index] += step
            change = simulator.observe(moved, inputs, times) - self.plain
            columns.append(change.ravel() * parameter.half_width / step)
        tangents = np.stack(columns, axis=1) / NOISE
        self._basis = np.vstack([tangents, np.eye(len(columns))])
        self._project = np.linalg.pinv(self._basis)

    @property
    def _rows(self) -> int:
        return int(self.plain.shape[0] * self.plain.shape[1])

    def left(self, change: Floats) -> Floats:
        """(S, F, 4) what the parameters leave of a change of the same shape [m]."""
        data = np.concatenate([change.ravel() / NOISE, np.zeros(self._basis.shape[1])])
        fitted = self._basis @ (self._project @ data)
        return np.asarray((data - fitted)[: change.size].reshape(change.shape) * NOISE)
