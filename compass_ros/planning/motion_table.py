"""Proposed motions as a table that a robot can play, and the import that turns what it recorded into bags.

The table has the input at each time, and beside it what the simulator expects of each signal: columns that a recording
of the real robot replaces.
"""

from __future__ import annotations

import csv
import io
from pathlib import Path

import numpy as np
import yaml

from compass_ros.cells import Cell
from compass_ros.cells.series import OF_JOINTS
from compass_ros.cells.signals import Signal
from compass_ros.errors import ConfigError
from compass_ros.planning.excitation import Proposal
from compass_ros.types import Floats

DIGITS = 6
"""After the point, of a number of the input: a micrometre, a microradian."""


def table(cell: Cell, proposal: Proposal) -> str:
    """CSV: motion, time [s], the numbers of the input, those of each signal."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(["motion", "time", *_input_columns(proposal), *(c for s in cell.signals for c in _columns(s))])
    for number, episode in enumerate(proposal.expected):
        series = proposal.motions.series[number]
        for frame, time in enumerate(proposal.motions.time_s):
            numbers = [n for s in cell.signals for n in episode.track(s.name).value[frame].tolist()]
            row = [f"{round(n, DIGITS) + 0.0:.{DIGITS}f}" for n in (*series[frame].tolist(), *numbers)]
            writer.writerow([episode.name, f"{time:.4f}", *row])
    return out.getvalue()


def import_config(cell: Cell, proposal: Proposal, file: str) -> str:
    """YAML for `compass import`: bags of the cell from such a table in a file."""
    spec = proposal.driven.spec
    tracks = {s.name: _track(s) for s in cell.signals}
    driven = {"quantity": spec.quantity, "columns": _input_columns(proposal), "of": list(spec.of)}
    content = {
        "cell": cell.name,
        "recordings": [{"file": file, "format": "csv", "group_by": "motion", "name": "{group}"}],
        "time": {"column": "time"},
        "tracks": tracks,
        "inputs": {spec.name: driven | ({"topic": spec.topic} if spec.topic else {})},
    }
    return yaml.safe_dump(content, sort_keys=False, width=120, default_flow_style=None)


def read_commands(path: Path, cell: Cell) -> Floats:
    """(E, n, D) numbers of the one input of a cell in such a table. Raises ConfigError where it is none."""
    (spec,) = cell.spec.inputs
    names = [f"{spec.name}.{name}" for name in spec.of]
    motions: dict[str, list[list[float]]] = {}
    try:
        with path.open(encoding="utf-8", newline="") as lines:
            for row in csv.DictReader(lines):
                motions.setdefault(row["motion"], []).append([float(row[name]) for name in names])
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read: {error.strerror}") from error
    except (KeyError, ValueError) as error:
        raise ConfigError(f"{path}: expected columns motion, {', '.join(names)}: {error}") from error
    if len({len(rows) for rows in motions.values()}) != 1:
        raise ConfigError(f"{path}: expected motions of one length, found {[len(r) for r in motions.values()]}")
    return np.array([*motions.values()])


def _input_columns(proposal: Proposal) -> list[str]:
    return [f"{proposal.driven.spec.name}.{name}" for name in proposal.driven.spec.of]


def _columns(signal: Signal) -> list[str]:
    return [f"{signal.name}.{name}" for name in signal.numbers]


def _track(signal: Signal) -> dict[str, object]:
    content: dict[str, object] = {"quantity": signal.quantity, "columns": _columns(signal)}
    if signal.quantity in OF_JOINTS:
        content["of"] = list(signal.of)
    return content | ({"topic": signal.topic} if signal.topic else {})
