"""Messages from the suite's own data: one function a message, no decisions."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from statistics import fmean
from typing import Any

from compass_ros_interfaces.action import Calibrate
from compass_ros_interfaces.msg import (
    CalibrationStatus,
    CausalGraph,
    Effect,
    EffectParameter,
    ExplainedLaw,
    Explanation,
    Gap,
    Mismatch,
    SimParameter,
    SimParameters,
)
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from std_msgs.msg import Header

from compass_ros.cells import Cell
from compass_ros.nodes.diagnostic import diagnostic
from compass_ros.nodes.job import Step

Json = Mapping[str, Any]
"""A part of result.json, as `reporting.read_result` has checked it."""

MODELS = ("nominal", "calibrated", "with_effects")
EPISODES = ("fit", "held_out")


def number(value: float | None) -> float:
    """JSON has no NaN; null stands for a number that is not defined."""
    return math.nan if value is None else float(value)


def unit(result: Json) -> str:
    """Of the result's distances; results of version 0.1 do not say it, and are in metres."""
    return str(result["gap"].get("unit", "m"))


def parameters_message(result: Json, header: Header, source: str) -> SimParameters:
    """The calibrated parameters; `source` is the path of the result.json."""
    rows = [
        SimParameter(
            name=row["name"], unit=row["unit"], default_value=number(row["default"]), value=number(row["value"]),
            std=number(row["std"]), lower=number(row["bounds"][0]), upper=number(row["bounds"][1]),
            active=row["active"], identifiable=row["identifiable"],
        )
        for row in result["parameters"]
    ]  # fmt: skip
    return SimParameters(header=header, cell=result["cell"], source=source, parameters=rows)


def graph_message(result: Json, header: Header) -> CausalGraph:
    """The causal graph, its matrix in rows of parameters."""
    graph = result["graph"]
    return CausalGraph(
        header=header,
        parameters=graph["parameters"],
        factors=graph["factors"],
        psi=[number(value) for row in graph["psi"] for value in row],
        threshold=float(graph["threshold"]),
        sparsity=number(graph["sparsity"]),
    )


def mismatch_message(result: Json, header: Header) -> Mismatch:
    """What is left after the calibration."""
    mismatch = result["mismatch"]
    where = mismatch["where"] or {}
    region, interval = where.get("region") or {}, where.get("interval") or {}
    site = where.get("site", "all")
    return Mismatch(
        header=header,
        verdict=mismatch["verdict"],
        object=where.get("object", ""),
        site_kind=where.get("site_kind") or "",
        sites=[] if site == "all" else site.split("+"),
        phase=where.get("phase", ""),
        channel=where.get("channel", ""),
        has_region=bool(region),
        region_centre_m=[float(value) for value in region.get("centre_m", (0, 0))],
        region_radius_m=float(region.get("radius_m", 0)),
        time_s=[float(value) for value in where.get("time_s") or ()],
        range_of=interval.get("quantity", ""),
        range=[float(interval.get(end, 0)) for end in ("low", "high")],
        range_unit=interval.get("unit", ""),
        depends_on=where.get("depends_on") or "",
        effects=[effect_message(effect) for effect in mismatch["effects"]],
        explanations=[explanation_message(one) for one in mismatch.get("explanations", ())],
        false_alarm=number(mismatch.get("false_alarm")),
        undetectable=mismatch["undetectable"],
        next_experiment=mismatch["next_experiment"] or "",
        sentence=mismatch["sentence"],
        gaps=gap_messages(result),
        noise_floor=number(result["gap"]["noise_floor_m"]),
        unit=unit(result),
    )


def effect_message(effect: Json) -> Effect:
    """One fitted effect with its evidence."""
    evidence = effect["evidence"]
    return Effect(
        name=effect["name"],
        parameters=quantity_messages(effect["parameters"]),
        held_out_gain=number(evidence["held_out_gain"]),
        log_evidence=number(evidence["log_evidence"]),
        false_alarm_p=number(evidence["false_alarm_p"]),
        equivalents=effect["equivalents"],
    )


def quantity_messages(quantities: Json) -> list[EffectParameter]:
    """Fitted numbers by name."""
    return [
        EffectParameter(name=name, value=number(one["value"]), std=number(one["std"]), unit=one["unit"])
        for name, one in quantities.items()
    ]


