"""Every tunable field of a scene as a parameter: `--parameters auto`, without a hand-made list.

Names are `object@type@field` as in the paper. What a field means decides its bounds and its half width: as far as it is
uncertain when a drawing, a datasheet or a default is all that is known. What the cell tunes already is found by moving
each of its parameters and looking what changes in the model; no number is tuned twice.
"""

from __future__ import annotations

import copy
from collections.abc import Iterator
from dataclasses import replace

import mujoco
import numpy as np

from compass_ros.cells.auto_rules import candidates
from compass_ros.cells.candidate import Candidate
from compass_ros.cells.cell import Cell
from compass_ros.cells.dynamics import Dynamics
from compass_ros.cells.fields import OPTIONS, PLAIN, entry
from compass_ros.cells.made_fields import TURNED
from compass_ros.cells.registry import dynamics_of
from compass_ros.cells.spec import ParameterSpec
from compass_ros.types import Floats

Place = tuple[str, int]
"""An array of the model and a place in it, flattened."""
_WRITES = TURNED | {
    "body_moment": "body_inertia",
    "servo_gain": "actuator_gainprm",
    "command_scale": "actuator_gainprm",
}
"""The array that a made field changes."""


def with_auto(cell: Cell) -> Cell:
    """The same cell with every other tunable field of its scene as a further parameter, after its own."""
    dynamics = dynamics_of(cell)
    scene = at_defaults(cell, dynamics)
    found = automatic(scene, claimed(cell, dynamics, scene), {p.name for p in cell.parameters}, str(cell.path))
    return replace(cell, spec=replace(cell.spec, parameters=(*cell.spec.parameters, *found)))


def automatic(
    scene: mujoco.MjModel, taken: set[Place], names: set[str], where: str = "scene"
) -> tuple[ParameterSpec, ...]:
    """Parameters for all tunable fields of a scene whose numbers are not `taken` and whose names are not in `names`."""
    used = set(names)
    out = []
    for candidate in candidates(scene):
        if places(scene, candidate, where) & taken:
            continue
        name = candidate.name if candidate.name not in used else f"{candidate.name}_{candidate.field.partition('[')[0]}"
        used.add(name)
        out.append(specified(candidate, name))
    return tuple(out)


def at_defaults(cell: Cell, dynamics: Dynamics) -> mujoco.MjModel:
    """A copy of the scene with the cell's default values written into it."""
    return _applied(dynamics, cell.defaults)


def claimed(cell: Cell, dynamics: Dynamics, scene: mujoco.MjModel) -> set[Place]:
    """The numbers of the model that the cell's own parameters change."""
    taken: set[Place] = set()
    for i, parameter in enumerate(cell.parameters):
        values = cell.defaults.copy()
        up = parameter.default + parameter.half_width
        values[i] = up if up <= parameter.high else parameter.default - parameter.half_width
        taken |= set(changed(scene, _applied(dynamics, values)))
    return taken


def _applied(dynamics: Dynamics, values: Floats) -> mujoco.MjModel:
    model = copy.copy(dynamics.model)
    dynamics.apply([model], values[None])
    return model


def changed(a: mujoco.MjModel, b: mujoco.MjModel) -> Iterator[Place]:
    """The numbers that differ between two models of a scene."""
    for array in PLAIN:
        before, after = np.ravel(getattr(a, array)), np.ravel(getattr(b, array))
        yield from ((array, int(place)) for place in np.flatnonzero(before != after))
    for option in OPTIONS:
        before, after = np.ravel(getattr(a.opt, option)), np.ravel(getattr(b.opt, option))
        yield from ((f"opt.{option}", int(place)) for place in np.flatnonzero(before != after))


def places(scene: mujoco.MjModel, candidate: Candidate, where: str) -> set[Place]:
    """Numbers that a candidate writes; a turn the whole quaternion, a moment all inertias, a drive its gain."""
    name, bracket, index = candidate.field.partition("[")
    found = entry(scene, _WRITES.get(name, name + bracket + index), candidate.of, where)
    return {(found.array, int(place)) for place in found.flat}


def specified(candidate: Candidate, name: str) -> ParameterSpec:
    """A field as a parameter of a cell."""
    return ParameterSpec(
        name=name,
        default=candidate.value,
        bounds=(candidate.low, candidate.high),
        unit=candidate.unit,
        half_width=candidate.half_width,
        description=f"{candidate.field} of {candidate.of or 'the scene'}",
        field=candidate.field,
        of=candidate.of,
    )
