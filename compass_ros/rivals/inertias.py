"""Forces on joints as linear functions of the inertias of links, by MuJoCo's own inverse dynamics.

Ten numbers are a body's: the integral of (x, 1) (x, 1)^T dm in its frame, upper triangle by rows: second moments, first
moments and mass. All that is linear in them is known from ten point masses.
"""

from __future__ import annotations

import mujoco
import numpy as np

from compass_ros.types import Floats, Ints

_POINTS = np.array(
    [[0, 0, 0], [1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1], [1, 1, 0], [1, 0, 1], [0, 1, 1]]
)
"""Ten points of which masses make up any rigid body [m]: its numbers are linear in the masses there."""
_UPPER = np.triu_indices(4)


def regressor(model: mujoco.MjModel, bodies: Ints, dofs: Ints, q: Floats, qd: Floats, qdd: Floats) -> Floats:
    """(F, J, 10 B) force on each joint of one unit of each number of each body, by MuJoCo's inverse dynamics."""
    bare = mujoco.MjModel.__copy__(model)
    bare.opt.disableflags |= int(
        mujoco.mjtDisableBit.mjDSBL_CONSTRAINT | mujoco.mjtDisableBit.mjDSBL_SPRING | mujoco.mjtDisableBit.mjDSBL_DAMPER
    )
    bare.body_sameframe[:] = 0
    bare.body_mass[:], bare.body_inertia[:], bare.body_gravcomp[:] = 0, 0, 0
    bare.dof_armature[:] = 1  # so that inertia matrices have an inverse; taken off again
    data, places = mujoco.MjData(bare), np.array([bare.dof_jntid[d] for d in dofs])
    at = bare.jnt_qposadr[places]
    out = np.zeros((len(q), len(dofs), len(bodies), len(_POINTS)))
    for b, body in enumerate(bodies):
        bare.body_mass[body], bare.body_iquat[body] = 1, (1, 0, 0, 0)
        for p, point in enumerate(_POINTS):
            bare.body_ipos[body] = point
            for f in range(len(q)):
                data.qpos[at], data.qvel[dofs], data.qacc[dofs] = q[f], qd[f], qdd[f]
                mujoco.mj_inverse(bare, data)
                out[f, :, b, p] = data.qfrc_inverse[dofs] - qdd[f]
        bare.body_mass[body] = 0
    of_points = np.array([numbers(_of_point(point)) for point in _POINTS]).T
    return np.asarray((out @ np.linalg.inv(of_points)).reshape(*out.shape[:2], -1))


def moments_of(model: mujoco.MjModel, body: int) -> Floats:
    """(4, 4) of a body as the scene has it."""
    mass, centre, inertia = model.body_mass[body], model.body_ipos[body], model.body_inertia[body]
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, model.body_iquat[body])
    frame = turn.reshape(3, 3)
    out = np.zeros((4, 4))
    out[:3, :3] = frame @ np.diag(0.5 * inertia.sum() - inertia) @ frame.T + mass * np.outer(centre, centre)
    out[:3, 3] = out[3, :3] = mass * centre
    out[3, 3] = mass
    return out


def numbers(second: Floats) -> Floats:
    """(10,) of a symmetric (4, 4) matrix."""
    return np.asarray(second[_UPPER])


def matrix(numbers: Floats) -> Floats:
    out = np.zeros((4, 4))
    out[_UPPER] = numbers
    return np.asarray(out + np.triu(out, 1).T)


def nearest_body(second: Floats) -> Floats:
    """The nearest real body: no mass and no second moment is negative (Wensing et al., IEEE RA-L 3(1), 2018)."""
    size, axes = np.linalg.eigh(second)
    return np.asarray((axes * np.maximum(size, 1e-9)) @ axes.T)


def sizes(model: mujoco.MjModel, body: int) -> Floats:
    """(10,) what each number may be wrong by, one for all: mass times a length that the body has, to the power."""
    second = moments_of(model, body)
    mass = max(second[3, 3], 1e-6)
    length = float(np.sqrt(max(np.trace(second[:3, :3]) / mass, 1e-6)))
    reach = np.append(np.full(3, length), 1.0)
    return np.asarray(mass * np.outer(reach, reach)[_UPPER])


def _of_point(point: Floats) -> Floats:
    whole = np.append(point, 1.0)
    return np.outer(whole, whole)