def explanation_message(said: Json) -> Explanation:
    """One explanation; its errors on held-out episodes are NaN where there are none."""
    laws = [
        ExplainedLaw(name=law["name"], sites=law["sites"], quantities=quantity_messages(law["quantities"]))
        for law in said["laws"]
    ]
    errors = said.get("held_out") or {}
    return Explanation(
        laws=laws,
        probability=said["probability"],
        log_evidence=number(said["log_evidence"]),
        held_out_before=number(errors.get("before")),
        held_out_after=number(errors.get("after")),
        held_out_floor=number(errors.get("floor")),
        unit=errors.get("unit", ""),
    )


def gap_messages(result: Json) -> list[Gap]:
    """One message for each model and set of episodes that the result has."""
    gap = result["gap"]
    return [
        Gap(
            model=model,
            episodes=episodes,
            factors=list(one["d"]),
            d=[number(value) for value in one["d"].values()],
            rmse=number(one["rmse_m"]),
            unit=unit(result),
        )
        for model in MODELS
        for episodes in EPISODES
        if (one := (gap.get(model) or {}).get(episodes))
    ]


def mean_gap(result: Json, model: str) -> float:
    """Mean trajectory difference over the factors, on held-out episodes where there are any, else on the fitted.

    NaN for a model that was not fitted.
    """
    gap = result["gap"][model] or {}
    found = gap.get("held_out") or gap.get("fit")
    return fmean(number(value) for value in found["d"].values()) if found else math.nan


def left_out(result: Json) -> list[str]:
    """Recordings that a calibration could not use, each with the reason; results of version 0.1 know of none."""
    return [f"{one['bag']} was left out: {one['reason']}" for one in result["episodes"].get("left_out", ())]


def frame_of(cell: Cell, frame: str) -> str:
    """The frame of positions in the cell: the given one; none where it tracks joints alone."""
    return frame if any(spec.quantity != "joint" for spec in cell.objects) else ""


def status_message(
    state: int, unit: str, step: Step | None = None, message: str = "", left_out: Sequence[str] = ()
) -> CalibrationStatus:
    """What the calibrator does now; `step` while it runs; `unit` of the gap. The header is not filled in."""
    status = CalibrationStatus(state=state, unit=unit, message=message, left_out=list(left_out))
    status.share_done = float(state == CalibrationStatus.SUCCEEDED)
    status.gap = status.sparsity = status.seconds_left = math.nan
    if step is not None:
        status.stage = step.progress.stage
        status.iteration = step.progress.iteration
        status.gap = step.progress.gap
        status.sparsity = step.progress.sparsity
        status.share_done = step.progress.done
        status.seconds_left = step.seconds_left
    return status


def feedback_message(status: CalibrationStatus) -> Calibrate.Feedback:
    """The same for whoever has asked for the calibration."""
    return Calibrate.Feedback(
        iteration=status.iteration,
        gap=status.gap,
        unit=status.unit,
        sparsity=status.sparsity,
        share_done=status.share_done,
        seconds_left=status.seconds_left,
        stage=status.stage,
    )


WORDS = {
    CalibrationStatus.IDLE: (DiagnosticStatus.OK, "idle"),
    CalibrationStatus.RUNNING: (DiagnosticStatus.OK, "running"),
    CalibrationStatus.SUCCEEDED: (DiagnosticStatus.OK, "succeeded"),
    CalibrationStatus.FAILED: (DiagnosticStatus.ERROR, "failed"),
    CalibrationStatus.CANCELLED: (DiagnosticStatus.WARN, "cancelled"),
}
"""Level and word of each state of the calibrator."""


def status_diagnostics(status: CalibrationStatus, node: str, header: Header) -> DiagnosticArray:
    """The same for /diagnostics."""
    level, word = WORDS[status.state]
    if status.problems or status.left_out:
        level = max(level, DiagnosticStatus.WARN)
    values = {
        "stage": status.stage,
        "iteration": str(status.iteration),
        f"trajectory difference [{status.unit}]": f"{status.gap:.4g}",
        "sparsity": f"{status.sparsity:.3f}",
        "share done": f"{status.share_done:.3f}",
        "seconds left": f"{status.seconds_left:.0f}",
    }
    message = "; ".join((f"{word}: {status.message}" if status.message else word, *status.problems, *status.left_out))
    return DiagnosticArray(header=header, status=[diagnostic(f"{node}: calibration", level, message, values)])
