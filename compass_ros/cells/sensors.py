"""Where the numbers of a signal stand in a row of (qpos, qvel, act, sensordata), and sensors that put them there."""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np

from compass_ros.cells.fields import names, rows
from compass_ros.cells.signals import Signal
from compass_ros.errors import ConfigError, nearest
from compass_ros.types import Ints, Quantity

_STATE = mujoco.mjtState.mjSTATE_FULLPHYSICS.value
_JOINT, _OBJECT, _SENSOR = mujoco.mjtJoint, mujoco.mjtObj, mujoco.mjtSensor
_SENSORS: dict[Quantity, tuple[mujoco.mjtSensor, ...]] = {
    "xy": (_SENSOR.mjSENS_FRAMEPOS,),
    "xyz": (_SENSOR.mjSENS_FRAMEPOS,),
    "position": (_SENSOR.mjSENS_FRAMEPOS,),
    "pose": (_SENSOR.mjSENS_FRAMEPOS, _SENSOR.mjSENS_FRAMEQUAT),
    "joint_effort": (_SENSOR.mjSENS_JOINTACTFRC,),
    "wrench": (_SENSOR.mjSENS_FORCE, _SENSOR.mjSENS_TORQUE),
    "gyro": (_SENSOR.mjSENS_GYRO,),
    "accelerometer": (_SENSOR.mjSENS_ACCELEROMETER,),
}
"""Sensors whose numbers, one after the other, begin with those of the quantity. Joint positions and velocities are in
the state itself, as are positions and poses of free bodies. An effort is what the actuators exert on the joint."""
_ON: dict[Quantity, mujoco.mjtObj] = {
    "joint_effort": _OBJECT.mjOBJ_JOINT,
    "wrench": _OBJECT.mjOBJ_SITE,
    "gyro": _OBJECT.mjOBJ_SITE,
    "accelerometer": _OBJECT.mjOBJ_SITE,
}
_WORDS = {_OBJECT.mjOBJ_JOINT: "joint", _OBJECT.mjOBJ_SITE: "site", _OBJECT.mjOBJ_BODY: "body"}
_UNITS: dict[Quantity, tuple[str, ...]] = {
    "xy": ("m",) * 2,
    "xyz": ("m",) * 3,
    "position": ("m",) * 3,
    "pose": ("m",) * 3 + ("rad",) * 4,
    "wrench": ("N",) * 3 + ("N m",) * 3,
    "gyro": ("rad/s",) * 3,
    "accelerometer": ("m/s^2",) * 3,
}
_OF_JOINT: dict[Quantity, tuple[str, str]] = {
    "joint": ("rad", "m"),
    "joint_position": ("rad", "m"),
    "joint_velocity": ("rad/s", "m/s"),
    "joint_effort": ("N m", "N"),
}
"""Units on a hinge and on a slide."""


def add_sensors(spec: mujoco.MjSpec, nominal: mujoco.MjModel, signals: Sequence[Signal], where: str) -> None:
    """Add what the signals need and the state does not hold. Raises ConfigError for elements that the scene lacks."""
    for signal in signals:
        kind = _ON.get(signal.quantity, _OBJECT.mjOBJ_JOINT if signal.jointed else _OBJECT.mjOBJ_BODY)
        known = names(nominal, kind)
        for element in signal.at:
            if element not in known:
                listed = ", ".join(known) or "none with a name"
                said = f"the scene has no {_WORDS[kind]} '{element}'; it has {listed}{nearest(element, known)}"
                raise ConfigError(f"{where}: {signal.name}: {said}")
            if signal.quantity not in _SENSORS or (signal.places and _free_address(nominal, element) is not None):
                continue
            for sensor_type in _SENSORS[signal.quantity]:
                sensor = spec.add_sensor()
                sensor.name, sensor.type = _name(signal, element, sensor_type), sensor_type
                sensor.objtype = _OBJECT.mjOBJ_XBODY if kind == _OBJECT.mjOBJ_BODY else kind
                sensor.objname = element


def columns_of(model: mujoco.MjModel, signal: Signal, where: str) -> Ints:
    """(D,) where a signal's numbers stand. Raises ConfigError."""
    here = f"{where}: {signal.name}"
    if signal.quantity in ("joint", "joint_position", "joint_velocity"):
        kind = "dof" if signal.quantity == "joint_velocity" else "qpos"
        places = [_simple(model, joint, here) and rows(model, kind, joint, here)[0] for joint in signal.at]
        return np.array(places, np.int64) + (model.nq if kind == "dof" else 0)
    free = _free_address(model, signal.at[0]) if signal.places else None
    if free is not None:
        return np.arange(free, free + signal.size)
    first = mujoco.mj_stateSize(model, _STATE) - 1
    found: list[int] = []
    for element in signal.at:
        for sensor_type in _SENSORS[signal.quantity]:
            sensor = model.sensor(_name(signal, element, sensor_type))
            found += range(first + int(sensor.adr[0]), first + int(sensor.adr[0] + sensor.dim[0]))
    return np.array(found[: signal.size], np.int64)


def units_of(model: mujoco.MjModel, signal: Signal, where: str) -> tuple[str, ...]:
    """(D,) unit of each number. Raises ConfigError where hinges and slides are mixed in one signal."""
    if not signal.jointed:
        return _UNITS[signal.quantity]
    slides = [int(model.joint(joint).type[0]) == _JOINT.mjJNT_SLIDE for joint in signal.at]
    if len(set(slides)) > 1:
        raise ConfigError(f"{where}: {signal.name}: hinges and slides have different units; make two signals of them")
    return (_OF_JOINT[signal.quantity][slides[0]],) * signal.size


def _simple(model: mujoco.MjModel, joint: str, here: str) -> bool:
    """True; raises ConfigError for a joint that the scene lacks, or that has no one angle."""
    rows(model, "qpos", joint, here)
    if int(model.joint(joint).type[0]) not in (_JOINT.mjJNT_HINGE, _JOINT.mjJNT_SLIDE):
        raise ConfigError(
            f"{here}: '{joint}' is a ball or free joint, expected a hinge or slide; track its body's pose"
        )
    return True


def _free_address(model: mujoco.MjModel, body: str) -> int | None:
    identity = model.body(body).id
    first = int(model.body_jntadr[identity])
    free = model.body_jntnum[identity] == 1 and int(model.jnt_type[first]) == _JOINT.mjJNT_FREE
    return int(model.jnt_qposadr[first]) if free else None


def _name(signal: Signal, element: str, sensor_type: mujoco.mjtSensor) -> str:
    return f"compass/{signal.name}/{element}/{sensor_type.name}"
