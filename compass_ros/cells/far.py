"""Where a cell begins so far from its own scene that one of the two is probably in another unit, or a misprint."""

from __future__ import annotations

from collections.abc import Iterator

import mujoco
import numpy as np

from compass_ros.cells.cell import Cell
from compass_ros.cells.fields import PLAIN, entry
from compass_ros.cells.registry import dynamics_of
from compass_ros.cells.spec import ParameterSpec
from compass_ros.types import Floats

FACTOR = 10.0
"""How many times larger or smaller is far. A gram is a thousandth, a degree a 57th, a millimetre a thousandth."""
_DRAWN = ("body_mass", "body_inertia", "geom_size", "opt.gravity")
"""What a drawing or a scale tells within that factor, whatever the bounds are. Friction, damping, armature and gains
are often guesses in a scene: they are far where the cell's bounds say that the scene's number cannot be."""


def far_from_scene(cell: Cell) -> Iterator[str]:
    """A sentence for each parameter of the cell's list that begins far from what the scene says."""
    scene = dynamics_of(cell).model
    for p in cell.spec.parameters:
        at = _numbers(scene, p, str(cell.path))
        at = at[at != 0]
        if not p.default or not len(at):
            continue  # 0: a scene often leaves out what a cell begins to guess
        times = np.abs(at / p.default)
        far = bool((np.maximum(times, 1 / times) >= FACTOR).all())
        outside = not ((p.bounds[0] <= at) & (at <= p.bounds[1])).any()
        if far and (outside or p.field.partition("[")[0] in _DRAWN):
            unit = "" if p.unit == "1" else f" {p.unit}"
            said = f"{p.name} begins at {p.default:g}{unit}, and the scene has {at[0]:g} ({p.field} of {p.of or 'it'})"
            yield f"{said}: one of them is in another unit, or a misprint"


def _numbers(scene: mujoco.MjModel, p: ParameterSpec, where: str) -> Floats:
    """What the scene has in its place; none for what is no number of it."""
    name = p.field.partition("[")[0]
    if name not in PLAIN and not name.startswith("opt."):
        return np.zeros(0)
    found = entry(scene, p.field, p.of, where)
    holder, array = (scene.opt, name.removeprefix("opt.")) if name.startswith("opt.") else (scene, name)
    return np.ravel(np.asarray(getattr(holder, array), float))[found.flat]
