"""How large a law can be on a joint or a drive: from how that moved, and what moved it, in the recorded episodes.

A friction of 1 N m is everything for a hobby servo and nothing for an excavator. Bounds, steps and priors of laws on a
joint are shares of its own force and speed, so that a scene in other units or of another scale is asked the same.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from compass_ros.cells.inertia import mass_diagonal
from compass_ros.simulation.site_kinds import SPEED_DRIVES, SiteKind
from compass_ros.simulation.sites import OF_JOINT, ONE_DOF, Site
from compass_ros.types import Floats

MODEST, LARGEST = 0.02, 2.0
"""A modest law and the largest, as a share of the force that a joint saw. The prior is 20 modest ones wide (0.4), and
what is twice all other forces together would be no correction to a model but another one."""

SAMPLES = 25
"""Moments of an episode that are looked at."""
COMMAND_UNITS = ("rad/s", "m/s", "1")
"""Of what a drive is told: a speed of a hinge or a slide; else what the scene makes of it."""


@dataclass(frozen=True)
class JointSize:
    """Of one joint over recorded episodes, or of several that a law acts on alike.

    In rad and N m on hinges; m and N on slides.
    """

    kind: SiteKind
    """hinge or slide."""
    inertia: float
    """Mean of the joint's own entry of the mass matrix, in the states that it went through [kg m^2]."""
    speed: float
    """Root mean square [rad/s]."""
    fastest: float
    """[rad/s]."""
    middle: float
    """Mean position [rad]."""
    spread: float
    """Standard deviation of the position [rad]."""
    force: float
    """The largest of what inertia, gravity and actuators did, root mean square each [N m]."""
    drive: float
    """What drove it, root mean square [N m]."""

    @property
    def length_unit(self) -> str:
        return "rad" if self.kind == "hinge" else "m"

    @property
    def force_unit(self) -> str:
        return "N m" if self.kind == "hinge" else "N"

    def unit(self, of_length: str) -> str:
        """Of a force times something of lengths and seconds: `unit(" s/L")` is N m s/rad on a hinge."""
        return f"{self.force_unit}{of_length.replace('L', self.length_unit)}"


@dataclass(frozen=True)
class DriveSize:
    """Of one drive, or of several that a law acts on alike."""

    kind: SiteKind
    command: float
    """Largest that it was told, by absolute value; the norm where a command has several components."""
    unit: str
    """Of that command; one of COMMAND_UNITS."""
    force: float = 1.0
    """Largest that one of its actuators exerted, by absolute value, in the actuator's unit."""
    seconds: float = 1.0
    """How long it was told something."""
    speed: float = 1.0
    """Fastest that one of its actuators moved, by absolute value, in the actuator's unit."""


def joint_sizes(
    model: mujoco.MjModel,
    joints: Mapping[str, Site],
    states: Floats,
    driven: tuple[Floats | None, int],
    noises: Mapping[str, float],
) -> dict[str, JointSize]:
    """Of joints in (E, T, s) full states of episodes.

    A joint that stands still is taken to move by its noise in a quarter of an episode: slower is not seen.

    Args:
        driven: (E, T, n) what drives MuJoCo, and the mjtState bits that say what its rows are.
        noises: Of the position of each joint [rad, m].
    """
    data = mujoco.MjData(model)
    rows = [_moment(model, data) for _ in moments(model, data, states, driven)]
    inertia, position, speed, gravity, drive = np.stack(rows, axis=1)  # (M, nv) each
    seconds = states.shape[1] * float(model.opt.timestep)
    out = {}
    for name, site in joints.items():
        dof = int(model.jnt_dofadr[model.joint(name).id])
        noise = noises[name]
        own, there, v = float(inertia[:, dof].mean()), position[:, dof], speed[:, dof]
        spread = float(np.hypot(there.std(), noise))
        typical = float(np.hypot(_rms(v), 4 * noise / seconds))
        driving = _rms(drive[:, dof])
        force = max(own * typical**2 / spread, _rms(gravity[:, dof]), driving)
        fastest = max(float(np.abs(v).max()), typical)
        out[name] = JointSize(site.kind, own, typical, fastest, float(there.mean()), spread, force, driving)
    return out


def actuators_most(model: mujoco.MjModel, states: Floats, driven: tuple[Floats | None, int]) -> Floats:
    """(2, nu) the largest force and speed of each actuator, by absolute value, in the moments of `joint_sizes`."""
    data = mujoco.MjData(model)
    rows = [np.stack([data.actuator_force, data.actuator_velocity]) for _ in moments(model, data, states, driven)]
    return np.asarray(np.abs(rows).max(axis=0))


def moments(
    model: mujoco.MjModel, data: mujoco.MjData, states: Floats, driven: tuple[Floats | None, int]
) -> Iterator[None]:
    """Brings `data` into SAMPLES moments of each episode, one after the other."""
    controls, parts = driven
    at = np.unique(np.linspace(0, states.shape[1] - 1, SAMPLES).astype(int))
    for episode in range(len(states)):
        for t in at:
            mujoco.mj_setState(model, data, states[episode, t], mujoco.mjtState.mjSTATE_FULLPHYSICS)
            if controls is not None:
                mujoco.mj_setState(model, data, controls[episode, t], parts)
            mujoco.mj_forward(model, data)
            yield


def _moment(model: mujoco.MjModel, data: mujoco.MjData) -> Floats:
    """(5, nv) own inertia, position, speed, force of gravity and of what drives each degree of freedom."""
    position = np.zeros(model.nv)
    for joint in range(model.njnt):
        if model.jnt_type[joint] in ONE_DOF:
            position[model.jnt_dofadr[joint]] = data.qpos[model.jnt_qposadr[joint]]
    return np.stack(
        [
            mass_diagonal(model, data),
            position,
            data.qvel,
            data.qfrc_bias,
            data.qfrc_actuator + data.qfrc_applied,
        ]
    )


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2)))


def command_unit(model: mujoco.MjModel, drive: Site) -> str:
    """Of what a drive is told, one of COMMAND_UNITS."""
    actuator = drive.actuators[0]
    if drive.kind not in SPEED_DRIVES or model.actuator_trntype[actuator] not in OF_JOINT:
        return "1"
    hinge = model.jnt_type[model.actuator_trnid[actuator, 0]] == mujoco.mjtJoint.mjJNT_HINGE
    return "rad/s" if hinge else "m/s"


def unit_joint(kind: SiteKind) -> JointSize:
    """A joint whose every number is one: for the names and units of quantities."""
    return JointSize(kind, *7 * [1.0])


def alike(sizes: Sequence[JointSize]) -> JointSize:
    """Of several joints of one kind: geometric means, and the ends of all ranges."""
    rows = np.array([(s.inertia, s.speed, s.fastest, s.force) for s in sizes])
    drive = max(s.drive for s in sizes)
    inertia, speed, fastest, force = np.exp(np.mean(np.log(rows), axis=0)).tolist()
    middle = float(np.mean([s.middle for s in sizes]))
    spread = float(np.max([abs(s.middle - middle) + s.spread for s in sizes]))
    return JointSize(sizes[0].kind, inertia, speed, fastest, middle, spread, force, drive)
