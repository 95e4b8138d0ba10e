"""Other choices of MuJoCo's numerics, none of which should change what a scene says."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import mujoco

from compass_ros.simulation.simulator import Simulator


def other_numerics(simulator: Simulator) -> Iterator[tuple[str, Mapping[str, float]]]:
    """What changes, in words, and the options of a `Simulator` that has it: friction cone, solver."""
    option = simulator.options
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
