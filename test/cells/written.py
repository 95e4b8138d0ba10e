"""Cells written to a folder for one test."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from operator import attrgetter
from pathlib import Path
from typing import cast

import mujoco
import numpy as np
import yaml

from compass_ros.cells import Cell, load
from compass_ros.cells.physical import NOT_NEGATIVE
from compass_ros.types import Floats

TOSS = """
<mujoco model="toss">
  <option timestep="0.001" integrator="implicitfast"/>
  <worldbody>
    <geom name="table" type="plane" size="1 1 0.1"/>
    <body name="cube" pos="0 0 0.3">
      <freejoint name="cube"/>
      <inertial pos="0 0 0" mass="0.37" diaginertia="0.0008 0.0008 0.0008"/>
      <geom name="cube" type="box" size="0.05 0.05 0.05"/>
    </body>
  </worldbody>
</mujoco>
"""
PENDULUM = """
<mujoco model="pendulum">
  <option timestep="0.001" integrator="implicitfast"/>
  <worldbody>
    <body name="arm1" pos="0 0 1">
      <joint name="joint1" type="hinge" axis="0 1 0" damping="0.0002"/>
      <geom name="arm1" type="capsule" fromto="0 0 0 0 0 -0.17" size="0.01" mass="0.09"/>
      <body name="arm2" pos="0 0 -0.17">
        <joint name="joint2" type="hinge" axis="0 1 0" damping="0.0001"/>
        <geom name="arm2" type="capsule" fromto="0 0 0 0 0 -0.2" size="0.01" mass="0.12"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""
DROP = """
<mujoco model="drop">
  <option timestep="0.001" integrator="implicitfast"/>
  <worldbody>
    <body name="ball" pos="0 0 0">
      <joint name="height" type="slide" axis="0 0 1"/>
      <geom name="ball" type="sphere" size="0.1" mass="0.3"/>
    </body>
  </worldbody>
</mujoco>
"""
SERVO = """
<mujoco model="servo">
  <option timestep="0.001" integrator="implicitfast"/>
  <worldbody>
    <geom name="stop" type="sphere" size="0.1" pos="2 0 0" contype="0" conaffinity="0"/>
    <body name="cart">
      <joint name="rail" type="slide" axis="1 0 0"/>
      <geom name="cart" type="sphere" size="0.05" mass="1" contype="0" conaffinity="0"/>
    </body>
  </worldbody>
  <contact><pair name="bump" geom1="cart" geom2="stop" condim="1" solref="-10000 -10"/></contact>
  <actuator><velocity name="motor" joint="rail" kv="20"/></actuator>
</mujoco>
"""

DERIVED = {"geom_aabb", "geom_sameframe", "body_sameframe", "bvh_aabb"} if mujoco.mj_version() > 3_010_000 else set()
"""Arrays for shortcuts and the broad phase, which `mj_setConst` computes since MuJoCo 3.11."""


def parameter(name: str, field: str, of: str = "", default: float = 0.0, width: float = 1.0) -> dict[str, object]:
    """A parameter whose bounds are ten half widths away, or 0 below what cannot be negative."""
    low = default - 10 * width
    bounds = [max(low, 0.0) if field.partition("[")[0] in NOT_NEGATIVE else low, default + 10 * width]
    return {
        "name": name,
        "default": default,
        "bounds": bounds,
        "unit": "1",
        "half_width": width,
        "field": field,
        "of": of,
    }


def content(
    objects: Sequence[Mapping[str, object]], parameters: Sequence[Mapping[str, object]] = (), **more: object
) -> dict[str, object]:
    """A YAML's content: one factor an object, 50 steps of 20 ms."""
    return {
        "name": "written",
        "dynamics": "mjcf",
        "model": "scene.xml",
        "control_dt_s": 0.02,
        "horizon": 50,
        "objects": list(objects),
        "factors": [cast(str, o["name"]) for o in objects],
        "parameters": list(parameters),
    } | more


def written(folder: Path, scene: str, yaml_content: Mapping[str, object]) -> Cell:
    """The cell of a scene and a YAML's content."""
    (folder / "scene.xml").write_text(scene, encoding="utf-8")
    (folder / "cell.yaml").write_text(yaml.safe_dump(dict(yaml_content)), encoding="utf-8")
    return load(folder / "cell.yaml")


_LEFT_OUT = ("_", "name", "paths", "sensor", "body_sameframe", "geom_sameframe", "site_sameframe", "body_simple")


def differing(one: mujoco.MjModel, other: mujoco.MjModel, within: float = 0.0) -> set[str]:
    """Arrays and options of two models of a scene that differ by more than that: without texts, sensors, shortcuts."""
    arrays = [n for n in dir(one) if isinstance(getattr(one, n, None), np.ndarray) and not n.startswith(_LEFT_OUT)]
    options = [f"opt.{n}" for n in dir(one.opt) if isinstance(getattr(one.opt, n), (np.ndarray, float))]
    return {name for name in (*arrays, *options) if _apart(*(attrgetter(name)(m) for m in (one, other))) > within}


def _apart(one: Floats, other: Floats) -> float:
    if np.shape(one) != np.shape(other):
        return float("inf")
    return float(np.max(np.abs(np.asarray(one, float) - np.asarray(other, float)), initial=0.0))
