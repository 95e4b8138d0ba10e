"""The calibrated scene as MJCF, and the fitted effects as YAML."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from xml.etree import ElementTree

import mujoco
import numpy as np

from compass_ros.cells import Cell
from compass_ros.cells.registry import dynamics_of
from compass_ros.simulation.effects import FittedEffect, write_effects
from compass_ros.simulation.native.program import mujoco_library
from compass_ros.simulation.simulator import Simulator
from compass_ros.types import Floats

_EXACT = 17
"""Digits that give every double back."""


def write_scene(cell: Cell, values: Floats, path: Path) -> None:
    """The cell's scene with (P,) values in it, as MJCF that MuJoCo loads by itself, exact to the last digit.

    What is no field of a model (the speed that an arm reaches, a camera's bias) stays in result.json.
    """
    model = mujoco.MjModel.from_xml_path(str(cell.model_path))
    dynamics_of(cell).apply([model], values[None])
    with _digits(_EXACT):
        mujoco.mj_saveLastXML(str(path), model)
    _with_inertias(path, model)


def _with_inertias(path: Path, model: mujoco.MjModel) -> None:
    """Write masses where bodies have them from their geoms: MuJoCo would compute them from the drawing again."""
    tree = ElementTree.parse(path)
    for element in tree.iter("body"):
        if element.find("inertial") is not None or not element.get("name"):
            continue
        body = model.body(element.get("name"))
        if body.mass[0] > 0:
            numbers = {"pos": body.ipos, "quat": body.iquat, "mass": body.mass, "diaginertia": body.inertia}
            text = {name: " ".join(repr(float(x)) for x in value) for name, value in numbers.items()}
            element.insert(0, ElementTree.Element("inertial", text))
    ElementTree.indent(tree)
    tree.write(path, encoding="utf-8")


@contextmanager
def _digits(count: int) -> Iterator[None]:
    """Let MuJoCo write numbers with so many digits; it has no public function for that."""
    get, put = mujoco_library()["_mjPRIVATE__get_xml_precision"], mujoco_library()["_mjPRIVATE__set_xml_precision"]
    before = get()
    put(count)
    try:
        yield
    finally:
        put(before)


def write_effects_of(
    simulator: Simulator | None, values: Floats | None, std: Floats | None, cell: Cell, calibrated: Floats, path: Path
) -> None:
    """The effects of a fitted simulator with its (P + Q,) values and standard deviations, and the table's friction.

    Without such a simulator only the friction, from the (P,) `calibrated` values.
    """
    of_cell = calibrated if values is None else values[: len(cell.parameters)]
    sliding = {s.body: s for s in dynamics_of(cell).sliding(of_cell[None])}
    fitted = []
    if simulator is not None and values is not None:
        errors = np.full(len(values), np.nan) if std is None else std
        at = len(cell.parameters)
        for attached in simulator.effects:
            own = slice(at, at + len(attached.effect.quantities))
            fitted.append(FittedEffect(attached, tuple(values[own].tolist()), tuple(errors[own].tolist())))
            at = own.stop
    write_effects(fitted, sliding, path)
