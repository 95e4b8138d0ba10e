"""The tracker's configuration as ROS parameters: `objects.puck1.hue_deg`, `fiducials.side_m`, `min_arc`, ...

Names, defaults, descriptions and ranges are those of the configuration's fields.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import fields
from typing import Any

import annotated_types
from pydantic.fields import FieldInfo
from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.node import Node
from rclpy.parameter import Parameter

from compass_ros.tracking.config import FiducialConfig, ObjectConfig, TrackerConfig, tracker_config

_NAMES = "object_names"
_GROUPS = ("objects", "fiducials")


def declare_tracker(node: Node) -> TrackerConfig:
    """Declare all parameters of the tracker. Raises ConfigError when their values do not fit together."""
    defaults = TrackerConfig()
    text = "objects to track, each with parameters objects.NAME.*; fixed while the node runs"
    described = ParameterDescriptor(description=text, read_only=True)
    for name in node.declare_parameter(_NAMES, list(defaults.objects), described).value:
        _declare_fields(node, f"objects.{name}.", defaults.objects.get(name, ObjectConfig(hue_deg=0.0)))
    _declare_fields(node, "fiducials.", defaults.fiducials)
    _declare_fields(node, "", defaults)
    return tracker_of(node)


def tracker_of(node: Node, changes: Iterable[Parameter] = ()) -> TrackerConfig:
    """The configuration from the node's parameters, with some changed. Raises ConfigError for the first bad one."""
    values = {name: parameter.value for name, parameter in node.get_parameters_by_prefix("").items()}
    values |= {change.name: change.value for change in changes}
    known = {one.name for one in fields(TrackerConfig)}
    content: dict[str, Any] = {
        "objects": {name: {} for name in node.get_parameter(_NAMES).value},
        "fiducials": {},
    }
    for path, value in values.items():
        *groups, name = path.split(".")
        if (groups or [name])[0] in known:
            place = content
            for group in groups:
                place = place[group]
            place[name] = value if isinstance(value, (str, int, float)) else list(value)
    return tracker_config(content, "parameters of puck_tracker")


def _declare_fields(node: Node, prefix: str, defaults: TrackerConfig | ObjectConfig | FiducialConfig) -> None:
    for one in fields(defaults):
        value = getattr(defaults, one.name)
        if one.name in _GROUPS:
            continue
        descriptor = _descriptor(one.default, value, one.name)
        node.declare_parameter(f"{prefix}{one.name}", list(value) if isinstance(value, tuple) else value, descriptor)


def _descriptor(declared: object, value: object, name: str) -> ParameterDescriptor:
    if not isinstance(declared, FieldInfo):
        return ParameterDescriptor(description=name)
    descriptor = ParameterDescriptor(description=declared.description or name)
    limits = _limits(declared.metadata)
    if "low" not in limits or "high" not in limits:
        return descriptor
    if isinstance(value, int):
        limit = IntegerRange(from_value=int(limits["low"]), to_value=int(limits["high"]), step=1)
        descriptor.integer_range = [limit]
    else:
        descriptor.floating_point_range = [FloatingPointRange(from_value=limits["low"], to_value=limits["high"])]
    return descriptor


def _limits(rules: Iterable[object]) -> Mapping[str, float]:
    """ROS knows closed ranges only; an open end is refused by the configuration itself."""
    limits: dict[str, Any] = {}
    for rule in rules:
        match rule:
            case annotated_types.Ge(ge=low) | annotated_types.Gt(gt=low):
                limits["low"] = low
            case annotated_types.Le(le=high) | annotated_types.Lt(lt=high):
                limits["high"] = high
    return {name: float(limit) for name, limit in limits.items()}
