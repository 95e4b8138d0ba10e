"""A calibrated scene with its laws as plain MJCF, as far as MJCF has words for them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np

from compass_ros.cells.rotors import PREFIX
from compass_ros.simulation.effects import Exported, FittedEffect, payload
from compass_ros.simulation.effects.attach import context_in
from compass_ros.simulation.sites import Places
from compass_ros.targets.said import Said


@dataclass(frozen=True)
class Command:
    """An actuator that acts late on scale * command + offset: parameters of a cell's input, no fields of a model."""

    actuator: str
    delay_s: float = 0.0
    scale: float = 1.0
    offset: float = 0.0
    """[unit of the command]"""


def write_plain(scene: Path, exported: Exported, commands: Sequence[Command], out: Path) -> tuple[Said, ...]:
    """Read a written scene, add what MJCF can say, write it. Files of the scene are named as `scene` names them."""
    spec = mujoco.MjSpec.from_file(str(scene))
    said = [Said(f"friction of the table under {name}", (), "left out", "compass_ros.simulation.effects.attach has it")
            for name in exported.sliding]  # fmt: skip
    for fitted in exported.effects:
        name, on = fitted.attached.effect.name, fitted.attached.objects
        write = _WRITERS.get(name)
        if write is None:
            said.append(Said(name, on, "left out", "MJCF has no word for it; attach() plays it"))
        else:
            said.append(write(spec, fitted))
    for one in commands:
        said += _told(spec, one)
    spec.compile()
    out.write_text(spec.to_xml(), encoding="utf-8")
    return tuple(said)


def numbers(fitted: FittedEffect) -> Mapping[str, float]:
    """Values by name."""
    names = (q.name for q in fitted.attached.effect.quantities)
    return dict(zip(names, fitted.values, strict=True))


def _joints(spec: mujoco.MjSpec, fitted: FittedEffect) -> list[mujoco.MjsJoint]:
    return [joint for joint in (spec.joint(name) for name in fitted.attached.objects) if joint is not None]


def _no_joint(fitted: FittedEffect) -> Said:
    what = "on a body: MJCF knows it on joints alone"
    return Said(fitted.attached.effect.name, fitted.attached.objects, "left out", what)


def _first(element: mujoco.MjsJoint | mujoco.MjsTendon, what: str) -> float:
    """Stiffness or damping: the first number of a polynomial, or the only one in an older MuJoCo."""
    return float(np.ravel(getattr(element, what))[0])


def _set_first(element: mujoco.MjsJoint | mujoco.MjsTendon, what: str, value: float) -> None:
    given = np.array(getattr(element, what), dtype=float)
    given.flat[0] = value
    setattr(element, what, given if given.ndim else float(given))


def _friction(spec: mujoco.MjSpec, fitted: FittedEffect) -> Said:
    joints = _joints(spec, fitted)
    if not joints:
        return _no_joint(fitted)
    softness, on = numbers(fitted).get("softness", 0.0), fitted.attached.objects
    for joint in joints:
        joint.frictionloss += numbers(fitted)["coefficient"]
        if softness:  # 1 / b = d_max timeconst / 2 (MuJoCo's documentation, "Computation")
            joint.solref_friction = (2 * softness / joint.solimp_friction[1], 1.0)
    if softness:
        return Said("coulomb_friction", on, "exact")
    return Said("coulomb_friction", on, "alike", "frictionloss is soft: what it holds creeps")


def _viscous(spec: mujoco.MjSpec, fitted: FittedEffect) -> Said:
    joints = _joints(spec, fitted)
    if not joints:
        return _no_joint(fitted)
    for joint in joints:
        _set_first(joint, "damping", _first(joint, "damping") + numbers(fitted)["rate"])
    return Said("viscous_drag", fitted.attached.objects, "alike", "damping is integrated implicitly")


