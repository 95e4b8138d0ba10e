"""The suite's words for the values that `types.py` spells as literals."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Literal

from compass_ros.reporting.numbers import MINUS
from compass_ros.types import DependsOn, LeftOut, ParameterRow, Phase, Result, SiteWord, Told, Unit, Verdict, Where

Level = Literal["good", "note", "care", "bad"]
Model = Literal["nominal", "calibrated", "with_effects"]

MODELS: tuple[Model, ...] = ("nominal", "calibrated", "with_effects")

MODEL_LABEL: Mapping[Model, str] = {
    "nominal": "nominal",
    "calibrated": "calibrated",
    "with_effects": "with effects",
}

VERDICT_TITLE: Mapping[Verdict, str] = {
    "none": "Nothing is missing",
    "named": "Missing physics named",
    "ambiguous": "Missing physics, two readings",
    "unknown": "Something unknown is missing",
    "fit_failed": "The fit failed",
    "data_bad": "The recordings are bad",
    "not_evaluated": "Not evaluated",
}

VERDICT_LEVEL: Mapping[Verdict, Level] = {
    "none": "good",
    "named": "good",
    "ambiguous": "care",
    "unknown": "care",
    "fit_failed": "bad",
    "data_bad": "bad",
    "not_evaluated": "care",
}

VERDICT_MEANING: Mapping[Verdict, str] = {
    "none": "What is left after the calibration is no more than the noise of the recordings.",
    "named": "A known effect explains what the calibrated simulator leaves over, or most of it.",
    "ambiguous": "An effect is there, but these recordings cannot tell its candidates apart.",
    "unknown": "Something is there, and none of the known effects explains it.",
    "fit_failed": "What is left is the simulator's numerics, or a fit of the search had no solution; nothing is named.",
    "data_bad": "The recordings cannot answer the question, so nothing is named.",
    "not_evaluated": "Nobody looked for missing physics here. This is not a pass.",
}

PHASE: Mapping[Phase, str] = {
    "start": "at the strike",
    "contact": "in contacts",
    "rest": "at rest",
    "strike": "at the strike",
    "free": "on free slides",
    "wall_contact": "at wall contacts",
    "object_contact": "at contacts between objects",
    "all": "in every phase",
}

KIND: Mapping[DependsOn, str] = {
    "place": "a function of place",
    "velocity": "a function of velocity",
    "time": "neither a function of place nor of velocity",
}

OF_JOINTS: Mapping[Phase, str] = {**PHASE, "start": "in the drive", "strike": "in the drive", "free": "in motion"}
"""The same where hinges are tracked and nothing else."""

SITES: Mapping[SiteWord, tuple[str, str]] = {
    "joint": ("joint", "joints"),
    "body": ("body", "bodies"),
    "geom_pair": ("contacts of", "contacts"),
    "body_pair": ("pair of", "pairs of bodies"),
    "actuator": ("actuator", "actuators"),
    "signal": ("signal", "signals"),
    "field": ("number", "numbers"),
}
"""One of them before its name, and several."""

CHANNEL: Mapping[str, str] = {
    "dynamics": "dynamics: a force while moving",
    "contact": "contact: what happens when things touch",
    "actuation": "actuation: from command to motion",
    "sensing": "sensing: from motion to measurement",
    "all": "no single channel",
}


def in_error_bars(result: Result) -> bool:
    """Whether the method gives error bars, so that what was wrong can be told."""
    return any(math.isfinite(row.error_bars) for row in result.parameters)


def told(row: ParameterRow) -> bool:
    """Whether a reader is shown this parameter: it was wrong, or it matters."""
    return row.wrong or row.active


def best_model(result: Result) -> Model:
    """The most complete model that was fitted."""
    return "with_effects" if "with_effects" in result.gap else "calibrated"


def held_out_rmse(result: Result, model: Model) -> float:
    """Held-out root mean square distance of a model [m]; NaN where there is none."""
    gap = result.gap.get(model, {}).get("held_out")
    return gap.rmse_m if gap is not None else float("nan")


def fit_rmse(result: Result, model: Model) -> float:
    """Root mean square distance of a model on the fitted episodes [m]; NaN where there is none."""
    gap = result.gap.get(model, {}).get("fit")
    return gap.rmse_m if gap is not None else float("nan")


def where_rows(where: Where, unit: Unit) -> tuple[tuple[str, str], ...]:
    """What, in words, for each field of `where` that says something; `unit`: of the result."""
    hinges = unit == "rad"
    every = "all joints" if hinges else "all objects"
    rows = [("object", every if where.object == "all" else where.object)]
    if where.site_kind is not None:
        rows = [("site", _site(where.site, *SITES[where.site_kind], pair=where.site_kind.endswith("pair")))]
    rows.append(("phase", (OF_JOINTS if hinges else PHASE)[where.phase]))
    rows.append(("channel", CHANNEL[where.channel]))
    if where.region is not None:
        x, y = where.region.centre_m
        rows.append(
            ("region", f"within {where.region.radius_m * 100:.0f} cm of ({x:.3f}, {y:.3f}) m".replace("-", MINUS))
        )
    if where.interval is not None:
        one = where.interval
        rows.append((one.quantity, f"{one.low:.3g} to {one.high:.3g} {one.unit}".replace("-", MINUS)))
    if where.depends_on is not None:
        rows.append(("kind", KIND[where.depends_on]))
    if where.time_s is not None:
        of = "the beginning" if hinges else "the command"
        rows.append(("time", f"{where.time_s[0]:.2f} to {where.time_s[1]:.2f} s after {of}"))
    return tuple(rows)


def _site(site: str, one: str, several: str, pair: bool) -> str:
    """`joint elbow`, `joints elbow, wrist`, `all joints`."""
    if site == "all":
        return f"all {several}"
    names = site.split("+")
    return f"{one if pair or len(names) == 1 else several} {' and '.join(names) if pair else ', '.join(names)}"


def by_kind(names: Sequence[str]) -> str:
    """`damping of joint_1, joint_2; mass of link`, from parameters' names `object@type@param`."""
    kinds: dict[str, list[str]] = {}
    for name in names:
        of, _, rest = name.partition("@")
        kinds.setdefault(rest.rpartition("@")[2] or of, []).append(of)
    return "; ".join(kind if of == [kind] else f"{kind} of {', '.join(of)}" for kind, of in kinds.items())


