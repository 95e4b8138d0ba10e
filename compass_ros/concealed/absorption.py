"""What ordinary parameters would swallow of a change: its part along their tangents, held back by their priors.

Along the tangents a large change is judged badly: a clock that runs 2 % wrong seems to leave 1.8 mm of the 7 mm it
moves, and parameters that are really moved leave 0.4 mm of it. So they are moved too.
"""

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
_ROUNDS = 6
_SHARES = (1.0, 0.4)
"""Of a step along the tangents."""
_WORTH = 0.98
"""A round that leaves more than this share of the loss before it is the last."""


def rms(change: Floats) -> float:
    """Root mean square distance of (..., 4) changes of x, y of both pucks [m]."""
    return float(np.sqrt(np.mean(change**2) * 2))


class Absorber:
    """The strongest parameters of the plain simulator around the (P,) true values, for (S, A) shots at (F,) times."""

    def __init__(self, cell: Cell, values: Floats, inputs: Floats, time_s: Floats) -> None:
        self._cell, self._values, self._inputs = cell, values, inputs
        self._simulator, self._times = Simulator(cell, threads=1), np.tile(time_s, (len(inputs), 1))
        self.plain = self._seen(values)
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
            moved = values.copy()
            moved[index] += step
            change = self._seen(moved) - self.plain
            columns.append(change.ravel() * parameter.half_width / step)
        tangents = np.stack(columns, axis=1) / NOISE
        self._basis = np.vstack([tangents, np.eye(len(columns))])
        self._project = np.linalg.pinv(self._basis)

    @property
    def _rows(self) -> int:
        return int(self.plain.shape[0] * self.plain.shape[1])

    def _seen(self, values: Floats) -> Floats:
        return self._simulator.observe(np.tile(values, (len(self._inputs), 1)), self._inputs, self._times)

    def left(self, change: Floats) -> Floats:
        """(S, F, 4) what the parameters leave of a change of the same shape [m], to first order."""
        data = np.concatenate([change.ravel() / NOISE, np.zeros(self._basis.shape[1])])
        fitted = self._basis @ (self._project @ data)
        return np.asarray((data - fitted)[: change.size].reshape(change.shape) * NOISE)

    def really_left(self, change: Floats) -> Floats:
        """The same with parameters that really move, round by round; what is left to first order where that is less."""
        which = [self._cell.index(name) for name in STRONG]
        parameters = [self._cell.parameters[i] for i in which]
        half, low, high = np.array([(p.half_width, p.low, p.high) for p in parameters]).T
        low, high = (low - self._values[which]) / half, (high - self._values[which]) / half

        def missed(moved: Floats) -> Floats:
            values = self._values.copy()
            values[which] += half * moved
            return np.concatenate([(self.plain + change - self._seen(values)).ravel() / NOISE, -moved])

        moved = np.zeros(len(which))
        data = missed(moved)
        for _ in range(_ROUNDS):
            before, step = float(data @ data), self._project @ data
            tried = [np.clip(moved + share * step, low, high) for share in _SHARES]
            best = min(((missed(there), there) for there in tried), key=lambda one: float(one[0] @ one[0]))
            if best[0] @ best[0] < before:
                data, moved = best
            if data @ data > _WORTH * before:
                break
        left, first = data[: change.size].reshape(change.shape) * NOISE, self.left(change)
        return np.asarray(first if rms(first) < rms(left) else left)
