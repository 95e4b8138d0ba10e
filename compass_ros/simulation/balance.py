"""What numbers of a scene do along recorded motions: the forces that are missing for them, and the sensors."""

from __future__ import annotations

import copy
from collections.abc import Callable

import mujoco
import numpy as np

from compass_ros.cells.derived import set_const
from compass_ros.cells.dynamics import Dynamics
from compass_ros.simulation.effects.attached import Attached
from compass_ros.simulation.effects.effect import Context
from compass_ros.simulation.sites import Places
from compass_ros.simulation.sizes import moments
from compass_ros.types import Floats

Change = Callable[[mujoco.MjModel], None]
"""Writes a number into a model."""


class Balance:
    """Of (E, T, s) full states of episodes, at moments of each.

    At the accelerations of one model another one, with a number changed, needs other forces on its joints: by inverse
    dynamics, less what its actuators exert there.
    """

    def __init__(self, model: mujoco.MjModel, states: Floats, driven: tuple[Floats | None, int]) -> None:
        self._model, self._states, self._driven = copy.copy(model), states, driven
        data = mujoco.MjData(model)
        forces = np.empty(model.nv)
        self._accelerations, moved = [], []
        for _ in moments(self._model, data, states, driven):
            self._accelerations.append(data.qacc.copy())
            mujoco.mj_mulM(self._model, data, forces, data.qacc)
            moved.append(np.concatenate([np.abs(forces) + np.abs(data.qfrc_bias), np.abs(data.sensordata)]))
        typical = np.sqrt(np.mean(np.square(moved), axis=0))
        self._typical = np.where(typical > 0, typical, np.inf)
        self._here = self._needed(self._model)

    @property
    def size(self) -> int:
        """R."""
        return int(self._here.size)

    def changed(self, change: Change) -> Floats:
        """(R,) forces and sensors at all moments less those of the model itself, as shares of what is typical."""
        other = copy.copy(self._model)
        change(other)
        set_const(other)
        return (self._needed(other) - self._here).ravel()

    def _needed(self, model: mujoco.MjModel) -> Floats:
        """(M, nv + nsensordata)."""
        data, rows = mujoco.MjData(model), []
        for acceleration, _ in zip(self._accelerations, moments(model, data, self._states, self._driven), strict=True):
            driving = data.qfrc_actuator.copy()
            data.qacc[:] = acceleration
            mujoco.mj_inverse(model, data)
            rows.append(np.concatenate([data.qfrc_inverse - driving, data.sensordata]))
        return np.asarray(np.stack(rows) / self._typical)


def values_written(dynamics: Dynamics, values: Floats) -> Change:
    """Writes (P,) values of a cell."""
    return lambda model: dynamics.apply([model], values[None])


def law_written(attached: Attached, numbers: Floats, places: Places) -> Change:
    """Writes what a law with (q,) numbers changes in a model."""
    sites, hook = attached.sites(places), attached.effect.model
    context = Context(sites, {}, (), (), float(places.model.opt.timestep))

    def write(model: mujoco.MjModel) -> None:
        if hook is not None:
            hook(model, numbers, context)

    return write
