"""What a fleet knows, as a cell for its next unit: the same cell, with the fleet's values and widths as priors."""

from __future__ import annotations

import os
from dataclasses import fields
from pathlib import Path

import yaml

from compass_ros.cells import Cell
from compass_ros.cells.spec import ParameterSpec
from compass_ros.errors import ConfigError
from compass_ros.operation.fleet import Fleet
from compass_ros.reporting.atomic import write_text
from compass_ros.types import Parameter

HEAD = """\
# Priors for the next unit, from {units}:
# `default` and `half_width` of {count} parameters are the fleet's, all else is the cell's. Units that differ in a
# parameter are not counted there. Bags that were recorded for another YAML are refused: record with this one.
"""


def write_priors(found: Fleet, cell: Cell, path: Path) -> tuple[str, ...]:
    """Write a YAML that extends the cell's; names of the parameters that got a prior.

    Raises ConfigError where the fleet tells none that the cell lists, or the file cannot be written.
    """
    if path.resolve() == cell.path.resolve():
        raise ConfigError(f"{path}: is the cell itself; name another file for the priors")
    spreads = {one.name: one for one in found.spreads}
    rows, changed = [], []
    of_cell = {parameter.name: parameter for parameter in cell.parameters}
    for spec in cell.spec.parameters:
        entry = {
            f.name: _plain(getattr(spec, f.name))
            for f in fields(ParameterSpec)
            if getattr(spec, f.name) not in (None, "")
        }
        if spec.name in spreads:
            entry["default"], entry["half_width"] = _prior(
                spreads[spec.name].next_unit.value, spreads[spec.name].next_unit.std, of_cell[spec.name]
            )
            changed.append(spec.name)
        rows.append(f"  - {yaml.safe_dump(entry, default_flow_style=True, sort_keys=False, width=10_000).strip()}\n")
    if not changed:
        raise ConfigError(f"{cell.path}: parameters: the fleet tells none of them in three units or more")
    base = os.path.relpath(cell.path.absolute(), path.absolute().parent)
    head = HEAD.format(units=", ".join(run.label for run in found.units), count=len(changed))
    said = yaml.safe_dump({"extends": base}, default_flow_style=False)
    write_text(path, f"{head}{said}parameters:\n{''.join(rows)}")
    return tuple(changed)


def _prior(value: float, width: float, parameter: Parameter) -> tuple[float, float]:
    """Within the cell's bounds, and with as many digits as mean something."""
    middle = min(max(float(f"{value:.6g}"), parameter.low), parameter.high)
    return middle, float(f"{min(width, parameter.high - parameter.low):.4g}")


def _plain(value: object) -> object:
    return list(value) if isinstance(value, tuple) else value
