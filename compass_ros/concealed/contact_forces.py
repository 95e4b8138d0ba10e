"""Contacts of one shot while they last: when they began, how fast, and the forces that laws add to them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from compass_ros.concealed.law import Ingredient
from compass_ros.types import Floats


@dataclass(frozen=True)
class Impact:
    """The beginning of a contact."""

    shot: int
    time: float
    names: tuple[str, str]
    """The two geoms."""
    approach: float
    """Speed along the normal [m/s]."""


class Touch:
    """Follows the contacts of one shot; called before a step while there are any. Changes that shot's own model."""

    def __init__(self, shot: int, model: mujoco.MjModel, ingredients: Sequence[Ingredient]) -> None:
        self.shot, self.model = shot, model
        self.impacts: list[Impact] = []
        self.open: set[tuple[int, int]] = set()
        """Pairs of geoms that touch now."""
        self._dampers = [i for i in ingredients if i.law.damping is not None]
        self._rims = [i for i in ingredients if i.law.rim is not None]
        self._solref = model.pair_solref.copy()
        geoms = zip(model.pair_geom1.tolist(), model.pair_geom2.tolist(), strict=True)
        self._pair = {frozenset(two): index for index, two in enumerate(geoms)}
        self._dof = {g: int(model.body_dofadr[model.geom_bodyid[g]]) for g in range(model.ngeom)}  # -1: does not move
        self._spins = {g: int(model.body_dofnum[model.geom_bodyid[g]]) == 3 for g in range(model.ngeom)}

    def step(self, data: mujoco.MjData, time: float) -> None:
        """Note new contacts and decide their damping; rub the rims of all."""
        geoms = data.contact.geom
        now = {(int(a), int(b)) for a, b in geoms}
        for pair in now - self.open:
            self._begin(data, pair, time)
        for pair in self.open - now:
            index = self._pair[frozenset(pair)]
            self.model.pair_solref[index] = self._solref[index]
        self.open = now
        for ingredient in self._rims:
            assert ingredient.law.rim is not None
            for contact in range(len(geoms)):
                self._rub(data, contact, ingredient.law.rim(ingredient.size, ingredient.shape))

    def _begin(self, data: mujoco.MjData, pair: tuple[int, int], time: float) -> None:
        index = next(i for i, two in enumerate(data.contact.geom) if tuple(two.tolist()) == pair)
        normal = data.contact.frame[index][:2]
        approach = abs(float((self._velocity(data, pair[1]) - self._velocity(data, pair[0])) @ normal))
        names = (self.model.geom(pair[0]).name, self.model.geom(pair[1]).name)
        self.impacts.append(Impact(self.shot, time, names, approach))
        factor = 1.0
        for ingredient in self._dampers:
            assert ingredient.law.damping is not None
            factor *= ingredient.law.damping(ingredient.size, ingredient.shape, approach)
        row = self._pair[frozenset(pair)]
        self.model.pair_solref[row, 1] = self._solref[row, 1] * factor

    def _velocity(self, data: mujoco.MjData, geom: int) -> Floats:
        dof = self._dof[geom]
        return np.zeros(2) if dof < 0 else np.asarray(data.qvel[dof : dof + 2])

    def _rub(self, data: mujoco.MjData, contact: int, coefficient: float) -> None:
        """Coulomb friction of the rims with the normal force of the last step, never more than stops the slip."""
        a, b = (int(g) for g in data.contact.geom[contact])
        address = int(data.contact.efc_address[contact])
        load = float(data.efc_force[address]) if address >= 0 else 0.0
        if load <= 0:
            return
        normal = data.contact.frame[contact][:2]
        tangent = np.array([-normal[1], normal[0]])
        slip, softness = 0.0, 0.0  # slip of b over a [m/s]; slip that a unit of impulse takes away [1/kg]
        for geom, side in ((a, -1.0), (b, 1.0)):
            dof, body = self._dof[geom], self.model.geom_bodyid[geom]
            if dof < 0:
                continue
            slip += side * float(self._velocity(data, geom) @ tangent)
            softness += 1 / float(self.model.body_mass[body])
            if self._spins[geom]:
                radius = float(self.model.geom_size[geom, 0])
                slip -= radius * float(data.qvel[dof + 2])  # b's rim looks against the normal, a's along it
                softness += radius**2 / float(self.model.body_inertia[body, 2])
        limit = abs(slip) / softness / self.model.opt.timestep
        force = -np.sign(slip) * min(coefficient * load, limit)
        for geom, side in ((a, -1.0), (b, 1.0)):
            dof = self._dof[geom]
            if dof >= 0:
                data.qfrc_applied[dof : dof + 2] += side * force * tangent
                if self._spins[geom]:
                    data.qfrc_applied[dof + 2] -= float(self.model.geom_size[geom, 0]) * force
