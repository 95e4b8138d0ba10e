"""An arm from the text of an MJCF file: one hinge a body, one body after the other, stated inertias, position servos.

MuJoCo itself is not asked. What a drawing may not hold here (classes, includes, tendons, several hinges of a body,
angles in degrees) is refused.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import numpy as np
from scipy.spatial.transform import Rotation

from compass_ros.errors import ConfigError
from compass_ros.types import Floats
from compass_ros.worlds.arms.arm import GRAVITY, Arm, softness


@dataclass(frozen=True)
class _Link:
    body: Element
    joint: Element
    origin: Floats
    turn: Floats


def read(path: Path) -> Arm:
    """The arm of a drawing. Raises ConfigError where it holds what is not known here."""
    root = ElementTree.parse(path).getroot()
    compiler = root.find("compiler")
    if compiler is None or compiler.get("angle") != "radian" or root.find("default") is not None:
        raise ConfigError(f"{path}: expected a drawing in radians without default classes")
    links = _links(root, path)
    inertial = [_inertial(link.body, path) for link in links]
    servos = {str(s.get("joint")): s for s in root.findall("actuator/position")}
    names = tuple(str(link.joint.get("name")) for link in links)
    axis = np.array([_numbers(link.joint, "axis", "0 0 1") for link in links])
    n = len(links)
    arm = Arm(
        joints=names,
        bodies=tuple(str(link.body.get("name")) for link in links),
        origin=np.array([link.origin for link in links]),
        turn=np.array([link.turn for link in links]),
        axis=axis / np.linalg.norm(axis, axis=1, keepdims=True),
        mass=np.array([m for m, _, _ in inertial]),
        centre=np.array([c for _, c, _ in inertial]),
        inertia=np.array([i for _, _, i in inertial]),
        gravity=np.array([0.0, 0.0, -GRAVITY]),
        armature=_each([link.joint for link in links], "armature"),
        damping=_each([link.joint for link in links], "damping"),
        dry=_each([link.joint for link in links], "frictionloss"),
        soft=np.zeros(n),
        back=np.zeros(n),
        hinge=np.arange(n),
        motor=np.arange(n),
        zero=np.zeros(n),
        stiffness=np.array([float(servos[j].get("kp", 0)) if j in servos else 0.0 for j in names]),
        damper=np.array([float(servos[j].get("kv", 0)) if j in servos else 0.0 for j in names]),
        limit=np.array([_numbers(servos[j], "forcerange", "-inf inf")[1] if j in servos else np.inf for j in names]),
    )
    soft, back = softness(arm)
    return replace(arm, soft=soft, back=back)


def _links(root: Element, path: Path) -> list[_Link]:
    """Bodies with a joint, in their order; poses of those without are counted to the next."""
    found: list[_Link] = []
    origin, turn = np.zeros(3), np.eye(3)
    world = root.find("worldbody")
    here = [] if world is None else world.findall("body")
    while here:
        if len(here) > 1:
            raise ConfigError(f"{path}: expected one body after the other, found {len(here)} side by side")
        body, joints = here[0], here[0].findall("joint")
        origin, turn = (
            origin + turn @ _numbers(body, "pos", "0 0 0"),
            turn @ _rotation(_numbers(body, "quat", "1 0 0 0")),
        )
        if len(joints) > 1 or (joints and joints[0].get("pos", "0 0 0") != "0 0 0"):
            raise ConfigError(f"{path}: body {body.get('name')}: expected one hinge at its origin")
        if joints:
            found.append(_Link(body, joints[0], origin, turn))
            origin, turn = np.zeros(3), np.eye(3)
        here = body.findall("body")
    return found


def _inertial(body: Element, path: Path) -> tuple[float, Floats, Floats]:
    """Mass, centre and inertia in the body's axes."""
    stated = body.find("inertial")
    if stated is None:
        raise ConfigError(f"{path}: body {body.get('name')}: expected a stated inertia")
    turn = _rotation(_numbers(stated, "quat", "1 0 0 0"))
    inertia = turn @ np.diag(_numbers(stated, "diaginertia", "0 0 0")) @ turn.T
    return float(stated.get("mass", 0)), _numbers(stated, "pos", "0 0 0"), inertia


def _each(joints: list[Element], name: str) -> Floats:
    return np.array([float(joint.get(name, 0)) for joint in joints])


def _numbers(element: Element, name: str, default: str) -> Floats:
    return np.array([float(word) for word in element.get(name, default).split()])


def _rotation(quat: Floats) -> Floats:
    """(3, 3) of a quaternion (w, x, y, z) of any length."""
    return np.asarray(Rotation.from_quat(np.roll(quat, -1)).as_matrix())