def _spring(spec: mujoco.MjSpec, fitted: FittedEffect) -> Said:
    joints, given = _joints(spec, fitted), numbers(fitted)
    if not joints:
        return _no_joint(fitted)
    for joint in joints:
        own, added = _first(joint, "stiffness"), given["stiffness"]
        if own + added > 0:
            turns = joint.type == mujoco.mjtJoint.mjJNT_HINGE and spec.compiler.degree
            rest = math.degrees(given["rest"]) if turns else given["rest"]
            joint.springref = (own * joint.springref + added * rest) / (own + added)
        _set_first(joint, "stiffness", own + added)
    soft = given.get("softening", 0.0)
    if soft:
        return Said("spring", fitted.attached.objects, "alike", f"linear: near its rest; its softening is {soft:.3g}")
    return Said("spring", fitted.attached.objects, "exact")


def _tilt(spec: mujoco.MjSpec, fitted: FittedEffect) -> Said:
    """All bodies feel it, or MJCF cannot say it."""
    model, given = spec.compile(), numbers(fitted)
    moving = {model.body(b).name for b in range(1, model.nbody) if model.body_weldid[b]}
    gravity = np.array(spec.option.gravity, dtype=float)
    down = np.array([0.0, 0.0, -1.0])
    if moving - set(fitted.attached.objects) or not np.allclose(gravity / np.linalg.norm(gravity), down):
        why = "some bodies do not feel it, or gravity is not along z"
        return Said("gravity_tilt", fitted.attached.objects, "left out", why)
    size, x, y = float(np.linalg.norm(gravity)), given["tilt_x"], given["tilt_y"]
    angle = math.hypot(x, y)
    across = np.array([x, y, 0.0]) / angle if angle else np.zeros(3)
    spec.option.gravity = size * (math.cos(angle) * down + math.sin(angle) * across)
    return Said("gravity_tilt", fitted.attached.objects, "exact")


def _payload(spec: mujoco.MjSpec, fitted: FittedEffect) -> Said:
    given, model = numbers(fitted), spec.compile()
    for name in fitted.attached.objects:
        body, compiled = spec.body(name), model.body(name)
        mass, away = payload.lump(model, compiled.id, np.array(list(given.values())))
        load = body.add_body(name=f"{name}_payload", pos=np.array(compiled.ipos) + away)
        load.mass, load.ipos, load.inertia = mass, np.zeros(3), np.full(3, _POINT)
        load.explicitinertial = True
    return Said("payload", fitted.attached.objects, "exact")


def _gain(spec: mujoco.MjSpec, fitted: FittedEffect) -> Said:
    for name in fitted.attached.objects:
        gains = np.array(spec.actuator(name).gainprm, dtype=float)
        gains[0] *= 1 + numbers(fitted)["error"]
        spec.actuator(name).gainprm = gains
    return Said("gain_error", fitted.attached.objects, "exact", "where no limit of the command is reached")


def _lag(spec: mujoco.MjSpec, fitted: FittedEffect) -> Said:
    for name in fitted.attached.objects:
        actuator = spec.actuator(name)
        if actuator.dyntype != mujoco.mjtDyn.mjDYN_NONE:
            return Said("first_order_lag", fitted.attached.objects, "left out", f"{name} has dynamics of its own")
        actuator.dyntype, actuator.actearly = mujoco.mjtDyn.mjDYN_FILTEREXACT, True
        parameters = np.array(actuator.dynprm, dtype=float)
        parameters[0] = numbers(fitted)["time"]
        actuator.dynprm = parameters
    return Said("first_order_lag", fitted.attached.objects, "exact", "set `act` to the first command")


def _delay(spec: mujoco.MjSpec, fitted: FittedEffect) -> Said:
    for name in fitted.attached.objects:
        _set_delay(spec, spec.actuator(name), numbers(fitted)["delay"])
    return Said("actuation_delay", fitted.attached.objects, "exact", "after the first delay")


def _set_delay(spec: mujoco.MjSpec, actuator: mujoco.MjsActuator, delay_s: float) -> None:
    """MuJoCo keeps so many commands, and interpolates linearly between them."""
    actuator.delay = delay_s
    actuator.nsample = math.ceil(delay_s / spec.option.timestep) + 2
    actuator.interp = 1


