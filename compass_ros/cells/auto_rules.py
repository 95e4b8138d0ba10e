"""Which fields of a scene can be tuned, and how far each may be from what the scene says.

Rules are grouped by what people know: sizes and places come from a drawing (half a millimetre, two mrad), masses
from a datasheet (10 %), contact and friction numbers from nowhere (20 %). Scales of joints follow from the inertia that
they move, so that a rule means the same for a finger and for a shoulder. What cannot act whatever the other fields
say is left out: contact numbers of geoms that touch nothing, frames of bodies that cannot turn. What acts only together
with another field (friction of a contact whose dimension is 1, a geom's own numbers beside those of its pair, the wind
while there is no air) is listed: which fields matter is for the calibration to find out, not for the list.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import mujoco
import numpy as np

from compass_ros.cells.auto_drives import actuator_fields, tendon_fields
from compass_ros.cells.auto_joints import joint_fields
from compass_ros.cells.candidate import Candidate, around, times
from compass_ros.cells.made_inertias import moments

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
_AIR = (1.2, 1.8e-5)
"""Density [kg/m^3] and viscosity [Pa s] of air in a room."""
_FLUID = ("fluid", "drag_blunt", "drag_slender", "drag_angular", "lift_kutta", "lift_magnus")


def candidates(m: mujoco.MjModel) -> Iterator[Candidate]:
    """All tunable fields of a scene: options, bodies, geoms, contact pairs, joints, tendons, actuators, in order."""
    yield from _options(m)
    for body in range(1, m.nbody):
        if m.body(body).name:
            yield from _body(m, body)
    paired = {int(g) for g in np.concatenate([m.pair_geom1, m.pair_geom2])}
    for geom in range(m.ngeom):
        touches = geom in paired or m.geom_contype[geom] or m.geom_conaffinity[geom]
        if touches and m.geom(geom).name:
            yield from _geom(m, geom)
    for pair in range(m.npair):
        yield from _pair(m, pair)
    for joint in range(m.njnt):
        if m.joint(joint).name:
            yield from joint_fields(m, joint)
    for tendon in range(m.ntendon):
        if m.tendon(tendon).name:
            yield from tendon_fields(m, tendon)
    for actuator in range(m.nu):
        if m.actuator(actuator).name:
            yield from actuator_fields(m, actuator)


def _options(m: mujoco.MjModel) -> Iterator[Candidate]:
    for axis, name in enumerate("xyz"):
        value = float(m.opt.gravity[axis])
        reach, width = (0.05, 0.005) if abs(value) > 1 else (0.2, 0.01)
        yield around(f"env@dyna@gravity_{name}", f"opt.gravity[{axis}]", "", value, reach, width, "m/s^2")
    for name, air, unit in (("density", _AIR[0], "kg/m^3"), ("viscosity", _AIR[1], "Pa s")):
        value = float(getattr(m.opt, name))
        if value > 0:
            yield times(f"env@dyna@air_{name}", f"opt.{name}", "", value, 0.2, 0.02, unit)
        else:  # a scene without air: there may be some
            yield Candidate(f"env@dyna@air_{name}", f"opt.{name}", "", 0.0, 0.0, 2 * air, 0.1 * air, unit)
    for axis, name in enumerate("xyz"):
        value = float(m.opt.wind[axis])
        yield around(f"env@dyna@wind_{name}", f"opt.wind[{axis}]", "", value, 0.3, 0.03, "m/s")


def _body(m: mujoco.MjModel, body: int) -> Iterator[Candidate]:
    name, mass = m.body(body).name, float(m.body_mass[body])
    if m.body_weldid[body] and mass > 1e-6:
        yield times(f"{name}@dyna@mass", "body_mass", name, mass, 0.5, 0.1, "kg")
    if _turns(m, body) and mass > 1e-6:
        size = float(np.sqrt(2.5 * m.body_inertia[body].max() / mass))
        simple = bool(m.body_simple[body])  # MuJoCo has compiled its inertia as diagonal
        for i, axis in enumerate("xyz"):
            moment, centre = float(moments(m.body_inertia[body])[i]), float(m.body_ipos[body, i])
            yield _moment(f"{name}@dyna@moment_{axis}", f"body_moment[{i}]", name, moment, m.body_inertia[body].max())
            if not simple:
                where = f"{name}@dyna@centre_{axis}"
                yield around(where, f"body_ipos[{i}]", name, centre, 0.2 * size, 0.02 * size, "m")
                yield around(f"{name}@dyna@inertia_turn_{axis}", f"inertia_turn[{i}]", name, 0.0, 0.2, 0.02, "rad")
    if not _free(m, body):
        for i, axis in enumerate("xyz"):
            place = float(m.body_pos[body, i])
            yield around(f"{name}@pose@{axis}", f"body_pos[{i}]", name, place, 0.005, 0.0005, "m")
        for i, axis in enumerate(("roll", "pitch", "yaw")):
            yield around(f"{name}@pose@{axis}", f"body_turn[{i}]", name, 0.0, 0.02, 0.002, "rad")


def _moment(name: str, field: str, of: str, value: float, largest: float) -> Candidate:
    """As far as an inertia is uncertain; none of a real body is negative, that of a flat one is zero."""
    width = max(0.05 * value, 0.005 * largest)
    return Candidate(name, field, of, value, max(value - 4 * width, 0.2 * value), value + 4 * width, width, "kg m^2")


def _geom(m: mujoco.MjModel, geom: int) -> Iterator[Candidate]:
    name, kind = m.geom(geom).name, int(m.geom_type[geom])
    for i, side in enumerate(_SIZES.get(kind, ())):
        yield times(f"{name}@shape@{side}", f"geom_size[{i}]", name, float(m.geom_size[geom, i]), 0.05, 0.005, "m")
    for i, axis in enumerate("xyz"):
        place = float(m.geom_pos[geom, i])
        yield around(f"{name}@shape@{axis}", f"geom_pos[{i}]", name, place, 0.005, 0.0005, "m")
    if kind != _GEOM.mjGEOM_SPHERE:
        for i, axis in enumerate(("roll", "pitch", "yaw")):
            yield around(f"{name}@shape@{axis}", f"geom_turn[{i}]", name, 0.0, 0.02, 0.002, "rad")
    for i, word in enumerate(("sliding", "torsional", "rolling")):
        friction = float(m.geom_friction[geom, i])
        unit = "1" if i == 0 else "m"
        yield _friction(f"{name}@dyna@friction_{word}", f"geom_friction[{i}]", name, friction, unit)
    yield from _contact(name, "geom", name, m.geom_solref[geom], m.geom_solimp[geom])
    yield from _distances(m, "geom", geom, name)
    weight = float(m.geom_solmix[geom])
    yield times(f"{name}@dyna@mixing_weight", "geom_solmix", name, weight, 0.8, 0.2, "1")
    if m.geom_fluid[geom, 0] > 0:
        for i, word in list(enumerate(_FLUID))[1:]:
            yield times(f"{name}@dyna@{word}", f"geom_fluid[{i}]", name, float(m.geom_fluid[geom, i]), 0.5, 0.05, "1")


def _friction(name: str, field: str, of: str, value: float, unit: str) -> Candidate:
    """Nowhere below zero, also where the scene has none."""
    found = times(name, field, of, value, 0.8, 0.2, unit)
    return replace(found, low=max(found.low, 0.0))


def _pair(m: mujoco.MjModel, pair: int) -> Iterator[Candidate]:
    first, second = (m.geom(int(g[pair])).name for g in (m.pair_geom1, m.pair_geom2))
    of = m.pair(pair).name or f"{first}+{second}"
    for i, word in enumerate(("sliding_1", "sliding_2", "torsional", "rolling_1", "rolling_2")):
        value = float(m.pair_friction[pair, i])
        yield _friction(f"{of}@dyna@friction_{word}", f"pair_friction[{i}]", of, value, "1" if i < 2 else "m")
    yield from _contact(of, "pair", of, m.pair_solref[pair], m.pair_solimp[pair])
    yield from _distances(m, "pair", pair, of)


def _distances(m: mujoco.MjModel, kind: str, row: int, of: str) -> Iterator[Candidate]:
    """From where on a contact is counted, and how much of that is left without force."""
    for what in ("margin", "gap"):
        value = float(getattr(m, f"{kind}_{what}")[row])
        yield Candidate(f"{of}@dyna@{what}", f"{kind}_{what}", of, value, 0.0, value + 0.002, 0.0001, "m")


def _contact(name: str, kind: str, of: str, solref: Any, solimp: Any) -> Iterator[Candidate]:
    direct = solref[0] < 0
    words = (("stiffness", "1/s^2"), ("damping", "1/s")) if direct else (("time_constant", "s"), ("damping_ratio", "1"))
    for i, (word, unit) in enumerate(words):
        yield times(f"{name}@dyna@{word}", f"{kind}_solref[{i}]", of, float(solref[i]), 0.8, 0.2, unit)
    for i, (word, width, reach) in enumerate(_SOLIMP):
        field, value = f"{kind}_solimp[{i}]", float(solimp[i])
        if word == "impedance_width":
            yield times(f"{name}@dyna@{word}", field, of, value, 0.5, 0.1, "m")
            continue
        low, high = (1.0, 10.0) if word == "impedance_power" else (0.0001, 0.9999)
        reached = max(low, value - reach), min(high, value + reach)
        yield Candidate(f"{name}@dyna@{word}", field, of, value, *reached, width, "1")


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
