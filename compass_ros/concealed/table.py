"""The table on its own stepping loop: all shots of a world at once, forces in numpy, contacts and servo by MuJoCo.

What is shared with the suite is the cell: its scene, what its parameters change, where a shot starts, how the pusher is
told to move. The table's friction and all other physics are added here, at every step of a finer clock.
"""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from compass_ros.cells import Cell
from compass_ros.cells.air_hockey import AirHockey
from compass_ros.concealed.contact_forces import Impact, Touch
from compass_ros.concealed.law import PUCKS, Ingredient, Moment, Sample
from compass_ros.types import Floats

TIME_STEP = 0.0005
"""Seconds; half of the library's."""
DURATION = 2.65
"""Seconds that are played: an episode and what a sensor may look beyond it."""


@dataclass(frozen=True)
class Played:
    """Motion of the pucks in all shots."""

    time_step: float
    position: Floats
    """(T + 1, S, 2, 2) shot, puck, xy [m] on the table; row 0 is the start."""
    velocity: Floats
    """(T + 1, S, 2, 2) [m/s]."""
    impacts: tuple[Impact, ...]
    """First touches in their order."""
    state: Floats
    """(T + 1, S, nq) positions of all joints of the scene, the pusher's among them."""

    def touched(self) -> dict[str, int]:
        """How many shots touch each thing."""
        pairs = {(impact.shot, name) for impact in self.impacts for name in impact.names}
        return {name: sum(other == name for _, other in pairs) for name in sorted({name for _, name in pairs})}

    def sample(self) -> Sample:
        """A perfect sensor; before the start and after the end the pucks stand still."""
        rows = self.position.transpose(1, 0, 2, 3).reshape(self.position.shape[1], -1, 4)

        def at(time: Floats) -> Floats:
            index = np.clip(time / self.time_step, 0, rows.shape[1] - 1)
            low = np.minimum(index.astype(int), rows.shape[1] - 2)
            share = (index - low)[:, :, None]
            shots = np.arange(len(rows))[:, None]
            return np.asarray((1 - share) * rows[shots, low] + share * rows[shots, low + 1])

        return at


class Table:
    """The air-hockey table with (P,) true values of the cell's parameters and (S, A) commands."""

    def __init__(self, cell: Cell, values: Floats, inputs: Floats, time_step: float) -> None:
        self.cell, self.values, self.inputs, self.time_step = cell, values, inputs, time_step
        dynamics = AirHockey(cell)
        dynamics.model.opt.timestep = time_step  # this table's own copy of the scene
        shots, steps = len(inputs), round(DURATION / time_step)
        many = np.tile(values, (shots, 1))
        self._models = [copy.copy(dynamics.model) for _ in range(shots)]
        dynamics.apply(self._models, many)
        self._start, _ = dynamics.start(many, inputs)
        self._command = dynamics.controls(many, inputs, steps)
        model = self._models[0]
        self._rest = np.stack([model.body(name).pos[:2] for name in PUCKS])
        self._dofs = np.concatenate([[model.joint(f"{name}_{axis}").dofadr[0] for axis in "xy"] for name in PUCKS])
        self._mass = np.array([model.body(name).mass[0] for name in PUCKS])
        carried = 1 - values[cell.index("table@dyna@lift")]
        self._load = carried * self._mass * values[cell.index("env@dyna@gravity")]
        self._friction = np.array([values[cell.index(f"{name}@dyna@friction_sliding")] for name in PUCKS])
        self._creep = np.array([values[cell.index(f"{name}@dyna@friction_creep")] for name in PUCKS])

    def moment(self, time: float, position: Floats, velocity: Floats) -> Moment:
        """A state of the pucks with what laws need to know of them."""
        speed = np.sqrt(velocity[:, :, 0] ** 2 + velocity[:, :, 1] ** 2)
        return Moment(time, position, velocity, speed, self._mass, self._load, self._creep)

    def play(self, ingredients: Sequence[Ingredient] = ()) -> Played:
        """Roll all shots out with these laws added to the cell."""
        models = [copy.copy(model) for model in self._models]
        command = self._command
        for i in ingredients:
            if i.law.scene is not None:
                for model in models:
                    i.law.scene(i.size, i.shape, i.objects, model)
            if i.law.command is not None:
                command = i.law.command(i.size, i.shape, command, self.time_step)
        touches = [Touch(shot, model, ingredients) for shot, model in enumerate(models)]
        return self._roll(models, np.ascontiguousarray(command.transpose(1, 0, 2)), ingredients, touches)

    def _roll(
        self,
        models: Sequence[mujoco.MjModel],
        command: Floats,
        ingredients: Sequence[Ingredient],
        touches: Sequence[Touch],
    ) -> Played:
        """The loop. (T, S, 2) commands of the pusher; forces follow from the state before each step."""
        pushes = [i for i in ingredients if i.law.force is not None]
        masks = [np.array([name in i.objects for name in PUCKS], dtype=float)[None, :, None] for i in pushes]
        data = [mujoco.MjData(model) for model in models]
        views = [(d, d.qpos, d.qvel, d.qfrc_applied, d.ctrl) for d in data]
        shots, steps, dofs = len(data), len(command), self._dofs
        for (_, qpos, *_), start in zip(views, self._start, strict=True):
            qpos[:] = start
        q, v, applied = np.zeros((3, shots, models[0].nv))
        position, velocity = np.zeros((2, steps + 1, shots, 2, 2))
        state = np.zeros((steps + 1, shots, models[0].nq))
        dry = self._friction * self._load
        for step in range(steps + 1):
            for shot, (_, qpos, qvel, _, _) in enumerate(views):
                q[shot], v[shot] = qpos, qvel
            state[step] = q
            position[step] = q[:, dofs].reshape(shots, 2, 2) + self._rest
            velocity[step] = v[:, dofs].reshape(shots, 2, 2)
            if step == steps:
                break
            now = self.moment(step * self.time_step, position[step], velocity[step])
            force = now.against(np.broadcast_to(dry, now.speed.shape))
            for ingredient, mask in zip(pushes, masks, strict=True):
                assert ingredient.law.force is not None
                force = force + mask * ingredient.law.force(ingredient.size, ingredient.shape, now)
            applied[:, dofs] = force.reshape(shots, 4)
            for shot, (d, _, _, push, control) in enumerate(views):
                push[:], control[:] = applied[shot], command[step, shot]
                if d.ncon or touches[shot].open:
                    touches[shot].step(d, now.time)
                mujoco.mj_step(models[shot], d)
        impacts = sorted((impact for touch in touches for impact in touch.impacts), key=lambda impact: impact.time)
        return Played(self.time_step, position, velocity, tuple(impacts), state)
