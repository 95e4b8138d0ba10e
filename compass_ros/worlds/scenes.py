"""Which cell has which scene. A module of a scene has `conceal(task, asked) -> World`; it is imported when needed."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module

from compass_ros.worlds.world import Scene

MODULES: Mapping[str, str] = {
    "two_joint_arm": "arms.passive",
    "two_joint_arm_driven": "arms.driven",
    "kinova3": "arms.kinova",
    "kinova3_effort": "arms.kinova",
    "ball_flight": "flight.scene",
    "ball_flight_air": "flight.scene",
    "bouncing_ball": "bounce.scene",
    "pushed_bar": "push.scene",
}
TABLES: Mapping[str, str] = {"air_hockey": "table.scene"}
"""The same of cells that have worlds on the suite's own scene too (`concealed/`): asked for by `--forms foreign`."""


COMMANDED = ("air_hockey", "two_joint_arm_driven", "kinova3", "kinova3_effort")
"""Cells whose worlds can be told what to do (`Asked.commands`)."""


def scene_of(cell: str) -> Scene | None:
    """The scene of a cell by its name; None where it has none."""
    module = {**MODULES, **TABLES}.get(cell)
    if module is None:
        return None
    scene: Scene = import_module(f"compass_ros.worlds.{module}").conceal
    return scene
