"""Arms in motion: servos, friction and laws, integrated by the classical Runge-Kutta method of fourth order."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline

from compass_ros.types import Floats
from compass_ros.worlds.arms.arm import Arm
from compass_ros.worlds.arms.chain import accelerate
from compass_ros.worlds.arms.law import Law, Moment

STEP_S = 0.0005
"""Small beside the fastest motion here: a rotor on its gear, 500 rad/s. test/worlds/test_arm_motion.py halves it."""


@dataclass(frozen=True)
class Drive:
    """What E arms are told, and when."""

    told: Floats | None
    """(E, T, J) mean target of each step of `step_s` [rad], from `before_s` before the recording; None: no servos."""
    first: Floats
    """(E, J) angles that the encoders show at the beginning, at rest [rad]."""
    before_s: float
    """How long the arm moves before the recording begins."""
    seconds: float
    """How long it is recorded."""
    rate_hz: float
    """Of the frames."""
    session_s: Floats
    """(E,) when each recording began, since the first one."""
    step_s: float = STEP_S


@dataclass(frozen=True)
class Played:
    """Motion at the frames."""

    time_s: Floats
    """(F,) since the start of the recording."""
    angle: Floats
    """(E, F, J) what errorless encoders show [rad]."""
    effort: Floats
    """(E, F, J) torque of the drives [N m]."""


def play(arm: Arm, drive: Drive, laws: Sequence[Law] = ()) -> Played:
    """Let the arms move from rest. `laws` are fitted to the arm here."""
    for law in laws:
        arm = law.fitted(arm)
    step_s = drive.step_s
    every = round(1 / (drive.rate_hz * step_s))
    skipped, steps = round(drive.before_s / step_s), round((drive.before_s + drive.seconds) / step_s)
    q = np.zeros((len(drive.first), len(arm.armature)))
    q[:, arm.hinge] = q[:, arm.motor] = drive.first - arm.zero
    moment = Moment(arm, -drive.before_s, drive.session_s, q, np.zeros_like(q))
    inner = [law.begin(len(q)) for law in laws]
    frames: list[tuple[Floats, Floats]] = []
    for i in range(steps + 1):
        told = None if drive.told is None else drive.told[:, min(i, drive.told.shape[1] - 1)]
        if i >= skipped and (i - skipped) % every == 0:
            frames.append((moment.q[:, arm.hinge] + arm.zero, effort(moment, told, laws)))
        moment, inner = _step(moment, inner, told, laws, step_s)
    angle, torque = (np.stack(part, axis=1) for part in zip(*frames, strict=True))
    stamped = taken = np.arange(angle.shape[1]) / drive.rate_hz
    for law in laws:
        angle, taken = law.seen(angle), law.clock(taken)
    if not np.array_equal(stamped, taken):  # the last frames are beyond what is recorded, and may repeat
        taken = np.minimum(taken, stamped[-1])
        angle, torque = (CubicSpline(stamped, series, axis=1)(taken) for series in (angle, torque))
    return Played(stamped, angle, torque)


def effort(moment: Moment, told: Floats | None, laws: Sequence[Law]) -> Floats:
    """(E, J) torque of the drives: position servos, limited."""
    arm = moment.arm
    if told is None:
        return np.zeros((len(moment.q), len(arm.joints)))
    error = told - moment.motor_q - arm.zero
    for law in laws:
        error = law.error(moment, error)
    asked = arm.stiffness * error - arm.damper * moment.motor_v
    torque = np.clip(asked, -arm.limit, arm.limit)
    for law in laws:
        torque = law.effort(moment, torque)
    return np.asarray(torque)


def _step(
    at: Moment, inner: list[Floats], told: Floats | None, laws: Sequence[Law], h: float
) -> tuple[Moment, list[Floats]]:
    """One step of Runge and Kutta; internal states follow at the rates of each stage."""

    def rates(moment: Moment, since: float) -> Floats:
        own = [law.advance(moment, state, since) for law, state in zip(laws, inner, strict=True)]
        return _acceleration(moment, own, told, laws)

    a1 = rates(at, 0.0)
    v2 = at.v + 0.5 * h * a1
    a2 = rates(replace(at, time_s=at.time_s + 0.5 * h, q=at.q + 0.5 * h * at.v, v=v2), 0.5 * h)
    v3 = at.v + 0.5 * h * a2
    a3 = rates(replace(at, time_s=at.time_s + 0.5 * h, q=at.q + 0.5 * h * v2, v=v3), 0.5 * h)
    v4 = at.v + h * a3
    a4 = rates(replace(at, time_s=at.time_s + h, q=at.q + h * v3, v=v4), h)
    q = at.q + h / 6 * (at.v + 2 * v2 + 2 * v3 + v4)
    v = at.v + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
    middle = replace(at, q=0.5 * (at.q + q), v=(q - at.q) / h)
    inner = [law.advance(middle, state, h) for law, state in zip(laws, inner, strict=True)]
    return replace(at, time_s=at.time_s + h, q=q, v=v), inner


def _acceleration(moment: Moment, inner: Sequence[Floats], told: Floats | None, laws: Sequence[Law]) -> Floats:
    arm = moment.arm
    torque = effort(moment, told, laws)
    force = moment.on_motors(torque) - arm.damping * moment.v
    dry = np.empty_like(force)
    dry[:] = arm.dry
    bounds = (-dry, dry)
    for law, state in zip(laws, inner, strict=True):
        force = force + law.force(moment, state, torque)
        bounds = law.bounds(moment, torque, bounds)
    own = (arm.soft, arm.back, arm.armature, *arm.chain, arm.gravity)
    return accelerate(moment.q, moment.v, force, *bounds, *own)
