"""Which fields of a scene can be tuned, and how far each may be from what the scene says.

Rules are grouped by what people know: sizes and places come from a drawing (half a millimetre, two mrad), masses
from a datasheet (10 %), contact and friction numbers from nowhere (20 %). Scales of joints follow from the inertia that
they move, so that a rule means the same for a finger and for a shoulder. Fields that cannot act are left out: contact
numbers of geoms that touch nothing, frames of bodies that cannot turn, the wind without air.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

_GEOM, _JOINT = mujoco.mjtGeom, mujoco.mjtJoint
_SIZES = {
    int(_GEOM.mjGEOM_SPHERE): ("radius",),
    int(_GEOM.mjGEOM_CAPSULE): ("radius", "half_length"),
    int(_GEOM.mjGEOM_CYLINDER): ("radius", "half_length"),
    int(_GEOM.mjGEOM_BOX): ("half_x", "half_y", "half_z"),
    int(_GEOM.mjGEOM_ELLIPSOID): ("radius_x", "radius_y", "radius_z"),
}
_SOLIMP = (("impedance", 0.02, 0.2), ("impedance_full", 0.01, 0.04), ("impedance_width", 0.0, 0.0),
           ("impedance_middle", 0.02, 0.2), ("impedance_power", 0.1, 1.0))  # fmt: skip
"""Name, half width and reach of each number of solimp; the width is relative."""
_FLUID = ("fluid", "drag_blunt", "drag_slender", "drag_angular", "lift_kutta", "lift_magnus")


@dataclass(frozen=True)
class Candidate:
    """A field that could be a parameter."""

    name: str
    """object@type@field"""
    field: str
    of: str
    value: float
    low: float
    high: float
    half_width: float
    unit: str


def candidates(m: mujoco.MjModel) -> Iterator[Candidate]:
    """All tunable fields of a scene: options, bodies, geoms, contact pairs, joints, actuators, in this order."""
    yield from _options(m)
    for body in range(1, m.nbody):
        if m.body(body).name:
            yield from _body(m, body)
    paired = {int(g) for g in np.concatenate([m.pair_geom1, m.pair_geom2])}
    for geom in range(m.ngeom):
        touches = geom in paired or m.geom_contype[geom] or m.geom_conaffinity[geom]
        if touches and m.geom(geom).name:
            yield from _geom(m, geom, own_contact=bool(m.geom_contype[geom] or m.geom_conaffinity[geom]))
    for pair in range(m.npair):
        yield from _pair(m, pair)
    for joint in range(m.njnt):
        if m.joint(joint).name:
            yield from _joint(m, joint)
    for actuator in range(m.nu):
        if m.actuator(actuator).name:
            yield from _actuator(m, actuator)


def _options(m: mujoco.MjModel) -> Iterator[Candidate]:
    for axis, name in enumerate("xyz"):
        value = float(m.opt.gravity[axis])
        reach, width = (0.05, 0.005) if abs(value) > 1 else (0.2, 0.01)
        yield _around(f"env@dyna@gravity_{name}", f"opt.gravity[{axis}]", "", value, reach, width, "m/s^2")
    if m.opt.density > 0 or m.opt.viscosity > 0:
        yield _times("env@dyna@air_density", "opt.density", "", float(m.opt.density), 0.2, 0.02, "kg/m^3")
        yield _times("env@dyna@air_viscosity", "opt.viscosity", "", float(m.opt.viscosity), 0.2, 0.02, "Pa s")
        for axis, name in enumerate("xyz"):
            value = float(m.opt.wind[axis])
            yield _around(f"env@dyna@wind_{name}", f"opt.wind[{axis}]", "", value, 0.3, 0.03, "m/s")


def _body(m: mujoco.MjModel, body: int) -> Iterator[Candidate]:
    name, mass = m.body(body).name, float(m.body_mass[body])
    if m.body_weldid[body] and mass > 1e-6:
        yield _times(f"{name}@dyna@mass", "body_mass", name, mass, 0.5, 0.1, "kg")
    if _turns(m, body) and mass > 1e-6:
        size = float(np.sqrt(2.5 * m.body_inertia[body].max() / mass))
        simple = bool(m.body_simple[body])  # MuJoCo has compiled its inertia as diagonal
        for i, axis in enumerate("xyz"):
            inertia, centre = float(m.body_inertia[body, i]), float(m.body_ipos[body, i])
            yield _times(f"{name}@dyna@inertia_{axis}", f"body_inertia[{i}]", name, inertia, 0.2, 0.05, "kg m^2")
            if not simple:
                where = f"{name}@dyna@centre_{axis}"
                yield _around(where, f"body_ipos[{i}]", name, centre, 0.2 * size, 0.02 * size, "m")
    if not _free(m, body):
        for i, axis in enumerate("xyz"):
            place = float(m.body_pos[body, i])
            yield _around(f"{name}@pose@{axis}", f"body_pos[{i}]", name, place, 0.005, 0.0005, "m")
        for i, axis in enumerate(("roll", "pitch", "yaw")):
            yield _around(f"{name}@pose@{axis}", f"body_turn[{i}]", name, 0.0, 0.02, 0.002, "rad")


def _geom(m: mujoco.MjModel, geom: int, own_contact: bool) -> Iterator[Candidate]:
    name, kind = m.geom(geom).name, int(m.geom_type[geom])
    for i, side in enumerate(_SIZES.get(kind, ())):
        yield _times(f"{name}@shape@{side}", f"geom_size[{i}]", name, float(m.geom_size[geom, i]), 0.05, 0.005, "m")
    for i, axis in enumerate("xyz"):
        place = float(m.geom_pos[geom, i])
        yield _around(f"{name}@shape@{axis}", f"geom_pos[{i}]", name, place, 0.005, 0.0005, "m")
    if kind != _GEOM.mjGEOM_SPHERE:
        for i, axis in enumerate(("roll", "pitch", "yaw")):
            yield _around(f"{name}@shape@{axis}", f"geom_turn[{i}]", name, 0.0, 0.02, 0.002, "rad")
    if own_contact:
        condim = int(m.geom_condim[geom])
        for i, word in enumerate(("sliding", "torsional", "rolling")[: {1: 0, 3: 1, 4: 2, 6: 3}[condim]]):
            value = float(m.geom_friction[geom, i])
            yield _times(
                f"{name}@dyna@friction_{word}", f"geom_friction[{i}]", name, value, 0.8, 0.2, "1" if i == 0 else "m"
            )
        yield from _contact(name, "geom", name, m.geom_solref[geom], m.geom_solimp[geom])
    if m.geom_fluid[geom, 0] > 0:
        for i, word in list(enumerate(_FLUID))[1:]:
            yield _times(f"{name}@dyna@{word}", f"geom_fluid[{i}]", name, float(m.geom_fluid[geom, i]), 0.5, 0.05, "1")


def _pair(m: mujoco.MjModel, pair: int) -> Iterator[Candidate]:
    first, second = (m.geom(int(g[pair])).name for g in (m.pair_geom1, m.pair_geom2))
    of = m.pair(pair).name or f"{first}+{second}"
    words = {1: (), 3: ("sliding_1", "sliding_2")}.get(
        int(m.pair_dim[pair]), ("sliding_1", "sliding_2", "torsional", "rolling_1", "rolling_2")
    )
    for i, word in enumerate(words):
        value = float(m.pair_friction[pair, i])
        yield _times(f"{of}@dyna@friction_{word}", f"pair_friction[{i}]", of, value, 0.8, 0.2, "1" if i < 2 else "m")
    yield from _contact(of, "pair", of, m.pair_solref[pair], m.pair_solimp[pair])
    margin = float(m.pair_margin[pair])
    yield Candidate(f"{of}@dyna@margin", "pair_margin", of, margin, 0.0, margin + 0.002, 0.0001, "m")


def _contact(name: str, kind: str, of: str, solref: Any, solimp: Any) -> Iterator[Candidate]:
    direct = solref[0] < 0
    words = (("stiffness", "1/s^2"), ("damping", "1/s")) if direct else (("time_constant", "s"), ("damping_ratio", "1"))
    for i, (word, unit) in enumerate(words):
        yield _times(f"{name}@dyna@{word}", f"{kind}_solref[{i}]", of, float(solref[i]), 0.8, 0.2, unit)
    for i, (word, width, reach) in enumerate(_SOLIMP):
        field, value = f"{kind}_solimp[{i}]", float(solimp[i])
        if word == "impedance_width":
            yield _times(f"{name}@dyna@{word}", field, of, value, 0.5, 0.1, "m")
            continue
        low, high = (1.0, 10.0) if word == "impedance_power" else (0.0001, 0.9999)
        reached = max(low, value - reach), min(high, value + reach)
        yield Candidate(f"{name}@dyna@{word}", field, of, value, *reached, width, "1")


def _joint(m: mujoco.MjModel, joint: int) -> Iterator[Candidate]:
    name, kind = m.joint(joint).name, int(m.jnt_type[joint])
    slide = kind == _JOINT.mjJNT_SLIDE
    dofs = {int(_JOINT.mjJNT_FREE): 6, int(_JOINT.mjJNT_BALL): 3}.get(kind, 1)
    for i in range(dofs):
        dof = int(m.jnt_dofadr[joint]) + i
        inertia = float(m.dof_M0[dof])
        linear = slide or (dofs == 6 and i < 3)
        index, word = (f"[{i}]", f"_{i}") if dofs > 1 else ("", "")
        rows = (
            (
                "joint_damping",
                "dof_damping",
                float(m.dof_damping[dof]),
                0.05 * inertia,
                "N s/m" if linear else "N m s/rad",
            ),
            ("armature", "dof_armature", float(m.dof_armature[dof]), 0.02 * inertia, "kg" if linear else "kg m^2"),
            (
                "frictionloss",
                "dof_frictionloss",
                float(m.dof_frictionloss[dof]),
                0.02 * inertia,
                "N" if linear else "N m",
            ),
        )
        for what, field, value, scale, unit in rows:
            width = max(0.2 * value, scale, 1e-9)
            yield Candidate(
                f"{name}@dyna@{what}{word}", field + index, name, value, 0.0, value + 10 * width, width, unit
            )
    if dofs == 1:
        stiffness = float(m.jnt_stiffness[joint])
        width = max(0.1 * stiffness, 0.05 * float(m.dof_M0[m.jnt_dofadr[joint]]), 1e-9)
        unit = "N/m" if slide else "N m/rad"
        yield Candidate(
            f"{name}@dyna@stiffness", "jnt_stiffness", name, stiffness, 0.0, stiffness + 10 * width, width, unit
        )
        if stiffness > 0:
            rest = float(m.qpos_spring[m.jnt_qposadr[joint]])
            yield _around(f"{name}@dyna@spring_rest", "qpos_spring", name, rest, 0.1, 0.01, "m" if slide else "rad")
        if m.jnt_limited[joint]:
            for i, side in enumerate(("low", "high")):
                at = float(m.jnt_range[joint, i])
                yield _around(
                    f"{name}@shape@limit_{side}", f"jnt_range[{i}]", name, at, 0.05, 0.005, "m" if slide else "rad"
                )


def _actuator(m: mujoco.MjModel, actuator: int) -> Iterator[Candidate]:
    name, bias = m.actuator(actuator).name, m.actuator_biasprm[actuator]
    if bias[1] or bias[2]:
        gain = float(m.actuator_gainprm[actuator, 0])
        yield _times(f"{name}@actuation@servo_gain", "servo_gain", name, gain, 0.5, 0.05, "1")
    yield _around(f"{name}@actuation@command_scale", "command_scale", name, 1.0, 0.3, 0.05, "1")
    if m.actuator_forcelimited[actuator]:
        for i, side in enumerate(("low", "high")):
            limit = float(m.actuator_forcerange[actuator, i])
            yield _times(f"{name}@actuation@force_{side}", f"actuator_forcerange[{i}]", name, limit, 0.3, 0.05, "N")


def _turns(m: mujoco.MjModel, body: int) -> bool:
    """Whether a joint between the body and the world lets it turn."""
    while body:
        joints = range(m.body_jntadr[body], m.body_jntadr[body] + m.body_jntnum[body])
        if any(m.jnt_type[j] != _JOINT.mjJNT_SLIDE for j in joints):
            return True
        body = int(m.body_parentid[body])
    return False


def _free(m: mujoco.MjModel, body: int) -> bool:
    """Whether the body goes anywhere: where the drawing puts it does not matter then."""
    return bool(m.body_jntnum[body] == 1 and m.jnt_type[m.body_jntadr[body]] == _JOINT.mjJNT_FREE)


def _around(name: str, field: str, of: str, value: float, reach: float, width: float, unit: str) -> Candidate:
    return Candidate(name, field, of, value, value - reach, value + reach, width, unit)


def _times(name: str, field: str, of: str, value: float, share: float, width: float, unit: str) -> Candidate:
    """Bounds and half width as shares of the value; a value of zero stays small."""
    size = abs(value) or 1e-6
    return Candidate(name, field, of, value, value - share * size, value + share * size, width * size, unit)
