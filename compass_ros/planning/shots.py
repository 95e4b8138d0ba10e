"""What planned shots could show, and a better set of the same number."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from compass_ros.cells import Cell
from compass_ros.config import read_yaml
from compass_ros.discovery.candidates import candidates
from compass_ros.discovery.objections import objections
from compass_ros.errors import ConfigError, nearest, shown
from compass_ros.planning.exchange import choose
from compass_ros.planning.information import information
from compass_ros.planning.plan import Plan, plan_of, widest
from compass_ros.planning.planned import completed, draw, linearised
from compass_ros.simulation import Simulator
from compass_ros.types import Floats

POOL = 3
"""Shots that are tried for each one of a proposed set."""


@dataclass(frozen=True)
class Planned:
    """What was found of a set of shots."""

    shots: Floats
    """(E, a) the planned actions."""
    plan: Plan
    warnings: tuple[str, ...]
    proposed: Floats | None
    """(E, a) a better set of the same number."""
    better: Plan | None


def look(
    simulator: Simulator, given: Floats | None, n: int, rate: float, seed: int, propose: bool, tries: int = POOL
) -> Planned:
    """The table of the given shots, or of `n` drawn ones; `tries` shots for each one of a proposed set.

    Raises DataError where the shots cannot answer.
    """
    cell, rng = simulator.cell, np.random.default_rng(seed)
    low, high = (np.array([getattr(a, side) for a in cell.action]) for side in ("low", "high"))
    actions = rng.uniform(low, high, (n, len(low))) if given is None else given
    inputs = completed(cell, actions)
    warnings = objections(cell, inputs, rate, simulator.places.touching)
    count, fields = len(inputs), len(cell.action)
    pool = draw(simulator, tries * count, rng) if propose else inputs[:0]
    response = linearised(simulator, np.concatenate([inputs, pool]), rate, cell.spec.noise_m)
    likelihood = response.likelihood
    asked = candidates(simulator, simulator.defaults, likelihood.inputs, likelihood.time_s)
    known = information(response, asked)
    plan = plan_of(known.of_shots(np.arange(count)))
    if not propose:
        return Planned(actions, plan, warnings, None, None)
    together = widest([(c.name, c.attached.objects) for c in known.candidates])
    chosen = choose(known.only(together), count).shots
    every = np.concatenate([inputs, pool])
    return Planned(actions, plan, warnings, every[chosen][:, :fields], plan_of(known.of_shots(chosen)))


def read_shots(path: Path, cell: Cell) -> Floats:
    """(E, a) actions of a YAML `shots: [{field: value, ...}, ...]`. Raises ConfigError with one line."""
    content = read_yaml(path)
    listed = content.get("shots")
    if not isinstance(listed, list) or not listed:
        raise ConfigError(f"{path}: expected a list `shots`, found {shown(sorted(map(str, content)))}")
    names = [a.name for a in cell.action]
    rows = []
    for number, shot in enumerate(listed, 1):
        where = f"{path}: shot {number}"
        if not isinstance(shot, dict) or set(shot) != set(names):
            found = sorted(map(str, shot)) if isinstance(shot, dict) else shot
            strange = [k for k in found if k not in names] if isinstance(shot, dict) else []
            hint = nearest(strange[0], names) if strange else ""
            raise ConfigError(f"{where}: expected {', '.join(names)}, found {shown(found)}{hint}")
        for name, (low, high) in zip(names, cell.reach.tolist(), strict=True):
            value = shot[name]
            if isinstance(value, bool) or not isinstance(value, (int, float)) or not low <= value <= high:
                raise ConfigError(
                    f"{where}: {name} = {shown(value)}: expected a number in the reach [{low:g}, {high:g}]"
                )
        rows.append([float(shot[name]) for name in names])
    return np.array(rows)
