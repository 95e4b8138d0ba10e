"""What is written down of a case: errors against the target, gaps on shots that no method saw, cost, trace."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import asdict
from pathlib import Path

import numpy as np

from compass_ros.bench.case import Case
from compass_ros.bench.edges import SHARE, score_edges
from compass_ros.bench.world import World
from compass_ros.errors import DataError
from compass_ros.types import Estimate, Floats, Gap

SCHEMA = "compass/bench/1"
Row = Mapping[str, object]
"""One line of `results.jsonl`; the fields are those of `outcome`."""


def outcome(
    case: Case, world: World, estimate: Estimate, effects: Floats | None, wall_seconds: float
) -> dict[str, object]:
    """Judge an estimate. `effects` are the (P, K) total effects, for the score of the edges."""
    names = [p.name for p in world.cell.parameters]
    factors = [f.name for f in world.cell.factors]
    causal = list(world.causal)
    errors = percentage_errors(estimate.values, world.truth)[causal]
    identified = estimate.identifiable[causal]
    noisy = world.noisy.gap(estimate.values)
    floor = noise_floor(case.noise_m, world)
    row: dict[str, object] = {
        "schema": SCHEMA,
        "case": asdict(case),
        "wall_seconds": round(wall_seconds, 2),
        "rollouts": estimate.rollouts,
        "rollouts_counted_by_simulator": world.simulator.rollouts,
        "simulated_seconds": round(world.simulator.simulated_seconds, 1),
        "stop_reason": estimate.stop_reason,
        "converged": estimate.converged,
        "causal": [names[i] for i in causal],
        "error": [_number(e) for e in errors],
        "mape": _number(errors.mean()),
        "identified": [names[i] for i, yes in zip(causal, identified, strict=True) if yes],
        "mape_identified": _number(errors[identified].mean() if identified.any() else math.nan),
        "held_out": _gap(world.clean.gap(estimate.values)),
        "held_out_nominal": _gap(world.clean.gap(world.problem.start)),
        "held_out_over_floor": _number(noisy.rmse_m / floor if floor > 0 else math.nan),
        "values": dict(zip(names, map(_number, estimate.values), strict=True)),
        "std": dict(zip(names, map(_number, estimate.std), strict=True)),
        "factors": factors,
        "trace": [
            {
                "values": [_number(v) for v in step.values[causal]],
                "difference": [_number(v) for v in step.difference],
                "rollouts": step.rollouts,
                "psi": np.round(step.psi, 3).tolist(),
            }
            for step in estimate.trace
        ],
        "graph": None,
    }
    if estimate.graph is not None:
        row["graph"] = {"threshold": estimate.graph.threshold, "psi": np.round(estimate.graph.psi, 3).tolist()}
        if effects is not None:
            scored = score_edges(estimate.graph.psi >= estimate.graph.threshold, effects >= SHARE)
            row["edges"] = {
                "kept": scored.kept,
                "precision": _number(scored.precision),
                "recall": _number(scored.recall),
                "missed": [names[i] for i in scored.missed],
                "extra": [names[i] for i in scored.extra],
            }
    return row


def percentage_errors(values: Floats, truth: Floats) -> Floats:
    """|value - truth| / |truth|; where the truth is zero, the error itself."""
    return np.asarray(np.abs(values - truth) / np.where(truth == 0, 1.0, np.abs(truth)))


def noise_floor(noise_m: float, world: World) -> float:
    """Root mean square distance that the noise alone leaves on the held-out shots, for planar and spatial positions
    [m]."""
    dimensions = [min(len([c for c in world.cell.channels if c == o.name]), 3) for o in world.cell.objects]
    return float(noise_m * math.sqrt(sum(dimensions) / len(dimensions)))


def append(path: Path, row: Row) -> None:
    """Add one line; a torn last line of a killed run is closed first, so that it spoils only itself."""
    text = json.dumps(row, allow_nan=False, separators=(",", ":")) + "\n"
    with path.open("ab+") as file:
        if file.tell() > 0:
            file.seek(-1, 2)
            if file.read(1) != b"\n":
                text = "\n" + text
        file.write(text.encode())


def read(path: Path) -> list[dict[str, object]]:
    """All whole lines of this schema, the last one of each case; a torn line is skipped. Raises DataError on other
    content."""
    if not path.exists():
        return []
    rows: dict[str, dict[str, object]] = {}
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
        try:
            row = json.loads(line)
        except json.JSONDecodeError:
            continue
        if not isinstance(row, dict) or row.get("schema") != SCHEMA:
            raise DataError(f"{path}:{number}: expected a line of schema {SCHEMA}")
        rows[case_of(row).key] = row
    return list(rows.values())


def case_of(row: Row) -> Case:
    """The case of a line."""
    fields = row["case"]
    assert isinstance(fields, dict)
    return Case(**fields)


def select(rows: Iterable[Row], **wanted: object) -> list[Row]:
    """Rows whose case has these values."""
    return [row for row in rows if all(getattr(case_of(row), name) == value for name, value in wanted.items())]


def _gap(gap: Gap) -> dict[str, object]:
    return {"d": {name: _number(v) for name, v in gap.d.items()}, "rmse_m": _number(gap.rmse_m)}


def _number(value: float) -> float | None:
    """Six digits; None for NaN, which JSON does not know."""
    return float(f"{value:.6g}") if math.isfinite(value) else None
