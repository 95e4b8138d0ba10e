"""The calibrated scene as MJCF, and the fitted effects as YAML."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from xml.etree import ElementTree

import mujoco
import numpy as np

from compass_ros.cells import Cell
from compass_ros.cells.registry import dynamics_of
from compass_ros.cells.rotors import add_beside
from compass_ros.cells.scene_files import SceneFiles, scene_files
from compass_ros.cells.scene_source import scene_source
from compass_ros.simulation.effects import FittedEffect, write_effects
from compass_ros.simulation.native.program import mujoco_library, save_numbers
from compass_ros.simulation.numerics import hold
from compass_ros.simulation.simulator import Simulator
from compass_ros.types import Floats

FILES = "assets"
"""Folder beside a written scene."""
_EXACT = 17
"""Digits that give every double back."""


def write_scene(cell: Cell, values: Floats, path: Path) -> None:
    """The cell's scene with (P,) values in it, as MJCF that MuJoCo loads by itself, exact to the last digit.

    Its meshes, textures, height fields and skins are copied into the folder `FILES` beside it. What is no field of a
    model (the speed that an arm reaches, a camera's bias) stays in result.json.
    """
    spec = scene_source(cell.model_path).spec
    add_beside(spec, cell.beside)
    spec.option.timestep = cell.time_step or spec.option.timestep
    spec.compiler.saveinertial = True  # else MuJoCo computes masses from the drawing again
    spec.comment = spec.comment.replace("--", "- -")  # MuJoCo reads that, XML has no such comment
    model = _calibrated(spec, cell, values)
    if cell.holds:
        hold(model, np.flatnonzero(model.dof_frictionloss))
    _as_stated(spec)
    with _digits(_EXACT):
        save_numbers(spec, model, path)
    root = ElementTree.parse(path).getroot()
    for source, name in _with_files(root, scene_files(cell.model_path), spec.meshdir, spec.texturedir).items():
        (path.parent / FILES).mkdir(exist_ok=True)
        shutil.copyfile(source, path.parent / FILES / name)
    ElementTree.indent(root)
    path.write_text(ElementTree.tostring(root, encoding="unicode"), encoding="utf-8")


def _calibrated(spec: mujoco.MjSpec, cell: Cell, values: Floats) -> mujoco.MjModel:
    """A scene's model with (P,) values in it. What `mj_copyBack` would leave out is written into the scene before."""
    dynamics, model = dynamics_of(cell), spec.compile()
    dynamics.apply([model], values[None])
    left_out = [
        *((geom, "fluid_coefs", model.geom_fluid[geom.id, 1:6]) for geom in spec.geoms if geom.fluid_ellipsoid),
        *((body, "gravcomp", model.body_gravcomp[body.id]) for body in spec.bodies),
        *((tendon, "springlength", model.tendon_lengthspring[tendon.id]) for tendon in spec.tendons),
        *((actuator, "lengthrange", model.actuator_lengthrange[actuator.id]) for actuator in spec.actuators),
    ]
    changed = [(of, name, value) for of, name, value in left_out if not np.array_equal(getattr(of, name), value)]
    for of, name, value in changed:
        setattr(of, name, value)
    if changed:
        model = spec.compile()
        dynamics.apply([model], values[None])
    return model


def _as_stated(spec: mujoco.MjSpec) -> None:
    """Let a scene hold masses as they are stated, where it took them from its geoms or scaled them to a total.

    MuJoCo 4.0 does not take changed ones for such a scene otherwise; before, what it writes says the same.
    """
    spec.compiler.inertiafromgeom = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_AUTO
    if spec.compiler.settotalmass > 0:
        spec.compiler.settotalmass = -1
        spec.compile()


def _with_files(root: ElementTree.Element, files: SceneFiles, meshes: str, textures: str) -> dict[Path, str]:
    """Let a scene name its files as they will lie beside it. Returns where each is, and its name there."""
    placed: dict[Path, str] = {}
    for element in root.iterfind("*/*"):  # assets, and skins under <deformable>
        for attribute in [a for a in element.attrib if a.startswith("file")]:
            source = files.find(element.attrib[attribute], textures if element.tag == "texture" else meshes)
            if source is not None:
                own = placed.get(source, source.name)
                taken = own in [name for other, name in placed.items() if other != source]
                placed[source] = f"{len(placed)}_{own}" if taken else own
                element.attrib[attribute] = f"{FILES}/{placed[source]}"
    for compiler in root.iterfind("compiler"):
        for folder in ("meshdir", "texturedir", "assetdir", "strippath"):
            compiler.attrib.pop(folder, None)
    return placed


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
        for law, own in simulator.physics.of_effects(np.stack([values, errors])):
            fitted.append(FittedEffect(law, tuple(own[0].tolist()), tuple(own[1].tolist())))
    write_effects(fitted, sliding, path)
