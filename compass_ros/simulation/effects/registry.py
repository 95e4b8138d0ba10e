"""All effects by name."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from types import MappingProxyType

from compass_ros.errors import ConfigError, nearest
from compass_ros.simulation.effects.effect import Effect

_NAMES = (
    *("table_tilt", "viscous_drag", "quadratic_drag", "crosswind", "fan_field", "swirl", "point_attraction"),
    *("friction_patch", "friction_gradient", "anisotropic_friction", "stribeck_friction", "coulomb_friction"),
    *("magnus", "pulsating_lift", "spring"),
    *("asymmetric_friction", "load_dependent_friction", "cogging", "joint_elasticity", "backlash"),
    *("gravity_tilt", "payload", "wind", "buoyancy", "pair_attraction", "tether"),
    *("rate_dependent_restitution", "tangential_impulse", "local_wall", "off_centre_mass", "friction_cone"),
    *("adhesion", "rolling_resistance"),
    *("actuation_delay", "first_order_lag", "velocity_saturation", "dead_band", "heading_bias", "stroke_jitter"),
    *("torque_saturation", "rate_limit", "gain_error", "hysteresis"),
    *("camera_latency", "camera_scale", "camera_rotation", "lens_distortion", "rolling_shutter", "tracking_lag"),
    *("clock_drift", "latency", "scale", "offset", "rotation", "eccentricity"),
    "parameter",
)
EFFECTS: Mapping[str, Effect] = MappingProxyType(
    {name: import_module(f"compass_ros.simulation.effects.{name}").EFFECT for name in _NAMES}
)


def effect(name: str) -> Effect:
    """The effect of that name. Raises ConfigError with the nearest known one."""
    if name not in EFFECTS:
        raise ConfigError(f"unknown effect '{name}'; known: {', '.join(EFFECTS)}{nearest(name, EFFECTS)}")
    return EFFECTS[name]
