"""A scene with a drive on each commanded joint, for models that have none (URDF) or others than were commanded."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import mujoco

from compass_ros.cells.scene_source import scene_source
from compass_ros.errors import ConfigError


@dataclass(frozen=True)
class NewDrive:
    """A servo of a joint, called as the joint."""

    joint: str
    kind: Literal["position", "velocity"]
    stiffness: float
    """[N m/rad or N/m]; of a servo of speeds 0."""
    damping: float
    """[N m s/rad or N s/m] of a servo of speeds its gain; of positions added to the joint's own damping."""
    armature: float
    """[kg m^2 or kg] where the model says 0."""


def write_servo_scene(model: Path, drives: Sequence[NewDrive], out: Path) -> None:
    """Write the model as MJCF with these drives instead of others on the same joints. Raises ConfigError.

    Of a URDF without its drawings: masses and joints decide how an arm moves, and the hulls of its links, which in a
    URDF overlap at the joints, would push each other apart. Fixed links keep their names. Stiff servos are integrated
    implicitly.
    """
    spec = scene_source(model).spec
    if _is_urdf(model):
        for element in [*spec.geoms, *spec.meshes]:
            spec.delete(element)
        spec.compiler.fusestatic = False
        spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    else:
        for folder in ("meshdir", "texturedir"):
            inside = model.parent / str(getattr(spec.compiler, folder))
            setattr(spec.compiler, folder, os.path.relpath(inside, out.parent))
    for drive in drives:
        _add(spec, drive)
    try:
        spec.compile()
        out.write_text(spec.to_xml(), encoding="utf-8")
    except (ValueError, OSError) as error:
        raise ConfigError(f"{out}: {' '.join(str(error).split())}") from error


def _is_urdf(path: Path) -> bool:
    return "<robot" in path.read_text(encoding="utf-8", errors="replace")


def _add(spec: mujoco.MjSpec, drive: NewDrive) -> None:
    for other in [a for a in spec.actuators if drive.joint in (a.target, a.name)]:
        spec.delete(other)
    joint = spec.joint(drive.joint)
    if not joint.armature:
        joint.armature = drive.armature
    actuator = spec.add_actuator()
    actuator.name = actuator.target = drive.joint
    actuator.trntype = mujoco.mjtTrn.mjTRN_JOINT
    if drive.kind == "position":
        actuator.set_to_position(kp=drive.stiffness)
        joint.damping[0] += drive.damping
    else:
        actuator.set_to_velocity(kv=drive.damping)
