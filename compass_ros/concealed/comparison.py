"""What a result says beside what is true."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from compass_ros.types import GENERAL

Json = Mapping[str, Any]
"""Content of a result.json that the schema has accepted, or of an answer whose hash holds."""
_CENTRES = {"centre_x", "centre_y"}
_Z90 = 1.645
EXCESS = 1.02
"""Held-out error over the floor from which there is something to remove."""


@dataclass(frozen=True)
class ParameterCheck:
    """One quantity of a rightly named effect."""

    name: str
    truth: float
    found: float
    std: float
    error: float
    """|found - truth| over the size of the truth: the norm of all quantities of the effect that share its unit."""
    covered: bool
    """Whether the 90 % interval holds the truth."""


@dataclass(frozen=True)
class Comparison:
    """The marks of one result. None: does not apply."""

    kind: str
    truth: tuple[str, ...]
    twins: tuple[str, ...]
    """What these recordings cannot tell from the truth (of one effect), with the truth itself."""
    verdict: str
    found: tuple[str, ...]
    """Names of the fitted effects, then those said to be equivalent."""
    right: bool
    """The verdict that these recordings deserve: the effect or its class, both of two, none, unknown."""
    misnamed: bool
    """A name that is not in the class of any effect of this world."""
    first_right: bool | None
    """The first name is the truth, where the truth is alone in its class."""
    object_right: bool | None
    phase_right: bool | None
    channel_right: bool | None
    centre_error_m: float | None
    parameters: tuple[ParameterCheck, ...]
    gain: float | None
    """Share of the excess held-out error that the effects remove."""
    held_out_m: Mapping[str, float]
    """rms on held-out episodes by model, and `floor`: what noise alone made there."""
    left_m: float | None
    """What the calibrated parameters leave above the noise, rms over all episodes [m]: the best leave no more."""
    apart_m: float | None
    """What the nearest formula of the library leaves of an effect from outside it, rms [m]."""
    ordinary_z: float | None
    """Median |found - truth| / std of the cell's identifiable parameters."""

    def as_json(self) -> dict[str, object]:
        return asdict(self)


def compare(result: Json, answer: Json) -> Comparison:
    """Judge a result by the answer of its world."""
    kind, effects = str(answer["kind"]), answer["effects"]
    mismatch = result["mismatch"]
    verdict = str(mismatch["verdict"])
    sets = [{str(e["name"]), *e["equivalents"]} for e in mismatch["effects"]]
    classes = [{str(e["name"]), *e["twins"]} for e in effects if not e["outside"]]
    named = verdict in ("named", "ambiguous")
    right = _right(kind, verdict, sets, classes)
    allowed = set().union(*classes)
    first = str(mismatch["effects"][0]["name"]) if named and sets else ""
    single = effects[0] if len(effects) == 1 else None
    where = mismatch["where"]
    return Comparison(
        kind=kind,
        truth=tuple(str(e["name"]) for e in effects),
        twins=tuple(sorted(classes[0])) if len(classes) == 1 else (),
        verdict=verdict,
        found=tuple(dict.fromkeys(name for e in mismatch["effects"] for name in (e["name"], *e["equivalents"]))),
        right=right,
        misnamed=named and any(not one & allowed for one in sets),
        first_right=first == single["name"] if kind == "one" and single and len(classes[0]) == 1 else None,
        object_right=bool(where and where["object"] in single["objects_right"]) if single else None,
        phase_right=bool(where and general(where["phase"]) in map(general, single["phases_right"])) if single else None,
        channel_right=bool(where and where["channel"] in single["channels_right"]) if single else None,
        centre_error_m=_centre(single, mismatch, where) if single else None,
        parameters=tuple(check for e in effects for check in _parameters(e, mismatch["effects"])) if named else (),
        gain=_gain(result, answer) if effects else None,
        held_out_m=_held_out(result, answer),
        left_m=_left(result, answer),
        apart_m=single["nearest"]["left_m"] if kind == "outside" and single and single.get("nearest") else None,
        ordinary_z=ordinary(result["parameters"], answer["parameters"]),
    )


def judge_names(names: Sequence[str], answer: Json) -> tuple[bool, bool]:
    """Whether bare names are what these recordings deserve, and whether one of them is not in any true class."""
    classes = [{str(e["name"]), *e["twins"]} for e in answer["effects"] if not e["outside"]]
    right = _right(str(answer["kind"]), "named" if names else "none", [{name} for name in names], classes)
    return right, bool(set(names) - set().union(*classes))


