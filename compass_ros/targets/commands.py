"""How late, by which factor and how far off a cell's commands act, from its result: no fields of the scene."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping

import numpy as np

from compass_ros.cells import Cell
from compass_ros.cells.series import InputSpec
from compass_ros.targets.plain_mjcf import Command

_FIELD = re.compile(r"input_(delay_s|scale|offset)(?:\[(\d+)\])?")


def commands_of(cell: Cell, values: Mapping[str, float]) -> tuple[Command, ...]:
    """Of each actuator that does not act as it is told, from the values of all parameters by name."""
    inputs = {spec.name: spec for spec in cell.spec.inputs if spec.to == "ctrl"}
    found = {what: _fixed(inputs.values(), what) for what in ("delay_s", "scale", "offset")}
    for parameter in cell.spec.parameters:
        field = _FIELD.fullmatch(parameter.field)
        if field is None or parameter.of not in inputs:
            continue
        targets = inputs[parameter.of].targets
        for target in targets if field[2] is None else targets[int(field[2]) : int(field[2]) + 1]:
            found[field[1]][target] = values[parameter.name]
    listed = (Command(name, **{what: of[name] for what, of in found.items()}) for name in found["delay_s"])
    return tuple(one for one in listed if one != Command(one.actuator))


def _fixed(inputs: Iterable[InputSpec], what: str) -> dict[str, float]:
    """What the cell's YAML says by itself."""
    out: dict[str, float] = {}
    for spec in inputs:
        given = np.broadcast_to(np.asarray(getattr(spec, what), float), len(spec.targets))
        out |= dict(zip(spec.targets, given.tolist(), strict=True))
    return out
