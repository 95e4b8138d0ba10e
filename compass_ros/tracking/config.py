"""Configuration of the tracker. YAML, the command line and ROS parameters fill the same frozen dataclasses.

Defaults describe the air-hockey cell under its camera; lengths in metres, hues in degrees on the colour circle
(0 red, 120 green, 240 blue).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path

from pydantic import ConfigDict, Field, TypeAdapter, ValidationError
from pydantic.dataclasses import dataclass

from compass_ros.config import read_yaml
from compass_ros.errors import ConfigError, nearest, shown

_strict = ConfigDict(extra="forbid")
_OF_THE_NODE = frozenset({"object_names", "autostart", "camera_timeout_s", "moved_m", "lost_s", "frame", "publish_tf"})
"""What a parameter file says to the node and not to the tracker."""


@dataclass(frozen=True, config=_strict)
class ObjectConfig:
    """How one round object looks from above."""

    hue_deg: float = Field(ge=0, le=360, description="hue of its colour [degrees]")
    radius_m: float = Field(default=0.0255, ge=0.005, le=0.2, description="radius of its rim [m]")
    height_m: float = Field(default=0.006, ge=0, le=0.1, description="height of its top face over the table [m]")
    hue_tolerance_deg: float = Field(default=18.0, ge=2, le=90, description="half-width of the accepted hues [degrees]")
    min_saturation: float = Field(default=0.35, ge=0.05, le=1, description="least saturation of its colour, 0 to 1")
    min_value: float = Field(default=0.12, ge=0.02, le=1, description="least brightness of its colour, 0 to 1")


@dataclass(frozen=True, config=_strict)
class FiducialConfig:
    """ArUco markers flat on the table's plane, the top of the print towards +y."""

    dictionary: str = "DICT_4X4_50"
    side_m: float = Field(default=0.06, gt=0.005, le=0.5, description="side of the black square [m]")
    ids: tuple[int, ...] = (0, 1, 2, 3)
    x_m: tuple[float, ...] = (-0.44, 0.44, 0.44, -0.44)
    """Centre of each marker of `ids` in the frame `table` [m]."""
    y_m: tuple[float, ...] = (0.31, 0.31, -0.31, -0.31)
    min_markers: int = Field(default=3, ge=2, le=50, description="markers that must be seen to place the table")
    max_residual_px: float = Field(
        default=0.6, gt=0, le=20, description="largest rms reprojection error of their corners [px]"
    )


def _air_hockey() -> dict[str, ObjectConfig]:
    return {
        "puck1": ObjectConfig(hue_deg=356),
        "puck2": ObjectConfig(hue_deg=216),
        "pusher": ObjectConfig(hue_deg=140, radius_m=0.03, height_m=0.01),
    }


@dataclass(frozen=True, config=_strict)
class TrackerConfig:
    """Everything that the tracker needs besides images and camera_info."""

    objects: Mapping[str, ObjectConfig] = Field(default_factory=_air_hockey)
    fiducials: FiducialConfig = Field(default_factory=FiducialConfig)
    x_limit_m: float = Field(default=0.53, gt=0, le=5, description="objects are looked for at |x| up to this [m]")
    y_limit_m: float = Field(default=0.30, gt=0, le=5, description="objects are looked for at |y| up to this [m]")
    min_arc: float = Field(default=0.3, ge=0.15, le=1, description="least share of the rim that must be seen")
    max_std_m: float = Field(
        default=0.002, gt=0, le=0.05, description="a less certain measurement counts as not seen [m]"
    )
    systematic_std_m: float = Field(default=0.0002, ge=0, le=0.01, description="error of the table's frame [m]")
    acceleration_std: float = Field(
        default=4.0, gt=0, le=1000, description="unmodelled acceleration between frames [m/s^2]"
    )
    gate_m: float = Field(
        default=0.08, gt=0, le=1, description="farthest jump from the prediction for objects alike [m]"
    )
    bridge_s: float = Field(default=0.5, ge=0, le=5, description="how long an unseen object is predicted [s]")
    bridged_std_m: float = Field(
        default=0.01, gt=0, le=1, description="least std of a predicted, not seen position [m]"
    )


def tracker_config(content: Mapping[str, object], where: str = "tracker configuration") -> TrackerConfig:
    """Validate a mapping. Raises ConfigError naming the field, what was expected and what was found."""
    try:
        config = TypeAdapter(TrackerConfig).validate_python(dict(content))
    except ValidationError as error:
        first = error.errors()[0]
        name = ".".join(str(part) for part in first["loc"])
        known = [f.name for kind in (TrackerConfig, FiducialConfig, ObjectConfig) for f in fields(kind)]
        hint = nearest(name.rsplit(".", 1)[-1], known) if first["type"] == "unexpected_keyword_argument" else ""
        raise ConfigError(f"{where}: {name}: {first['msg']}, found {shown(first['input'])}{hint}") from error
    markers = config.fiducials
    if not len(markers.ids) == len(markers.x_m) == len(markers.y_m) or len(set(markers.ids)) != len(markers.ids):
        raise ConfigError(f"{where}: fiducials: expected distinct ids and as many x_m and y_m, found {shown(markers)}")
    if not config.objects:
        raise ConfigError(f"{where}: objects: expected at least one object, found none")
    return config


def read_tracker_config(path: Path) -> TrackerConfig:
    """Tracker configuration from a ROS parameter file of the puck_tracker node, or a plain YAML of the same fields."""
    content = read_yaml(path)
    for wrapper in ("/**", "puck_tracker", "/puck_tracker", "ros__parameters"):
        inner = content.get(wrapper)
        if isinstance(inner, Mapping):
            content = inner
    return tracker_config({key: value for key, value in content.items() if key not in _OF_THE_NODE}, str(path))
