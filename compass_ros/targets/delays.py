"""Delays and offsets of a cell's commands, from its result: they are no fields of the scene."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping

import numpy as np

from compass_ros.cells import Cell
from compass_ros.cells.series import InputSpec
from compass_ros.targets.plain_mjcf import Delayed

_FIELD = re.compile(r"input_(delay_s|offset)(?:\[(\d+)\])?")


def delays_of(cell: Cell, values: Mapping[str, float]) -> tuple[Delayed, ...]:
    """By actuator, from the values of all parameters by name."""
    inputs = {spec.name: spec for spec in cell.spec.inputs if spec.to == "ctrl"}
    late, shifted = (_fixed(inputs.values(), what) for what in ("delay_s", "offset"))
    for parameter in cell.spec.parameters:
        found = _FIELD.fullmatch(parameter.field)
        if found is None or parameter.of not in inputs:
            continue
        targets = inputs[parameter.of].targets
        to = late if found[1] == "delay_s" else shifted
        for target in targets if found[2] is None else targets[int(found[2]) : int(found[2]) + 1]:
            to[target] = values[parameter.name]
    names = dict.fromkeys([*late, *shifted])
    listed = (Delayed(name, late.get(name, 0.0), shifted.get(name, 0.0)) for name in names)
    return tuple(one for one in listed if one.delay_s or one.offset)


def _fixed(inputs: Iterable[InputSpec], what: str) -> dict[str, float]:
    """What the cell's YAML says by itself."""
    out: dict[str, float] = {}
    for spec in inputs:
        given = np.broadcast_to(np.asarray(getattr(spec, what), float), len(spec.targets))
        out |= dict(zip(spec.targets, given.tolist(), strict=True))
    return out
