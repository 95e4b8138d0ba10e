"""Classic identification where torques were measured: least squares of inverse dynamics, from filtered positions.

    tau = Y(q, q', q'') pi + F_c sign(q') + F_v q' + I_a q'' + offset

is linear in mass, first moments and second moments of each link (pi), and in Coulomb friction, viscous friction,
armature and offset of each joint (Atkeson, An and Hollerbach 1986; Gautier 1997). Positions go through a Butterworth
filter forwards and backwards and are differentiated; torques go through the same filter. What the torques do not tell
stays as the scene has it: the solution of least norm in parts of the scene's own numbers, singular values below RANK
of the largest left out. Servos, where the scene has some: torque against the error of tracking and the speed, with the
delay that fits best.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import mujoco
import numpy as np
from scipy.signal import butter, filtfilt

from compass_ros.cells import Cell
from compass_ros.cells.registry import dynamics_of
from compass_ros.cells.scene_source import scene_source
from compass_ros.rivals.inertias import matrix, moments_of, nearest_body, numbers, regressor, sizes
from compass_ros.types import Floats, Ints

RANK = 1e-3
"""Noise of torques and errors of accelerations are a few per cent: directions that show less are not told."""
RATE_HZ = 50.0
"""Rows that are used in a second, at most: several times what the filter leaves."""
DELAYS_S = np.arange(0.0, 0.0301, 0.001)


@dataclass(frozen=True)
class Log:
    """One recording of J joints in F frames: their positions, forces and targets."""

    time_s: Floats
    position: Floats
    effort: Floats
    target: Floats | None = None
    """(F, J) what position servos were told."""


@dataclass(frozen=True)
class Regressed:
    """What the regression says of J joints and of the B bodies that they move."""

    bodies: Ints
    second: Floats
    """(B, 4, 4) integral of (x, 1) (x, 1)^T dm in the body's frame: second moments, first moments, mass."""
    coulomb: Floats
    viscous: Floats
    armature: Floats
    offset: Floats
    """(J,) each [SI]; the offset is what the sensor says too much."""
    servo: Floats
    """(J,) stiffness of the servos, in parts of the scene's; 1 without targets."""
    delay_s: float
    told: int
    """How many directions of the parameters the torques tell."""


def regress(model: mujoco.MjModel, joints: Sequence[str], logs: Sequence[Log], cutoff_hz: float) -> Regressed:
    """Fit a scene's numbers to recordings of all its joints."""
    dofs = np.array([model.joint(name).dofadr[0] for name in joints])
    bodies = np.flatnonzero(model.body_weldid > 0)
    smooth = [_smoothed(log, cutoff_hz) for log in logs]
    q, qd, qdd, sign, tau = (np.concatenate([one[i] for one in smooth]) for i in range(5))
    of_bodies = regressor(model, bodies, dofs, q, qd, qdd)
    of_joints = _joint_columns(sign, qd, qdd)
    columns = np.concatenate([of_bodies, of_joints], axis=2)
    drawn = np.concatenate([numbers(moments_of(model, b)) for b in bodies])
    start = np.concatenate([drawn, model.dof_frictionloss[dofs], model.dof_damping[dofs], model.dof_armature[dofs]])
    start = np.concatenate([start, np.zeros(len(dofs))])
    scale = np.concatenate([*(sizes(model, b) for b in bodies), *_joint_sizes(model, dofs, tau)])
    found, told = _least_norm(columns.reshape(-1, len(start)), tau.ravel(), start, scale)
    parts = np.split(found[10 * len(bodies) :], 4)
    second = np.array([nearest_body(matrix(n)) for n in found[: 10 * len(bodies)].reshape(-1, 10)])
    servo, delay = _servos(model, joints, logs, cutoff_hz)
    damping = _servo_damping(model, joints) + parts[1]
    parts[2] -= model.opt.timestep * damping  # MuJoCo's implicit integrators add it: damping acts a step later
    coulomb, viscous, armature = (np.maximum(part, 0) for part in parts[:3])
    return Regressed(bodies, second, coulomb, viscous, armature, parts[3], servo, delay, told)


