"""The calibrated scene as MJCF, and the fitted effects as YAML."""

from __future__ import annotations

import copy
from pathlib import Path

import mujoco
import numpy as np

from compass_ros.cells import Cell
from compass_ros.cells.registry import dynamics_of
from compass_ros.simulation.effects import FittedEffect, write_effects
from compass_ros.simulation.simulator import Simulator
from compass_ros.types import Floats


def write_scene(cell: Cell, values: Floats, path: Path) -> None:
    """The cell's scene with (P,) values in it, as MJCF that MuJoCo loads by itself.

    What is no field of a model (the speed that an arm reaches, a camera's bias) stays in result.json.
    """
    dynamics = dynamics_of(cell)
    spec = mujoco.MjSpec.from_file(str(cell.model_path))
    model = copy.copy(dynamics.model)
    dynamics.apply([model], values[None])
    _into_spec(spec, model)
    spec.compile()
    path.write_text(spec.to_xml(), encoding="utf-8")


def _into_spec(spec: mujoco.MjSpec, model: mujoco.MjModel) -> None:
    """Copy back the fields that cells tune."""
    spec.option.gravity = model.opt.gravity
    spec.option.cone = model.opt.cone
    for i, pair in enumerate(spec.pairs):
        pair.solref = model.pair_solref[i]
        pair.solimp = model.pair_solimp[i]
    for geom in spec.geoms:
        index = model.geom(geom.name).id if geom.name else -1
        if index >= 0:
            geom.size, geom.pos, geom.quat = model.geom_size[index], model.geom_pos[index], model.geom_quat[index]
            geom.friction, geom.solref, geom.solimp = (
                model.geom_friction[index],
                model.geom_solref[index],
                model.geom_solimp[index],
            )
            body = model.geom_bodyid[index]
            if body and model.body_geomnum[body] == 1:
                geom.mass = model.body_mass[body]
    for joint in spec.joints:
        dof = model.joint(joint.name).dofadr[0]
        joint.damping, joint.armature, joint.frictionloss = (
            _first(joint.damping, model.dof_damping[dof]),
            float(model.dof_armature[dof]),
            float(model.dof_frictionloss[dof]),
        )
    for i, actuator in enumerate(spec.actuators):
        actuator.gainprm, actuator.biasprm = model.actuator_gainprm[i], model.actuator_biasprm[i]


def _first(like: object, value: float) -> object:
    """`value` in the shape that this version of MuJoCo wants for a joint's damping: a number, or a polynomial."""
    if isinstance(like, float):
        return value
    polynomial = np.zeros(np.shape(like))
    polynomial[0] = value
    return polynomial


def write_effects_of(
    simulator: Simulator | None, values: Floats | None, std: Floats | None, cell: Cell, calibrated: Floats, path: Path
) -> None:
    """The effects of a fitted simulator with their values; without one, the table's friction alone."""
    sliding = {s.body: s for s in dynamics_of(cell).sliding(calibrated[None])}
    fitted = []
    if simulator is not None and values is not None and std is not None:
        at = len(cell.parameters)
        for attached in simulator.effects:
            size = len(attached.effect.quantities)
            fitted.append(
                FittedEffect(attached, tuple(values[at : at + size].tolist()), tuple(std[at : at + size].tolist()))
            )
            at += size
    write_effects(fitted, sliding, path)
