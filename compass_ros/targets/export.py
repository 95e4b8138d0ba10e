"""A result's folder in the words of other simulators."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
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
from compass_ros.targets.said import Fate, Said
from compass_ros.targets.urdf import is_urdf, write_urdf

PLAIN, URDF, CONTROL, MJX = "plain.xml", "robot.urdf", "pid_controller.yaml", "laws_mjx.py"


_REF = "the joint's ref: positions and commands go in as recorded"
_SUBTRACT = "subtract {:.4g} from the measured position and from the command of a position servo"


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
    zeros = {p.of: values[p.name] for p in cell.spec.parameters if p.field == "joint_zero" and values[p.name]}
    of_plain = write_plain(scene, laws, told, folder / PLAIN)
    of_sensors = (*(_zero(joint, "exact", _REF) for joint in zeros), *_offsets(cell, values))
    written = {folder / PLAIN: (*of_plain, *of_sensors)}
    if laws.effects or laws.sliding:
        written[folder / MJX] = write_mjx(scene, laws, folder / MJX)
    source = urdf or (cell.model_path if is_urdf(cell.model_path) else None)
    if urdf is not None and not is_urdf(urdf):
        raise ConfigError(f"{urdf}: is no URDF; expected an XML document with <robot>")
    plain = mujoco.MjModel.from_xml_path(str(folder / PLAIN))
    if source is not None:
        without = (_zero(joint, "left out", _SUBTRACT.format(zero)) for joint, zero in zeros.items())
        written[folder / URDF] = (*write_urdf(source, plain, folder / URDF), *without)
    if model.nu:
        written[folder / CONTROL] = write_control(model, told, folder / CONTROL)
    return written


def _offsets(cell: Cell, values: Mapping[str, float]) -> Iterator[Said]:
    """What sensors add, for which a scene has no word."""
    for p in cell.spec.parameters:
        if p.field.startswith("observed_offset") and values[p.name]:
            yield Said(p.name, (p.of,), "left out", f"what is measured is {values[p.name]:.4g} {p.unit} more")


def _zero(joint: str, fate: Fate, why: str) -> Said:
    return Said("zero of the encoder", (joint,), fate, why)