def _least_norm(columns: Floats, tau: Floats, start: Floats, scale: Floats) -> tuple[Floats, int]:
    """Parameters nearest to the start, in parts of their scale, among those that fit as well as can be told."""
    u, size, v = np.linalg.svd(columns * scale, full_matrices=False)
    kept = size > RANK * size[0]
    moved = v[kept].T @ ((u[:, kept].T @ (tau - columns @ start)) / size[kept])
    return start + scale * moved, int(kept.sum())


def _smoothed(log: Log, cutoff_hz: float) -> tuple[Floats, ...]:
    """Position, speed, acceleration, sign of the speed, force: at even times, without the ends that the filter spoils.

    The sign goes through the filter too, as it did in the force.
    """
    rate = 1 / float(np.median(np.diff(log.time_s)))
    time = np.arange(log.time_s[0], log.time_s[-1], 1 / rate)
    numerator, denominator = butter(2, cutoff_hz, fs=rate)

    def even(series: Floats) -> Floats:
        return np.stack([np.interp(time, log.time_s, column) for column in series.T], axis=1)

    def filtered(series: Floats) -> Floats:
        return np.asarray(filtfilt(numerator, denominator, series, axis=0))

    position, effort = filtered(even(log.position)), filtered(even(log.effort))
    speed = np.gradient(position, 1 / rate, axis=0)
    rest = np.gradient(speed, 1 / rate, axis=0), filtered(np.sign(speed)), effort
    spoilt = int(np.ceil(rate / cutoff_hz))
    used = slice(spoilt, len(time) - spoilt, max(round(rate / RATE_HZ), 1))
    return tuple(one[used] for one in (position, speed, *rest))


def _joint_columns(sign: Floats, qd: Floats, qdd: Floats) -> Floats:
    """(F, J, 4 J) Coulomb, viscous, armature, offset of each joint, which act on that joint alone."""
    own = np.stack([sign, qd, qdd, np.ones_like(qd)])
    return np.concatenate([one[:, :, None] * np.eye(qd.shape[1]) for one in own], axis=2)


