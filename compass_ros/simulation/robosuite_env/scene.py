"""A cell's scene inside robosuite's: same bodies, geoms, joints and contacts under the same names, on its table."""

from __future__ import annotations

import re
from dataclasses import dataclass

import mujoco
import numpy as np

from compass_ros.cells import Cell
from compass_ros.types import Floats, Ints

_PREFIX = "cell/"
_NAME = re.compile(f'(?<!class=)"{_PREFIX}')
"""The prefix that MuJoCo needs where scenes are joined; names go without it, classes of defaults cannot."""
GRIP = "compass_grip"
"""Equality between the arm's hand and the tool that it moves."""
_STIFF = (0.004, 1.0)
"""solref of the grip: as stiff as a time step of 1 ms allows with a margin of two."""
_ROWS = {
    "geom": ("pos", "quat", "size", "rbound", "aabb", "friction", "solref", "solimp", "margin", "gap", "solmix",
             "condim", "fluid", "sameframe"),
    "body": ("pos", "quat", "mass", "inertia", "ipos", "iquat", "sameframe"),
    "jnt": ("stiffness", "stiffnesspoly", "range", "pos", "axis"),
    "dof": ("damping", "dampingpoly", "armature", "frictionloss"),
    "pair": ("friction", "solref", "solreffriction", "solimp", "margin", "gap", "dim"),
}  # fmt: skip
"""Arrays of a model that parameters may change, by kind of element."""
_OPTIONS = ("gravity", "density", "viscosity", "wind", "cone", "impratio", "integrator")


def with_cell(xml: str, cell: Cell, height: float, hand: str) -> str:
    """robosuite's MJCF with the cell's origin at `height` [m], its servos replaced by a grip of the body `hand`."""
    spec, child = mujoco.MjSpec.from_string(xml), mujoco.MjSpec.from_file(str(cell.model_path))
    tool = tool_of(child.compile())
    for actuator in list(child.actuators):
        child.delete(actuator)
    for name in ("timestep", "integrator", "cone", "solver", "iterations", "tolerance", "density", "viscosity"):
        setattr(spec.option, name, getattr(child.option, name))
    spec.option.disableflags |= child.option.disableflags
    spec.option.impratio = child.option.impratio
    spec.attach(child, prefix=_PREFIX, frame=spec.worldbody.add_frame(pos=[0, 0, height]))
    if tool:
        grip = spec.add_equality(name=GRIP, type=mujoco.mjtEq.mjEQ_CONNECT, name1=_PREFIX + tool, name2=hand)
        grip.objtype = mujoco.mjtObj.mjOBJ_BODY
        grip.solref = _STIFF
    spec.compile()
    return _NAME.sub('"', str(spec.to_xml()))


def tool_of(scene: mujoco.MjModel) -> str:
    """Name of the body that the velocity servos of a cell move; empty where there are none."""
    if not scene.nu:
        return ""
    joint = int(scene.actuator_trnid[0, 0])
    return str(scene.body(scene.jnt_bodyid[joint]).name)


@dataclass(frozen=True)
class Servo:
    """The velocity servos of a cell's tool, one an axis: x, y (and z)."""

    gain: Floats
    """(nu,) force per difference in speed [N s/m]."""
    share: Floats
    """(nu,) speed that is held, per command."""
    mass: float
    """Of the tool and its drive [kg]."""

    def follow(self, command: Floats, push: Floats, speed: Floats, time_step: float) -> Floats:
        """(nu,) speed of the tool one implicit step later, under (nu,) commands [m/s] and forces [N]."""
        rate = time_step / self.mass
        return np.asarray((speed + rate * (self.gain * self.share * command + push)) / (1 + rate * self.gain))


def servo(scene: mujoco.MjModel, tool: str) -> Servo:
    """The servos of a cell's model as it is now."""
    if not tool:
        return Servo(np.zeros(0), np.zeros(0), 0.0)
    gain = -scene.actuator_biasprm[:, 2]
    body = scene.body(tool)
    drive = float(scene.dof_armature[int(body.dofadr[0])])
    return Servo(gain, scene.actuator_gainprm[:, 0] / gain, float(body.mass[0]) + drive)


@dataclass(frozen=True)
class Mapping:
    """Where the elements of a cell's scene are in robosuite's."""

    rows: dict[str, tuple[Ints, Ints]]
    """kind -> rows in the cell's arrays, rows in robosuite's."""
    qpos: Ints
    """(nq,) places in robosuite's qpos."""
    qvel: Ints
    """(nv,)"""
    height: Floats
    """(3,) the cell's origin in robosuite's world [m]."""
    free: Ints
    """(n,) first place in the cell's qpos of each free joint, whose positions are the world's."""

    def write(self, scene: mujoco.MjModel, model: mujoco.MjModel) -> None:
        """Copy all numbers that parameters may change, and the options, from the cell's model into robosuite's."""
        for kind, names in _ROWS.items():
            own, there = self.rows[kind]
            for name in names:
                getattr(model, f"{kind}_{name}")[there] = getattr(scene, f"{kind}_{name}")[own]
        for kind, parents in (("geom", scene.geom_bodyid), ("body", scene.body_parentid)):
            own, there = self.rows[kind]
            getattr(model, f"{kind}_pos")[there[parents[own] == 0]] += self.height
        for option in _OPTIONS:
            value = getattr(scene.opt, option)
            if isinstance(value, np.ndarray):
                getattr(model.opt, option)[:] = value
            else:
                setattr(model.opt, option, value)

    def put(self, positions: Floats, velocities: Floats, data: mujoco.MjData) -> None:
        """Write (nq,) positions and (nv,) velocities of the cell into robosuite's data."""
        data.qpos[self.qpos], data.qvel[self.qvel] = self._moved(positions, 1.0), velocities

    def get(self, data: mujoco.MjData) -> tuple[Floats, Floats]:
        """(nq,) positions and (nv,) velocities of the cell."""
        return self._moved(data.qpos[self.qpos], -1.0), data.qvel[self.qvel].copy()

    def _moved(self, positions: Floats, sign: float) -> Floats:
        moved = positions.copy()
        for first in self.free:
            moved[first : first + 3] += sign * self.height
        return moved