def _told(spec: mujoco.MjSpec, given: Command) -> list[Said]:
    """What a cell's input does to a command, as the actuator's own."""
    actuator, said = spec.actuator(given.actuator), []
    if given.delay_s > 0:
        _set_delay(spec, actuator, given.delay_s)
        said.append(Said("delay of the command", (given.actuator,), "alike", "commands once a step, interpolated"))
    gains, bias = np.array(actuator.gainprm, dtype=float), np.array(actuator.biasprm, dtype=float)
    bias[0] += gains[0] * given.offset
    gains[0] *= given.scale
    actuator.gainprm, actuator.biasprm = gains, bias
    if given.offset:
        said.append(Said("offset of the command", (given.actuator,), "exact", _WITHIN))
    if given.scale != 1.0:
        said.append(Said("factor of the command", (given.actuator,), "exact", _WITHIN))
    return said


def _quadratic(spec: mujoco.MjSpec, fitted: FittedEffect) -> Said:
    """Damping is a polynomial of the speed: its second number is that of |v| v."""
    joints = _joints(spec, fitted)
    if not joints:
        return _no_joint(fitted)
    for joint in joints:
        damping = np.array(joint.damping, dtype=float)
        if damping.size < 2:
            return Said("quadratic_drag", fitted.attached.objects, "left out", "this MuJoCo has linear damping alone")
        damping[1] += numbers(fitted)["coefficient"]
        joint.damping = damping
    return Said("quadratic_drag", fitted.attached.objects, "alike", "damping is integrated implicitly")


def _between(spec: mujoco.MjSpec, fitted: FittedEffect) -> Said:
    """A law between a motor and its joint: what it makes of the compiled scene, which has the motor's side already."""
    model, on = spec.compile(), fitted.attached.objects
    if any(spec.joint(f"{PREFIX}{name}") is None for name in on):
        return Said(fitted.attached.effect.name, on, "left out", "the scene has no motor's side of the joint")
    places, drives = Places(model, frozenset()), model.actuator_trnid[:, 0].copy()
    efforts = model.sensor_objid.copy()
    context = context_in(places, Exported((fitted,), {}), fitted)
    if (law := fitted.attached.effect.model) is not None:
        law(model, np.array(fitted.values), context)
    for name in on:
        tendon = spec.tendon(f"{PREFIX}{name}")
        t = model.tendon(tendon.name).id
        tendon.springlength, tendon.range = model.tendon_lengthspring[t], model.tendon_range[t]
        tendon.limited, tendon.solref_limit = int(model.tendon_limited[t]), model.tendon_solref_lim[t]
        tendon.stiffness = [model.tendon_stiffness[t], *model.tendon_stiffnesspoly[t]]
        _set_first(tendon, "damping", float(model.tendon_damping[t]))
        tendon.frictionloss = float(model.tendon_frictionloss[t])
        for side in (name, f"{PREFIX}{name}"):
            joint, dof = spec.joint(side), int(model.joint(side).dofadr[0])
            joint.armature, joint.frictionloss = float(model.dof_armature[dof]), float(model.dof_frictionloss[dof])
            _set_first(joint, "damping", float(model.dof_damping[dof]))
    for a in np.flatnonzero(model.actuator_trnid[:, 0] != drives):
        spec.actuators[a].target = model.joint(int(model.actuator_trnid[a, 0])).name
    for s in np.flatnonzero(model.sensor_objid != efforts):
        spec.sensors[s].objname = model.joint(int(model.sensor_objid[s])).name
    begin = f"begin with {PREFIX}JOINT as JOINT's load has it: compass_ros.simulation.rotors.carry(model, data)"
    if soft := numbers(fitted).get("windup", 0.0):
        return Said(fitted.attached.effect.name, on, "alike", f"without its windup of {soft:.2g}; {begin}")
    return Said(fitted.attached.effect.name, on, "exact", begin)


_WITHIN = "where the command reaches no limit"
_POINT = 1e-9
"""[kg m^2] Inertia of a point mass: MuJoCo wants some."""
_WRITERS: Mapping[str, Callable[[mujoco.MjSpec, FittedEffect], Said]] = {
    "actuation_delay": _delay,
    "backlash": _between,
    "coulomb_friction": _friction,
    "first_order_lag": _lag,
    "gain_error": _gain,
    "gravity_tilt": _tilt,
    "joint_elasticity": _between,
    "payload": _payload,
    "quadratic_drag": _quadratic,
    "spring": _spring,
    "viscous_drag": _viscous,
}
