"""Exported effects on any MuJoCo model."""

from __future__ import annotations

import copy
import weakref
from collections.abc import Sequence

import mujoco

from compass_ros.cells.derived import set_const
from compass_ros.errors import ConfigError
from compass_ros.simulation.effects.effect import Context, Effect, restore, table_friction
from compass_ros.simulation.effects.exported import Exported, FittedEffect
from compass_ros.simulation.native.program import Programs, Term
from compass_ros.simulation.rotors import carry, relax
from compass_ros.simulation.sites import Places


class Attachment:
    """Effects that act on a model until `detach`, the end of a `with` block, or the end of this object."""

    def __init__(self, model: mujoco.MjModel, before: mujoco.MjModel, programs: Programs) -> None:
        self._end = weakref.finalize(self, _end, model, before, programs)

    def detach(self) -> None:
        """Stop the forces and undo the changes of the model. A second call does nothing."""
        self._end()

    def __enter__(self) -> Attachment:
        return self

    def __exit__(self, *_: object) -> None:
        self.detach()


def attach(model: mujoco.MjModel, data: mujoco.MjData, exported: Exported) -> Attachment:
    """Let exported effects, and the table's friction that comes with them, act on a model from now on.

    Keep what is returned as long as the model is stepped. Raises ConfigError, and leaves the model as it was, for
    effects of the command or of the sensor, which act outside the model, where the model lacks an object, and where it
    has effects attached already. A motor's side of a joint (`cells/rotors.py`) starts where it carries its load.
    """
    places = Places(model, frozenset(exported.sliding))
    acting = [(fitted, _context(places, exported, fitted)) for fitted in exported.effects]
    programs = Programs([model], _terms(places, exported, acting))
    before = copy.copy(model)
    try:
        for fitted, context in acting:
            if fitted.attached.effect.model is not None:
                fitted.attached.effect.model(model, fitted.attached.expected(fitted.values), context)
        programs.__enter__()
    except ConfigError:
        restore(model, before)
        raise
    set_const(model, copy.copy(data))
    relax(model, data.qpos)
    carry(model, data)
    mujoco.mj_forward(model, data)
    return Attachment(model, before, programs)


def _terms(places: Places, exported: Exported, acting: Sequence[tuple[FittedEffect, Context]]) -> list[Term]:
    terms = [table_friction(s, places) for s in exported.sliding.values()]
    for fitted, context in acting:
        kind = fitted.attached.effect
        numbers = fitted.attached.expected(fitted.values)[None]
        own = kind.forces(numbers, context) if kind.forces is not None else ()
        if kind.model is None and not own:
            raise _outside(kind)
        terms.extend(own)
    return terms


def _outside(kind: Effect) -> ConfigError:
    return ConfigError(f"effect '{kind.name}' belongs to the {kind.channel}, outside the model; apply it there")


def _context(places: Places, exported: Exported, fitted: FittedEffect) -> Context:
    kind = fitted.attached.effect
    if kind.model is None and kind.forces is None:
        raise _outside(kind)
    return context_in(places, exported, fitted)


def context_in(places: Places, exported: Exported, fitted: FittedEffect) -> Context:
    """What hooks that act on a model are told; there are no sensors. Raises ConfigError where it lacks an object."""
    return Context(fitted.attached.sites(places), exported.sliding, (), (), float(places.model.opt.timestep))


def _end(model: mujoco.MjModel, before: mujoco.MjModel, programs: Programs) -> None:
    programs.__exit__()
    restore(model, before)
    set_const(model)