def mapping(scene: mujoco.MjModel, model: mujoco.MjModel, height: float) -> Mapping:
    """Match by name; contact pairs by their geoms. `height` [m]: of the cell's origin in robosuite's world."""
    bodies, joints, geoms = list(range(1, scene.nbody)), list(range(scene.njnt)), list(range(scene.ngeom))
    geom_there = {i: int(model.geom(scene.geom(i).name).id) for i in geoms}
    joint_there = {i: int(model.joint(scene.joint(i).name).id) for i in joints}
    pairs = {
        frozenset((int(a), int(b))): i for i, (a, b) in enumerate(zip(model.pair_geom1, model.pair_geom2, strict=True))
    }
    pair_there = [
        pairs[frozenset((geom_there[int(a)], geom_there[int(b)]))]
        for a, b in zip(scene.pair_geom1, scene.pair_geom2, strict=True)
    ]
    dofs, qpos = _spread(scene, model, joint_there)
    rows = {
        "body": (bodies, [int(model.body(scene.body(i).name).id) for i in bodies]),
        "geom": (geoms, [geom_there[i] for i in geoms]),
        "jnt": (joints, [joint_there[i] for i in joints]),
        "dof": (list(range(scene.nv)), dofs.tolist()),
        "pair": (list(range(scene.npair)), pair_there),
    }
    free = scene.jnt_qposadr[scene.jnt_type == mujoco.mjtJoint.mjJNT_FREE]
    arrays = {k: (np.array(a, int), np.array(b, int)) for k, (a, b) in rows.items()}
    return Mapping(arrays, qpos, dofs, np.array([0.0, 0.0, height]), free.astype(int))


def _spread(scene: mujoco.MjModel, model: mujoco.MjModel, there: dict[int, int]) -> tuple[Ints, Ints]:
    """(nv,) and (nq,) places of the cell's degrees of freedom and joint positions in robosuite's."""
    dofs, qpos = np.zeros(scene.nv, int), np.zeros(scene.nq, int)
    ends_v, ends_q = [*scene.jnt_dofadr[1:], scene.nv], [*scene.jnt_qposadr[1:], scene.nq]
    for joint, other in there.items():
        v, q = int(scene.jnt_dofadr[joint]), int(scene.jnt_qposadr[joint])
        dofs[v : ends_v[joint]] = model.jnt_dofadr[other] + np.arange(ends_v[joint] - v)
        qpos[q : ends_q[joint]] = model.jnt_qposadr[other] + np.arange(ends_q[joint] - q)
    return dofs, qpos


def contact_force(model: mujoco.MjModel, data: mujoco.MjData, geom: int) -> Floats:
    """(3,) force of all contacts on a geom [N], in the world."""
    total, wrench = np.zeros(3), np.zeros(6)
    for i in np.flatnonzero((data.contact.geom == geom).any(axis=1)):
        mujoco.mj_contactForce(model, data, i, wrench)
        sign = (
            1.0 if data.contact.geom[i, 1] == geom else -1.0
        )  # a contact's frame points from its first geom to its second
        total += sign * data.contact.frame[i].reshape(3, 3).T @ wrench[:3]
    return total


def reach(model: mujoco.MjModel, data: mujoco.MjData, site: int, joints: Ints, target: Floats) -> Floats:
    """(n,) arm positions that bring a site to (3,) `target` [m] with its orientation as it is, by damped least squares.

    `joints`: places of the arm in qpos and qvel (hinges only, one after the other from the first joint).
    """
    upright = data.site_xmat[site].copy()
    jacobian = np.zeros((6, model.nv))
    for _ in range(200):
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        error = np.zeros(6)
        error[:3] = target - data.site_xpos[site]
        error[3:] = _turn(upright, data.site_xmat[site])
        if np.abs(error).max() < 1e-6:
            break
        mujoco.mj_jacSite(model, data, jacobian[:3], jacobian[3:], site)
        own = jacobian[:, joints]
        step = own.T @ np.linalg.solve(own @ own.T + 1e-4 * np.eye(6), error)
        data.qpos[joints] += np.clip(step, -0.2, 0.2)
    return np.array(data.qpos[joints])


def _turn(wanted: Floats, found: Floats) -> Floats:
    """(3,) rotation vector from one (9,) orientation to another, for small angles."""
    a, b = wanted.reshape(3, 3), found.reshape(3, 3)
    return np.asarray(0.5 * sum(np.cross(b[:, i], a[:, i]) for i in range(3)))