def _servos(
    model: mujoco.MjModel, joints: Sequence[str], logs: Sequence[Log], cutoff_hz: float
) -> tuple[Floats, float]:
    """(J,) stiffness of position servos in parts of the scene's, and the delay [s] with which these fit best.

    Their damping is taken for known.
    """
    drives = [a for name in joints for a in range(model.nu) if model.actuator_trnid[a, 0] == model.joint(name).id]
    if any(log.target is None for log in logs) or len(drives) != len(joints):
        return np.ones(len(joints)), 0.0
    stiffness, damping = model.actuator_gainprm[drives, 0], -model.actuator_biasprm[drives, 2]
    gains, left = [], []
    for delay in DELAYS_S:
        parts = [_pulled(log, float(delay), cutoff_hz) for log in logs]
        error, speed, effort = (np.concatenate([part[i] for part in parts]) for i in range(3))
        error, pull = error - error.mean(axis=0), effort + damping * speed  # zeros of encoders pull for ever
        pull = pull - pull.mean(axis=0)
        gain = np.sum(error * pull, axis=0) / np.sum(error**2, axis=0)
        gains.append(gain / stiffness)
        left.append(float(np.sum(((pull - gain * error) / stiffness) ** 2)))
    alike = np.flatnonzero(np.array(left) < 1.01 * min(left))  # delays between two samples look the same
    middle = int(alike[len(alike) // 2])
    return gains[middle], float(DELAYS_S[middle])


def _servo_damping(model: mujoco.MjModel, joints: Sequence[str]) -> Floats:
    """(J,) damping [N m s/rad] by actuators of joints."""
    out = np.zeros(len(joints))
    for i, name in enumerate(joints):
        on = [a for a in range(model.nu) if model.actuator_trnid[a, 0] == model.joint(name).id]
        out[i] = -model.actuator_biasprm[on, 2].sum()
    return out


def _pulled(log: Log, delay: float, cutoff_hz: float) -> tuple[Floats, Floats, Floats]:
    """Filtered error of tracking targets that are late, speed, and force."""
    targets = np.asarray(log.target).T
    told = np.stack([_held(log.time_s - delay, log.time_s, column) for column in targets], axis=1)
    error, _, _, _, effort = _smoothed(Log(log.time_s, told - log.position, log.effort), cutoff_hz)
    return error, _smoothed(log, cutoff_hz)[1], effort


def _held(at: Floats, time: Floats, value: Floats) -> Floats:
    return np.asarray(value[np.clip(np.searchsorted(time, at + 1e-9, side="right") - 1, 0, len(value) - 1)])


def _joint_sizes(model: mujoco.MjModel, dofs: Ints, tau: Floats) -> list[Floats]:
    """What Coulomb, viscous, armature and offset may be wrong by; where the scene has none, a tenth of the torques."""
    torque = 0.1 * np.sqrt(np.mean(tau**2, axis=0))
    drawn = [model.dof_frictionloss[dofs], model.dof_damping[dofs], model.dof_armature[dofs]]
    return [*(np.where(one > 0, one, torque) for one in drawn), torque]


def values(cell: Cell, found: Regressed, joints: Sequence[str]) -> dict[str, float]:
    """What a regression says of the parameters of a cell that it knows, by name."""
    model = dynamics_of(cell).model
    of_joint = {"dof_frictionloss": found.coulomb, "dof_damping": found.viscous, "dof_armature": found.armature}
    bodies = {model.body(b).name: second for b, second in zip(found.bodies, found.second, strict=True)}
    out = {}
    for p in cell.spec.parameters:
        field, _, index = p.field.rstrip("]").partition("[")
        if field in of_joint and p.of in joints:
            out[p.name] = float(of_joint[field][joints.index(p.of)])
        elif field == "servo_gain" and p.of in joints:
            out[p.name] = p.default * float(found.servo[joints.index(p.of)])
        elif field == "body_mass" and p.of in bodies:
            out[p.name] = float(bodies[p.of][3, 3])
        elif field == "body_ipos" and p.of in bodies:
            out[p.name] = float(bodies[p.of][int(index), 3] / bodies[p.of][3, 3])
        elif field == "input_delay_s":
            out[p.name] = found.delay_s
        elif field == "input_offset":
            out[p.name] = -float(found.offset[int(index or 0)])
    return out


def as_cell(cell: Cell, found: Regressed, joints: Sequence[str], folder: Path) -> Cell:
    """The cell with the numbers of a regression in its scene, written into a folder.

    Its parameters are those that no scene holds (of inputs, and zeros of encoders), by default as found.
    """
    source = scene_source(cell.model_path).spec
    write(source, dynamics_of(cell).model, joints, found)
    source.compile()
    path = folder / "regressed.xml"
    path.write_text(source.to_xml())
    known = values(cell, found, joints)
    outside = [p for p in cell.spec.parameters if p.field.startswith("input_") or p.field == "joint_zero"]
    kept = tuple(replace(p, default=float(np.clip(known.get(p.name, p.default), *p.bounds))) for p in outside)
    spec = replace(cell.spec, model=str(path.resolve()), parameters=kept)
    return Cell(spec, cell.path, f"{cell.hash}/regressed")


def write(spec: mujoco.MjSpec, model: mujoco.MjModel, joints: Sequence[str], found: Regressed) -> None:
    """Put a regression's numbers into a scene's document."""
    for body, second in zip(found.bodies, found.second, strict=True):
        mass, centre = second[3, 3], second[:3, 3] / second[3, 3]
        about = second[:3, :3] - mass * np.outer(centre, centre)
        along, turn = np.linalg.eigh(about)
        turn[:, 2] *= np.linalg.det(turn)  # a rotation
        along = np.maximum(along, max(1e-3 * along.max(), 1e-9))  # XML rounds, and MuJoCo asks for a real body
        one = spec.body(model.body(body).name)
        quat = np.zeros(4)
        mujoco.mju_mat2Quat(quat, turn.ravel())
        one.explicitinertial, one.fullinertia = True, np.full(6, np.nan)
        one.mass, one.ipos, one.inertia, one.iquat = mass, centre, along.sum() - along, quat
    for i, name in enumerate(joints):
        joint = spec.joint(name)
        joint.frictionloss, joint.armature = found.coulomb[i], found.armature[i]
        joint.damping[0] = found.viscous[i]
        for drive in (a for a in spec.actuators if a.target == name):
            drive.gainprm[0] *= found.servo[i]
            drive.biasprm[1] *= found.servo[i]