def _right(kind: str, verdict: str, sets: Sequence[set[str]], classes: Sequence[set[str]]) -> bool:
    """One effect: the truth is among what is said, and nothing is said that is not in its class."""
    if kind == "none":
        return verdict == "none"
    if kind == "outside":
        return verdict == "unknown"
    if verdict not in ("named", "ambiguous") or len(sets) != len(classes):
        return False
    orders = [(0,)] if len(classes) == 1 else [(0, 1), (1, 0)]
    return any(all(sets[i] <= classes[k] for i, k in enumerate(order)) for order in orders)


def general(phase: str) -> str:
    """The word of today for a phase; answers that were sealed before have a table's."""
    return GENERAL.get(phase, phase)


def _centre(truth: Json, mismatch: Json, where: Json | None) -> float | None:
    """Distance of the centre: of the effect where it is named, else of the region."""
    if truth["centre_m"] is None:
        return None
    for effect in mismatch["effects"]:
        if effect["name"] == truth["name"] and effect["parameters"].keys() >= _CENTRES:
            found = [effect["parameters"][name]["value"] for name in sorted(_CENTRES)]
            return float(np.hypot(found[0] - truth["centre_m"][0], found[1] - truth["centre_m"][1]))
    if where and where["region"]:
        centre = where["region"]["centre_m"]
        return float(np.hypot(centre[0] - truth["centre_m"][0], centre[1] - truth["centre_m"][1]))
    return None


def _parameters(truth: Json, found: Sequence[Json]) -> list[ParameterCheck]:
    """The quantities of an effect that has the right name; a centre is judged by its distance instead."""
    for effect in found:
        if effect["name"] != truth["name"]:
            continue
        fitted = {n for n, quantity in effect["parameters"].items() if quantity["value"] is not None} - _CENTRES
        shared = {n: v for n, v in truth["library"].items() if n in fitted}
        units = {name: effect["parameters"][name]["unit"] for name in shared}
        checks = []
        for name, value in shared.items():
            size = float(np.linalg.norm([v for n, v in shared.items() if units[n] == units[name]]))
            estimate = effect["parameters"][name]
            gap, std = abs(estimate["value"] - value), float(estimate["std"] or 0.0)
            if size > 0:
                label = f"{truth['name']}.{name}"
                checks.append(ParameterCheck(label, value, estimate["value"], std, gap / size, gap <= _Z90 * std))
        return checks
    return []


def _held_out(result: Json, answer: Json) -> dict[str, float]:
    """rms of each model on the held-out episodes, and what noise alone made in them."""
    models = {name: result["gap"][name] for name in ("nominal", "calibrated", "with_effects")}
    out = {
        name: float(model["held_out"]["rmse_m"])
        for name, model in models.items()
        if model and model["held_out"] and model["held_out"]["rmse_m"] is not None
    }
    known = answer["noise_floor_m"]
    floors = [known[name] for name in result["episodes"]["held_out"] if name in known]
    return out | ({"floor": float(np.sqrt(np.mean(np.square(floors))))} if floors else {})


def _left(result: Json, answer: Json) -> float | None:
    """Excess of the calibrated simulator without effects over what noise alone made; None where it was not judged."""
    gaps, squares, count = result["gap"]["calibrated"] or {}, 0.0, 0
    for part in ("fit", "held_out"):
        floors = [answer["noise_floor_m"].get(name) for name in result["episodes"][part]]
        if not floors:
            continue
        if None in floors or not gaps.get(part) or gaps[part]["rmse_m"] is None:
            return None
        squares += len(floors) * gaps[part]["rmse_m"] ** 2 - float(np.sum(np.square(floors)))
        count += len(floors)
    return float(np.sqrt(max(squares, 0.0) / count)) if count else None


def _gain(result: Json, answer: Json) -> float | None:
    """(calibrated - with effects) / (calibrated - floor); no model with effects removes nothing."""
    rms = _held_out(result, answer)
    if not {"calibrated", "floor"} <= rms.keys() or rms["calibrated"] <= EXCESS * rms["floor"]:
        return None
    return (rms["calibrated"] - rms.get("with_effects", rms["calibrated"])) / (rms["calibrated"] - rms["floor"])


def ordinary(rows: Sequence[Json], truth: Mapping[str, float]) -> float | None:
    """Median distance of identifiable parameters from the truth, in their error bars; None: none is identifiable."""
    z = [
        abs(row["value"] - truth[row["name"]]) / row["std"]
        for row in rows
        if row["identifiable"] and row["std"] and row["value"] is not None and row["name"] in truth
    ]
    return float(np.median(z)) if z else None