def told_lines(told: Told) -> list[str]:
    """What recordings tell of parameters, in words; a line for each way of which there are any."""
    groups = ". ".join(group.sentence for group in told.together)
    said = {
        f"pinned down ({len(told.alone)})": by_kind(told.alone),
        f"only together ({sum(len(g.parameters) for g in told.together)})": groups,
        f"hardly ({len(told.weakly)})": by_kind(told.weakly),
        f"not at all ({len(told.not_at_all)})": by_kind(told.not_at_all),
    }
    return [f"{how}: {names}" for how, names in said.items() if names]


def left_out_together(left_out: Sequence[LeftOut]) -> list[tuple[int, str, str]]:
    """How many recordings of one folder were left out for one reason, which (`folder/a, b`), and the reason."""
    names: dict[tuple[str, Path], list[str]] = {}
    for one in left_out:
        path = Path(one.bag)
        names.setdefault((one.reason, path.parent), []).append(path.name)
    return [
        (len(found), ", ".join([str(folder / found[0]), *found[1:]]), reason)
        for (reason, folder), found in names.items()
    ]


def left_out_lines(left_out: Sequence[LeftOut]) -> list[str]:
    """The same as sentences without a full stop."""
    return [
        f"{bags} {'was' if count == 1 else 'were'} left out: {reason}"
        for count, bags, reason in left_out_together(left_out)
    ]
