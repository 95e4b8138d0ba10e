"""A URDF with calibrated numbers in it: inertias of its links, damping and friction of its joints."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

import mujoco
import numpy as np

from compass_ros.targets.said import Said
from compass_ros.types import Floats


def is_urdf(path: Path) -> bool:
    return path.exists() and "<robot" in path.read_text(encoding="utf-8", errors="replace")


def write_urdf(source: Path, model: mujoco.MjModel, out: Path) -> tuple[Said, ...]:
    """Write `source` with the numbers of a model that came from it; everything else stays as it is.

    A link that MuJoCo has joined to its parent has no inertia of its own any more: the parent has both.
    """
    tree = ElementTree.parse(source, ElementTree.XMLParser(target=ElementTree.TreeBuilder(insert_comments=True)))
    root = tree.getroot()
    bodies = {model.body(b).name: b for b in range(1, model.nbody)}
    joints = {model.joint(j).name: j for j in range(model.njnt)}
    said = []
    for link in root.iterfind("link"):
        name = link.get("name", "")
        if name in bodies:
            _inertial(link, model, bodies[name])
        elif (own := link.find("inertial")) is not None and name != "world" and not _is_root(root, name):
            link.remove(own)
            said.append(Said("inertia", (name,), "exact", "part of its parent's"))
    for joint in root.iterfind("joint"):
        if joint.get("name") in joints:
            said += _dynamics(joint, model, joints[joint.get("name", "")])
    root.extend(_springs(model, joints))
    ElementTree.indent(tree)
    tree.write(out, encoding="utf-8", xml_declaration=True)
    return tuple(said)


def _is_root(root: ElementTree.Element, link: str) -> bool:
    """Whether nothing carries it: MuJoCo takes it for the world."""
    return all(child.get("link") != link for child in root.iterfind("joint/child"))


def tensor(model: mujoco.MjModel, body: int) -> Floats:
    """(3, 3) inertia about the centre of mass, along the body's axes [kg m^2]."""
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, model.body_iquat[body])
    axes = turn.reshape(3, 3)
    return np.asarray(axes @ np.diag(model.body_inertia[body]) @ axes.T)


def _inertial(link: ElementTree.Element, model: mujoco.MjModel, body: int) -> None:
    own = link.find("inertial")
    if own is None:
        own = ElementTree.Element("inertial")
        link.insert(0, own)
    for child in list(own):
        own.remove(child)
    i = tensor(model, body)
    ElementTree.SubElement(own, "origin", {"xyz": " ".join(map(_exact, model.body_ipos[body])), "rpy": "0 0 0"})
    ElementTree.SubElement(own, "mass", {"value": _exact(model.body_mass[body])})
    parts = {"ixx": i[0, 0], "ixy": i[0, 1], "ixz": i[0, 2], "iyy": i[1, 1], "iyz": i[1, 2], "izz": i[2, 2]}
    ElementTree.SubElement(own, "inertia", {name: _exact(value) for name, value in parts.items()})


def _dynamics(joint: ElementTree.Element, model: mujoco.MjModel, number: int) -> list[Said]:
    dof, name = int(model.jnt_dofadr[number]), joint.get("name", "")
    own = joint.find("dynamics")
    if own is None:
        own = ElementTree.SubElement(joint, "dynamics")
    own.set("damping", _exact(model.dof_damping[dof]))
    own.set("friction", _exact(model.dof_frictionloss[dof]))
    armature = float(model.dof_armature[dof])
    why = f"{armature:.4g} kg m^2 of a rotor behind its gear: URDF has no word for it"
    return [Said("armature", (name,), "left out", why)] if armature else []


def _springs(model: mujoco.MjModel, joints: dict[str, int]) -> Iterator[ElementTree.Element]:
    """Springs as Gazebo reads them beside a URDF."""
    for name, number in joints.items():
        stiffness = float(np.atleast_1d(model.jnt_stiffness[number]).flat[0])
        if stiffness:
            of = ElementTree.Element("gazebo", {"reference": name})
            place = int(model.jnt_qposadr[number])
            ElementTree.SubElement(of, "springStiffness").text = _exact(stiffness)
            ElementTree.SubElement(of, "springReference").text = _exact(model.qpos_spring[place])
            yield of


def _exact(value: float) -> str:
    return repr(float(value))
