"""A result's folder in the words of other simulators."""

from __future__ import annotations

from pathlib import Path

import mujoco

from compass_ros.cells import Cell
from compass_ros.errors import ConfigError
from compass_ros.reporting.result_json import read_result
from compass_ros.simulation.effects import read_effects
from compass_ros.targets.commands import commands_of
from compass_ros.targets.control import write_control
from compass_ros.targets.mjx import write_mjx
from compass_ros.targets.plain_mjcf import write_plain
from compass_ros.targets.said import Said
from compass_ros.targets.urdf import is_urdf, write_urdf

PLAIN, URDF, CONTROL, MJX = "plain.xml", "robot.urdf", "pid_controller.yaml", "laws_mjx.py"


def export(folder: Path, cell: Cell, urdf: Path | None = None) -> dict[Path, tuple[Said, ...]]:
    """Write beside `scene.xml` what other simulators can take: each file, and what became of each law in it.

    `urdf`: where the robot came from, if the cell's scene was made from it. Raises ConfigError for a folder without a
    result, or a file that is no URDF.
    """
    values = {row["name"]: row["value"] for row in read_result(folder / "result.json", cell.name)["parameters"]}
    scene = folder / "scene.xml"
    if not scene.is_file():
        raise ConfigError(f"{folder}: has no scene.xml; `compass calibrate` writes it beside result.json")
    model, told = mujoco.MjModel.from_xml_path(str(scene)), commands_of(cell, values)
    laws = read_effects(folder / "effects.yaml")
    written = {folder / PLAIN: write_plain(scene, laws, told, folder / PLAIN)}
    if laws.effects or laws.sliding:
        written[folder / MJX] = write_mjx(scene, laws, folder / MJX)
    source = urdf or (cell.model_path if is_urdf(cell.model_path) else None)
    if urdf is not None and not is_urdf(urdf):
        raise ConfigError(f"{urdf}: is no URDF; expected an XML document with <robot>")
    plain = mujoco.MjModel.from_xml_path(str(folder / PLAIN))
    if source is not None:
        written[folder / URDF] = write_urdf(source, plain, folder / URDF)
    if model.nu:
        written[folder / CONTROL] = write_control(model, told, folder / CONTROL)
    return written
