"""Configuration of the virtual camera and of what it looks at: a small air-hockey table under a RealSense-like camera.

Lengths in metres in the frame `table`, colours as (red, green, blue), 0 to 255.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from pydantic import ConfigDict, Field, TypeAdapter, ValidationError
from pydantic.dataclasses import dataclass

from compass_ros.errors import ConfigError, shown
from compass_ros.tracking.camera import CameraModel, TableView
from compass_ros.tracking.config import FiducialConfig

_strict = ConfigDict(extra="forbid")
Colour = tuple[float, float, float]


@dataclass(frozen=True, config=_strict)
class CameraConfig:
    """Intrinsics, place and exposure. fx and fy are those of a RealSense colour camera at 640x480."""

    width: int = Field(default=640, ge=64, le=4096)
    height: int = Field(default=480, ge=64, le=4096)
    fx: float = Field(default=615.3, gt=0)
    fy: float = Field(default=614.8, gt=0)
    cx: float = 322.4
    cy: float = 238.1
    distortion: tuple[float, ...] = (-0.085, 0.055, 0.0007, -0.0005, 0.0)
    """plumb_bob."""
    position_m: tuple[float, float, float] = (0.012, -0.055, 1.02)
    look_at_m: tuple[float, float, float] = (0.004, -0.002, 0.0)
    roll_deg: float = Field(default=0.8, ge=-180, le=180)
    rate_hz: int = Field(default=60, ge=1, le=240)
    exposure_s: float = Field(default=0.004, ge=0, le=0.05)
    sub_frames: int = Field(default=5, ge=1, le=32, description="moments of the exposure that are averaged")
    noise: float = Field(default=2.5, ge=0, le=50, description="standard deviation of the sensor's noise [grey levels]")


@dataclass(frozen=True, config=_strict)
class DiscConfig:
    """A round thing that moves."""

    colour: Colour
    radius_m: float = Field(default=0.0255, gt=0)
    height_m: float = Field(default=0.006, ge=0)
    handle_m: float = Field(default=0.0, ge=0, description="height at which the arm holds its handle; 0: no handle")
    shadow: float = Field(default=0.38, ge=0, le=1, description="share of light that is missing in its shadow")


@dataclass(frozen=True, config=_strict)
class BoxConfig:
    """A box that stands on the table and does not move."""

    centre_m: tuple[float, float]
    size_m: tuple[float, float, float]
    colour: Colour = (58, 62, 70)


@dataclass(frozen=True, config=_strict)
class ArmConfig:
    """A planar two-link arm beside the table; its hand holds the handle of the disc `holds`."""

    base_m: tuple[float, float] = (-0.22, -0.40)
    links_m: tuple[float, float] = (0.27, 0.27)
    height_m: float = 0.13
    holds: str = "pusher"


def _discs() -> dict[str, DiscConfig]:
    return {
        "puck1": DiscConfig(colour=(196, 34, 44)),
        "puck2": DiscConfig(colour=(28, 84, 186)),
        "pusher": DiscConfig(colour=(26, 132, 62), radius_m=0.03, height_m=0.01, handle_m=0.13),
    }


@dataclass(frozen=True, config=_strict)
class SceneConfig:
    """The world in front of the virtual camera."""

    camera: CameraConfig = Field(default_factory=CameraConfig)
    fiducials: FiducialConfig = Field(default_factory=FiducialConfig)
    table_m: tuple[float, float] = (0.9, 0.45)
    rail_m: tuple[float, float] = (0.014, 0.012)
    """Width and height of the walls."""
    goal_m: tuple[float, float, float] = (0.43, 0.0, 0.15)
    """x and y of the centre, radius."""
    boxes: tuple[BoxConfig, ...] = (BoxConfig(centre_m=(0.1, 0.0), size_m=(0.025, 0.18, 0.015)),)
    discs: Mapping[str, DiscConfig] = Field(default_factory=_discs)
    arm: ArmConfig | None = Field(default_factory=ArmConfig)
    light: float = Field(default=0.30, ge=0, le=0.9, description="share of light that is missing in the darkest corner")


def scene_config(content: Mapping[str, object], where: str = "virtual camera") -> SceneConfig:
    """Validate a mapping. Raises ConfigError naming the field, what was expected and what was found."""
    try:
        return TypeAdapter(SceneConfig).validate_python(dict(content))
    except ValidationError as error:
        first = error.errors()[0]
        name = ".".join(str(part) for part in first["loc"])
        raise ConfigError(f"{where}: {name}: {first['msg']}, found {shown(first['input'])}") from error


def camera_of(config: CameraConfig) -> CameraModel:
    """The camera's true intrinsics."""
    focal, centre = (config.fx, config.fy), (config.cx, config.cy)
    return CameraModel(config.width, config.height, focal, centre, config.distortion)


def view_of(config: CameraConfig) -> TableView:
    """The camera's true place."""
    eye = np.asarray(config.position_m)
    forward = np.asarray(config.look_at_m) - eye
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, [0.0, 1.0, 0.0])
    right /= np.linalg.norm(right)
    down = np.cross(forward, right)
    roll = np.deg2rad(config.roll_deg)
    right, down = np.cos(roll) * right + np.sin(roll) * down, np.cos(roll) * down - np.sin(roll) * right
    rotation = np.stack([right, down, forward])
    return TableView(camera_of(config), rotation, -rotation @ eye)
