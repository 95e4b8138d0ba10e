"""Rollouts on all cores: each set of values has a model of its own, each rollout starts from a state that holds all."""

from __future__ import annotations

import copy
import os
from dataclasses import dataclass

import mujoco
from mujoco.rollout import Rollout

from compass_ros.cells.derived import set_const
from compass_ros.cells.rotors import anchors
from compass_ros.simulation.native.program import Programs
from compass_ros.simulation.physics import Physics
from compass_ros.simulation.rotors import carry
from compass_ros.simulation.warned import Warned
from compass_ros.types import Floats


@dataclass
class Spent:
    """What rollouts have cost so far."""

    rollouts: int = 0
    simulated_seconds: float = 0.0


class Player:
    """Threads, models and data for rollouts of one scene, and what they have cost so far."""

    def __init__(self, scene: mujoco.MjModel, threads: int = 0, like: Player | None = None) -> None:
        """`threads`: 0 takes all cores; `like`: one of another scene, with which costs and warnings are counted."""
        self.threads = threads or len(os.sched_getaffinity(0))
        self.spent: Spent = like.spent if like else Spent()
        self.warned: Warned = like.warned if like else Warned()
        self._scene = scene
        self._models = [_copied(scene)]
        self._data = [mujoco.MjData(scene) for _ in range(self.threads)]
        self._scratch = mujoco.MjData(scene)
        self._pool = Rollout(nthread=self.threads)

    def written(self, physics: Physics, values: Floats) -> list[mujoco.MjModel]:
        """B models with (B, P) values in them; they are the player's own and hold until the next call."""
        while len(self._models) < len(values):
            self._models.append(_copied(self._scene))
        models = self._models[: len(values)]
        physics.write(models, values)
        for model in models:
            set_const(model, self._scratch)
        return models

    def carry(self, physics: Physics, values: Floats, start: Floats) -> None:
        """Put rotors where they carry what their joints hold, in (B, s) states at the start."""
        models = self.written(physics, values)
        with self.warned.counting(), Programs(models, physics.terms(values)):
            for model, state in zip(models, start, strict=True):
                mujoco.mj_setState(model, self._scratch, state, mujoco.mjtState.mjSTATE_FULLPHYSICS)
                carry(model, self._scratch)
                mujoco.mj_getState(model, self._scratch, state, mujoco.mjtState.mjSTATE_FULLPHYSICS)

    def play(
        self, physics: Physics, values: Floats, start: Floats, controls: Floats | None, steps: int
    ) -> tuple[Floats, Floats]:
        """(B, T, s) states and (B, T, nsensordata) sensors after each of T steps from (B, s) states on."""
        mujoco.set_mjcb_time(None)  # MuJoCo's profiler, on since an MjData was made, costs a quarter of a rollout
        alike = _first_alike(values)
        rows = sorted(set(alike))
        with self.warned.counting():
            models = dict(zip(rows, self.written(physics, values[rows]), strict=True))
            with Programs(list(models.values()), physics.terms(values[rows])):
                states, sensors = self._pool.rollout(
                    [models[row] for row in alike],
                    *(self._data, start, controls),
                    control_spec=physics.drives.parts,
                    nstep=steps,
                )
        self.spent.rollouts += len(values)
        self.spent.simulated_seconds += len(values) * steps * physics.time_step
        return states, sensors


def _copied(scene: mujoco.MjModel) -> mujoco.MjModel:
    """A model to write into. One tree is one island: MuJoCo need not look for them, a fifth of an arm's step. Anchors
    are trees that no constraint touches."""
    model = copy.copy(scene)
    beside = {model.jnt_bodyid[anchor] for _, anchor in anchors(model)}
    if model.ntree - len(beside) == 1:
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_ISLAND
    return model


def _first_alike(values: Floats) -> list[int]:
    """Of (B, P) rows each, the first one that is alike to the bit: they share a model, for writing one takes as long as
    some hundred steps."""
    first: dict[bytes, int] = {}
    return [first.setdefault(row.tobytes(), i) for i, row in enumerate(values)]
