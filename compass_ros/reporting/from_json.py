"""What `result.json` says, as a `Result` again: tables and checks can be drawn from it, trajectories cannot."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, Literal

import numpy as np

from compass_ros.reporting.words import MODELS
from compass_ros.types import (
    GENERAL,
    Budget,
    EffectFinding,
    EffectParameter,
    Evidence,
    ExplainedLaw,
    Explanation,
    Gap,
    Graph,
    HeldOut,
    Interval,
    LeftOut,
    Mismatch,
    ParameterRow,
    Region,
    Result,
    SignalGap,
    Together,
    Where,
)

Episodes = Literal["fit", "held_out"]
Json = Mapping[str, Any]
"""A part of result.json, as `read_result` has checked it."""


def from_json(content: Json) -> Result:
    """The inverse of `to_json`, with NaN for null; replays and trace, which are not in the file, are empty.

    Results of the first version are read too: what they lack is None or empty, their phases have the words of today.
    """
    gap, graph, budget = content["gap"], content["graph"], content["budget"]
    return Result(
        cell=content["cell"],
        method=content["method"],
        seed=content["seed"],
        versions=content["versions"],
        budget=Budget(budget["rollouts"], _number(budget["simulated_seconds"]), _number(budget["wall_seconds"])),
        fit=tuple(content["episodes"]["fit"]),
        held_out=tuple(content["episodes"]["held_out"]),
        gap={model: _gaps(gap[model]) for model in MODELS if gap[model] is not None},
        noise_floor_m=_number(gap["noise_floor_m"]),
        unit=gap.get("unit", "m"),
        cell_file=content.get("cell_file", ""),
        time_step_s=content.get("time_step_s"),
        friction_holds=content.get("friction_holds", False),
        parameters=tuple(_parameter(row) for row in content["parameters"]),
        together=tuple(Together(tuple(g["parameters"]), g["ratios"]) for g in content.get("together", ())),
        graph=Graph(
            tuple(graph["parameters"]),
            tuple(graph["factors"]),
            np.array([[_number(p) for p in row] for row in graph["psi"]]).reshape(-1, len(graph["factors"])),
            graph["threshold"],
        ),
        mismatch=_mismatch(content["mismatch"]),
        trace=(),
        replays=(),
        cancelled=content["cancelled"],
        warnings=tuple(content["warnings"]),
        left_out=tuple(LeftOut(one["bag"], one["reason"]) for one in content["episodes"].get("left_out", ())),
    )


def _number(value: float | None) -> float:
    return math.nan if value is None else float(value)


def _gaps(parts: Json) -> dict[Episodes, Gap]:
    names: tuple[Episodes, ...] = ("fit", "held_out")
    return {name: _gap(parts[name]) for name in names if parts[name] is not None}


def _gap(part: Json) -> Gap:
    signals = {name: _signal(one) for name, one in part.get("signals", {}).items()}
    return Gap({factor: _number(d) for factor, d in part["d"].items()}, _number(part["rmse_m"]), signals)


def _signal(one: Json) -> SignalGap:
    parts = {part: _number(rms) for part, rms in one.get("parts", {}).items()}
    return SignalGap(_number(one["rms"]), one["unit"], _number(one["floor"]), parts)


def _parameter(row: Json) -> ParameterRow:
    return ParameterRow(
        name=row["name"],
        unit=row["unit"],
        default=_number(row["default"]),
        value=_number(row["value"]),
        std=_number(row["std"]),
        bounds=(_number(row["bounds"][0]), _number(row["bounds"][1])),
        active=row["active"],
        identifiable=row["identifiable"],
        without_laws=_number(row.get("without_laws")),
    )


def _mismatch(said: Json) -> Mismatch:
    return Mismatch(
        verdict=said["verdict"],
        where=None if said["where"] is None else _where(said["where"]),
        effects=tuple(_effect(effect) for effect in said["effects"]),
        undetectable=tuple(said["undetectable"]),
        next_experiment=said["next_experiment"],
        sentence=said["sentence"],
        explanations=tuple(_explanation(one) for one in said.get("explanations", ())),
        false_alarm=_number(said.get("false_alarm")),
    )


def _explanation(said: Json) -> Explanation:
    laws, corrections = _laws(said["laws"]), _laws(said.get("corrections", ()))
    held_out = _held_out(said["held_out"]) if said.get("held_out") is not None else None
    return Explanation(laws, said["probability"], _number(said["log_evidence"]), held_out, corrections)


def _laws(said: Sequence[Json]) -> tuple[ExplainedLaw, ...]:
    return tuple(ExplainedLaw(law["name"], tuple(law["sites"]), _quantities(law["quantities"])) for law in said)


def _held_out(said: Json) -> HeldOut:
    return HeldOut(_number(said["before"]), _number(said["after"]), _number(said["floor"]), said["unit"])


def _quantities(said: Json) -> dict[str, EffectParameter]:
    return {name: EffectParameter(_number(p["value"]), _number(p["std"]), p["unit"]) for name, p in said.items()}


def _where(where: Json) -> Where:
    region, time_s, interval = where["region"], where["time_s"], where.get("interval")
    return Where(
        where["object"],
        GENERAL.get(where["phase"], where["phase"]),
        where["channel"],
        None if region is None else _region(region),
        None if time_s is None else (time_s[0], time_s[1]),
        None if interval is None else Interval(**interval),
        where.get("depends_on"),
        where.get("site_kind"),
        where.get("site", where["object"]),
    )


def _region(region: Json) -> Region:
    x, y = region["centre_m"]
    return Region((x, y), region["radius_m"], region.get("frame", "world"))


def _effect(effect: Json) -> EffectFinding:
    evidence = effect["evidence"]
    parameters = _quantities(effect["parameters"])
    return EffectFinding(
        effect["name"],
        parameters,
        Evidence(*(_number(evidence[name]) for name in ("held_out_gain", "log_evidence", "false_alarm_p"))),
        tuple(effect["equivalents"]),
    )
