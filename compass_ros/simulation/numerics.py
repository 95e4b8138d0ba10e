"""MuJoCo's numerics: other choices of them, none of which should change what a scene says."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import mujoco

HELD = 0.999
"""Impedance (`solimp`) of friction that holds: at MuJoCo's 0.9 a joint creeps 111 times as fast, (1 - d) / d."""


def set_numerics(model: mujoco.MjModel, options: Mapping[str, float], softness: Mapping[str, float]) -> None:
    """Options into a model, and the regularisation of the dry friction of some joints, as a share of what it is.

    At a share of zero it holds: nearly rigid, and at rest within the shortest time that MuJoCo allows, two steps.
    Source: MuJoCo's documentation, Computation, R = (1 - d) / d times the inverse inertia.
    """
    for name, value in options.items():
        setattr(model.opt, name, value)
    for joint, share in softness.items():
        dof = model.joint(joint).dofadr[0]
        impedance = float(model.dof_solimp[dof, 0])
        model.dof_solimp[dof, 0] = 1 / (1 + share * (1 - impedance) / impedance) if share else HELD
        if not share:
            model.dof_solimp[dof, 1] = HELD
            model.dof_solref[dof] = 2 * model.opt.timestep, 1.0


def creeping(model: mujoco.MjModel, joints: Sequence[str]) -> tuple[str, ...]:
    """Which of these joints have dry friction by MuJoCo's soft constraint, which creeps under load."""
    return tuple(joint for joint in joints if model.dof_frictionloss[model.joint(joint).dofadr[0]] > 0)


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
