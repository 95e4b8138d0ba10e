"""What MuJoCo says of the numbers of a scene whatever a YAML says: their units, and which are never below zero."""

from __future__ import annotations

from collections.abc import Sequence

from compass_ros.cells.spec import ParameterSpec
from compass_ros.cells.units import read_unit
from compass_ros.errors import ConfigError

_DAMPING, _INERTIA, _FORCE = ("N s/m", "N m s/rad"), ("kg", "kg m^2"), ("N", "N m")
_PLACE, _STIFFNESS, _FRICTION = ("m", "rad"), ("N/m", "N m/rad"), ("1", "m")
_IMPEDANCE, _CONTACT = ("1", "m"), ("s", "1", "1/s^2", "1/s")
UNITS = {
    "body_mass": ("kg",),
    "body_inertia": ("kg m^2",),
    "body_moment": ("kg m^2",),
    "body_ipos": ("m",),
    "body_pos": ("m",),
    "body_turn": ("rad",),
    "inertia_turn": ("rad",),
    "inertia_log_cholesky": ("1", "m"),
    "geom_size": ("m",),
    "geom_pos": ("m",),
    "geom_turn": ("rad",),
    "geom_margin": ("m",),
    "geom_gap": ("m",),
    "geom_friction": _FRICTION,
    "geom_solref": _CONTACT,
    "geom_solimp": _IMPEDANCE,
    "pair_margin": ("m",),
    "pair_gap": ("m",),
    "pair_friction": _FRICTION,
    "pair_solref": _CONTACT,
    "pair_solimp": _IMPEDANCE,
    "contact_friction": _FRICTION,
    "contact_solref": _CONTACT,
    "contact_solimp": _IMPEDANCE,
    "dof_damping": _DAMPING,
    "dof_armature": _INERTIA,
    "dof_frictionloss": _FORCE,
    "jnt_stiffness": _STIFFNESS,
    "jnt_range": _PLACE,
    "jnt_pos": ("m",),
    "joint_zero": _PLACE,
    "qpos_spring": _PLACE,
    "start_qpos": (*_PLACE, "1"),
    "start_qvel": ("m/s", "rad/s"),
    "tendon_damping": _DAMPING,
    "tendon_armature": _INERTIA,
    "tendon_frictionloss": _FORCE,
    "tendon_stiffness": _STIFFNESS,
    "tendon_lengthspring": _PLACE,
    "tendon_range": _PLACE,
    "actuator_damping": _DAMPING,
    "actuator_armature": _INERTIA,
    "input_delay_s": ("s",),
    "opt.gravity": ("m/s^2",),
    "opt.wind": ("m/s",),
    "opt.density": ("kg/m^3",),
    "opt.viscosity": ("Pa s",),
}
"""By field: of slides and hinges, of lengths and angles, of MuJoCo's two ways to give a contact. What a gain, a gear or
a scale is in depends on the drive, and what a sensor's offset is in on the sensor: they are not here."""
NOT_NEGATIVE = {
    *("body_mass", "body_inertia", "body_moment", "geom_size"),
    *("geom_friction", "pair_friction", "contact_friction"),
    *("dof_damping", "dof_armature", "dof_frictionloss"),
    *("tendon_damping", "tendon_armature", "tendon_frictionloss"),
    *("actuator_damping", "actuator_armature", "opt.density", "opt.viscosity"),
}
"""Fields that MuJoCo refuses below zero, or simulates as a body that falls upwards or a friction that drives."""
_UNSAID = "1"
"""A unit that says nothing."""


def check_physical(parameters: Sequence[ParameterSpec], where: str) -> None:
    """Raises ConfigError where a parameter contradicts the field that it is."""
    for p in parameters:
        field = p.field.partition("[")[0]
        if field in NOT_NEGATIVE and p.bounds[0] < 0:
            low, high = p.bounds
            raise ConfigError(f"{where}: {p.name}: bounds [{low:g}, {high:g}]: {field} cannot be below zero")
        stated, own = read_unit(p.unit), UNITS.get(field)
        if own is None or stated is None or p.unit.strip() == _UNSAID:
            continue
        if not any(stated.same(unit) for unit in map(read_unit, own) if unit is not None):
            said = f"{field} is in {' or '.join(own)}, found '{p.unit}'"
            raise ConfigError(f"{where}: {p.name}: unit: {said}; all its numbers are to be in that unit")
