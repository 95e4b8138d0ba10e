"""`result.json`: a `Result` for programs. Its JSON Schema lies beside this file."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import asdict
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

import jsonschema

from compass_ros.errors import ConfigError
from compass_ros.reporting.atomic import write_text
from compass_ros.types import (
    EffectFinding,
    EffectParameter,
    ExplainedLaw,
    Explanation,
    Gap,
    Graph,
    HeldOut,
    Mismatch,
    ParameterRow,
    Region,
    Result,
    Where,
)

SCHEMA_ID = "compass/result/2"


@cache
def schema() -> Mapping[str, Any]:
    """The JSON Schema of `result.json`."""
    text = resources.files("compass_ros.reporting").joinpath("result.schema.json").read_text(encoding="utf-8")
    loaded: dict[str, Any] = json.loads(text)
    return loaded


def _number(value: float) -> float | None:
    """JSON has no NaN and no infinity: both become null."""
    return float(value) if math.isfinite(value) else None


def _gap(gap: Gap | None) -> dict[str, Any] | None:
    if gap is None:
        return None
    signals = {
        name: {
            "rms": _number(signal.rms),
            "unit": signal.unit,
            "floor": _number(signal.floor),
            "parts": {part: _number(rms) for part, rms in signal.parts.items()},
        }
        for name, signal in gap.signals.items()
    }
    return {"d": {f: _number(d) for f, d in gap.d.items()}, "rmse_m": _number(gap.rmse_m), "signals": signals}


def _parameter(row: ParameterRow) -> dict[str, Any]:
    return {
        "name": row.name,
        "unit": row.unit,
        "default": _number(row.default),
        "value": _number(row.value),
        "std": _number(row.std),
        "bounds": [_number(bound) for bound in row.bounds],
        "active": bool(row.active),
        "identifiable": bool(row.identifiable),
        "wrong": row.wrong,
        "without_laws": _number(row.without_laws),
    }


def _graph(graph: Graph) -> dict[str, Any]:
    return {
        "parameters": list(graph.parameters),
        "factors": list(graph.factors),
        "psi": [[_number(p) for p in row] for row in graph.psi],
        "threshold": float(graph.threshold),
        "sparsity": graph.sparsity if graph.psi.size else None,
    }


def _where(where: Where | None) -> dict[str, Any] | None:
    if where is None:
        return None
    region = where.region
    return {
        "object": where.object,
        "site_kind": where.site_kind,
        "site": where.site,
        "phase": where.phase,
        "channel": where.channel,
        "region": None if region is None else _region(region),
        "time_s": None if where.time_s is None else [float(t) for t in where.time_s],
        "interval": None if where.interval is None else asdict(where.interval),
        "depends_on": where.depends_on,
    }


def _region(region: Region) -> dict[str, Any]:
    """A disc is `centre_m`, `radius_m`; the box around it says the same for places of any kind."""
    centre, radius = [float(c) for c in region.centre_m], float(region.radius_m)
    box = {"frame": region.frame, "centre": centre, "half_extent": [radius] * len(centre)}
    return box | {"centre_m": centre, "radius_m": radius}


def _effect(effect: EffectFinding) -> dict[str, Any]:
    return {
        "name": effect.name,
        "parameters": _quantities(effect.parameters),
        "evidence": {
            "held_out_gain": _number(effect.evidence.held_out_gain),
            "log_evidence": _number(effect.evidence.log_evidence),
            "false_alarm_p": _number(effect.evidence.false_alarm_p),
        },
        "equivalents": list(effect.equivalents),
    }


def _quantities(quantities: Mapping[str, EffectParameter]) -> dict[str, Any]:
    return {name: {"value": _number(p.value), "std": _number(p.std), "unit": p.unit} for name, p in quantities.items()}


def _explanation(explanation: Explanation) -> dict[str, Any]:
    return {
        "laws": [_law(law) for law in explanation.laws],
        "probability": float(explanation.probability),
        "log_evidence": _number(explanation.log_evidence),
        "held_out": None if explanation.held_out is None else _held_out(explanation.held_out),
        **({"corrections": [_law(law) for law in explanation.corrections]} if explanation.corrections else {}),
    }


def _law(law: ExplainedLaw) -> dict[str, Any]:
    return {"name": law.name, "sites": list(law.sites), "quantities": _quantities(law.quantities)}


def _held_out(errors: HeldOut) -> dict[str, Any]:
    numbers = {name: _number(getattr(errors, name)) for name in ("before", "after", "floor")}
    return numbers | {"unit": errors.unit}


def _mismatch(mismatch: Mismatch) -> dict[str, Any]:
    return {
        "verdict": mismatch.verdict,
        "where": _where(mismatch.where),
        "effects": [_effect(effect) for effect in mismatch.effects],
        "undetectable": list(mismatch.undetectable),
        "next_experiment": mismatch.next_experiment,
        "sentence": mismatch.sentence,
        "explanations": [_explanation(explanation) for explanation in mismatch.explanations],
        "false_alarm": _number(mismatch.false_alarm),
    }


def to_json(result: Result) -> dict[str, Any]:
    """The content of `result.json`: numbers that are not finite become null, models that were not fitted too.

    Order and digits depend on the result alone.
    """
    gap: dict[str, Any] = {}
    for model in ("nominal", "calibrated", "with_effects"):
        parts = result.gap.get(model)
        gap[model] = None if parts is None else {name: _gap(parts.get(name)) for name in ("fit", "held_out")}
    gap["noise_floor_m"] = _number(result.noise_floor_m)
    gap["unit"] = result.unit
    return {
        "schema": SCHEMA_ID,
        "cell": result.cell,
        "cell_file": result.cell_file,
        "method": result.method,
        "seed": int(result.seed),
        "cancelled": bool(result.cancelled),
        "warnings": list(result.warnings),
        **({} if result.time_step_s is None else {"time_step_s": result.time_step_s}),
        **({"friction_holds": True} if result.friction_holds else {}),
        "versions": dict(sorted(result.versions.items())),
        "budget": {
            "rollouts": int(result.budget.rollouts),
            "simulated_seconds": _number(result.budget.simulated_seconds),
            "wall_seconds": _number(result.budget.wall_seconds),
        },
        "episodes": {
            "used": list(result.fit),
            "fit": list(result.fit),
            "held_out": list(result.held_out),
            "left_out": [{"bag": one.bag, "reason": one.reason} for one in result.left_out],
        },
        "gap": gap,
        "parameters": [_parameter(row) for row in result.parameters],
        "together": [{"parameters": list(group.parameters), "ratios": group.ratios} for group in result.together],
        "graph": _graph(result.graph),
        "mismatch": _mismatch(result.mismatch),
    }


def write_result(result: Result, path: Path) -> None:
    """Write `result.json`; the file is whole or not there. Raises ConfigError when it cannot be written."""
    write_text(Path(path), json.dumps(to_json(result), indent=1, ensure_ascii=False, allow_nan=False) + "\n")


def read_result(path: Path, cell: str = "") -> dict[str, Any]:
    """The validated content of a `result.json`, of this cell; empty: of any.

    Raises ConfigError naming the field, what was expected and found.
    """
    try:
        content = json.loads(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read: {error.strerror}") from error
    except (ValueError, RecursionError) as error:
        raise ConfigError(f"{path}: not valid JSON: {' '.join(str(error).split())}") from error
    problem = jsonschema.exceptions.best_match(jsonschema.Draft202012Validator(schema()).iter_errors(content))
    if problem is not None:
        field = ".".join(str(part) for part in problem.absolute_path) or "top level"
        text = " ".join(problem.message.split())
        raise ConfigError(f"{path}: not a {SCHEMA_ID}: {field}: {text[:200]}{'...' if len(text) > 200 else ''}")
    _check_graph(content["graph"], path)
    if cell and content["cell"] != cell:
        raise ConfigError(f"{path}: parameters of '{content['cell']}', this cell is '{cell}'")
    valid: dict[str, Any] = content
    return valid


def _check_graph(graph: Mapping[str, Any], path: Path) -> None:
    """The shape of psi, which a schema cannot hold."""
    rows, columns = len(graph["parameters"]), len(graph["factors"])
    if graph["psi"] and (len(graph["psi"]) != rows or any(len(row) != columns for row in graph["psi"])):
        found = f"{len(graph['psi'])} x {len(graph['psi'][0])}"
        raise ConfigError(f"{path}: graph.psi: expected {rows} parameters x {columns} factors, found {found}")
