"""MuJoCo's numerics: other choices of them, none of which should change what a scene says."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence

import mujoco
import numpy as np

from compass_ros.cells import Cell
from compass_ros.cells.far import far_from_scene
from compass_ros.cells.rotors import PREFIX
from compass_ros.types import Floats

HELD = 0.999
"""Impedance (`solimp`) of friction that holds: at MuJoCo's 0.9 a joint creeps 111 times as fast, (1 - d) / d."""
CONTACTS = "*"
"""All contacts, among the names of joints."""


def set_numerics(
    model: mujoco.MjModel, options: Mapping[str, float], softness: Mapping[str, float], holds: bool = False
) -> None:
    """Options into a model, and the regularisation of some joints' dry friction, or of CONTACTS, as a share of what it
    is; or dry friction that holds on all joints.

    At a share of zero friction holds: nearly rigid, and at rest within the shortest time that MuJoCo allows, two steps.
    Source: MuJoCo's documentation, Computation, R = (1 - d) / d times the inverse inertia.
    """
    for name, value in options.items():
        setattr(model.opt, name, value)
    if holds:
        hold(model, range(model.nv))
    for name, share in softness.items():
        if name == CONTACTS:
            for impedance in (model.geom_solimp[:, :2], model.pair_solimp[:, :2]):
                impedance[:] = _harder(impedance, share)
            continue
        if not share:
            hold(model, _dofs(model, name))
            continue
        for dof in _dofs(model, name):
            model.dof_solimp[dof, 0] = _harder(model.dof_solimp[dof, 0], share)


def hold(model: mujoco.MjModel, dofs: Iterable[int]) -> None:
    """Let the dry friction of some degrees of freedom hold what is at rest."""
    for dof in dofs:
        model.dof_solimp[dof, :2] = HELD
        model.dof_solref[dof] = 2 * model.opt.timestep, 1.0


def _dofs(model: mujoco.MjModel, joint: str) -> list[int]:
    """Of a joint, and of its rotor where it has one: friction may be on either."""
    ids = [mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, name) for name in (joint, f"{PREFIX}{joint}")]
    return [int(model.jnt_dofadr[i]) for i in ids if i >= 0]


def _harder(impedance: Floats, share: float) -> Floats:
    """Impedances with which the regularisation is this share of what it is."""
    within = np.clip(impedance, mujoco.mjMINIMP, mujoco.mjMAXIMP)
    return np.asarray(1 / (1 + share * (1 - within) / within))


def creeping(model: mujoco.MjModel, joints: Sequence[str]) -> tuple[str, ...]:
    """Which of these joints have dry friction by MuJoCo's soft constraint, which creeps under load."""
    return tuple(joint for joint in joints if model.dof_frictionloss[model.joint(joint).dofadr[0]] > 0)


def unlike_scene(cell: Cell) -> Iterator[str]:
    """In what a cell is not simulated as its scene says, and why: its numerics, and numbers that are far from it."""
    yield from far_from_scene(cell)
    if cell.holds:
        said = "simulated with dry friction that holds a joint at rest, which the scene should have (solreffriction, "
        yield f"{said}solimpfriction): with its own, joints creep that stand still in the recordings"
    if cell.time_step is not None:
        said = f"simulated with time steps of {1e3 * cell.time_step:g} ms, which the scene should have"
        yield f"{said}: with its own, contacts are others than in the recordings"


def other_numerics(option: mujoco.MjOption) -> Iterator[tuple[str, Mapping[str, float]]]:
    """What changes, in words, and the options of a `Simulator` that has it: friction cone, solver."""
    pyramid, cone = mujoco.mjtCone.mjCONE_PYRAMIDAL, mujoco.mjtCone.mjCONE_ELLIPTIC
    if option.cone == pyramid:
        yield "an elliptic friction cone", {"cone": int(cone)}
    else:
        yield "a pyramidal friction cone", {"cone": int(pyramid)}
    newton, gradient = mujoco.mjtSolver.mjSOL_NEWTON, mujoco.mjtSolver.mjSOL_CG
    if option.solver == newton:
        yield "the conjugate-gradient solver", {"solver": int(gradient)}
    else:
        yield "Newton's solver", {"solver": int(newton)}
