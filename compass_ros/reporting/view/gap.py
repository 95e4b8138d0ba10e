"""The gap in words and places: the headline figure, the table by factor, the episodes."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from compass_ros.reporting.drawing import chosen, episode_rmse
from compass_ros.reporting.numbers import plain, thousandths, unit_text
from compass_ros.reporting.windows import by_recording, counted, word
from compass_ros.reporting.words import MODEL_LABEL, MODELS, Model, best_model, fit_rmse, held_out_rmse
from compass_ros.types import Gap, Replay, Result

SMALL = ("m", "rad")
"""Units of which errors are shown in thousandths."""
TIMES = "\N{MULTIPLICATION SIGN}"


class LogScale:
    """Places positive numbers on a logarithmic line from 0 to 100 %, with ticks at 1, 2, 5 times powers of ten."""

    def __init__(self, values: Sequence[float]) -> None:
        usable = [v for v in values if math.isfinite(v) and v > 0] or [1e-3]
        self.low, self.high = math.log10(min(usable)) - 0.12, math.log10(max(usable)) + 0.12
        if self.high - self.low < 1.0:
            self.high = self.low + 1.0

    def place(self, value: float) -> float | None:
        if not (math.isfinite(value) and value > 0):
            return None
        return round(100 * (math.log10(value) - self.low) / (self.high - self.low), 2)

    def ticks(self, unit: str = "") -> list[tuple[float, str]]:
        """(place, label in thousandths) of the powers of ten in range; with the unit, where one is given."""
        powers, said = range(math.ceil(self.low), math.floor(self.high) + 1), f" m{unit}" if unit else ""
        return [(self.place(10.0**p) or 0.0, f"{10.0 ** (p + 3):g}{said}") for p in powers]


def ladder(result: Result) -> dict[str, Any]:
    """The headline figure: error of each model beside the noise floor, on a logarithmic line.

    On held-out episodes where there are any, else on the fitted ones.
    """
    models = [m for m in MODELS if m in result.gap]
    unseen = bool(result.held_out)
    errors = {m: held_out_rmse(result, m) if unseen else fit_rmse(result, m) for m in models}
    scale = LogScale([*errors.values(), result.noise_floor_m])
    rows = []
    for model, error in errors.items():
        rows.append(
            {
                "key": model,
                "label": MODEL_LABEL[model],
                "place": scale.place(error),
                "text": thousandths(error),
                "held_out": thousandths(held_out_rmse(result, model)),
                "fit": thousandths(fit_rmse(result, model)),
                "times": _times(error / result.noise_floor_m) if result.noise_floor_m > 0 else "",
            }
        )
    return {
        "on": f"{word(result)}s that were never fitted"
        if unseen
        else f"the fitted {word(result)}s, for none was held out",
        "rows": rows,
        "ticks": scale.ticks(result.unit),
        "floor": scale.place(result.noise_floor_m),
        "floor_text": thousandths(result.noise_floor_m),
    }


def _times(ratio: float) -> str:
    return f"{ratio:.{0 if ratio >= 10 else 1}f} {TIMES} floor" if math.isfinite(ratio) else ""


def factor_table(result: Result) -> list[dict[str, Any]]:
    """Mean trajectory difference by factor on held-out (and fitted) episodes [m or rad]."""
    rows = []
    for factor in result.graph.factors:
        cells = []
        for model in MODELS:
            for part in ("held_out", "fit"):
                gap = result.gap.get(model, {}).get(part)
                cells.append(plain(gap.d.get(factor, math.nan), 3) if gap is not None else plain(math.nan))
        rows.append({"factor": factor, "cells": cells})
    return rows


def signals(result: Result) -> dict[str, Any]:
    """Error of each signal, and of each joint of it, in floors on one logarithmic line: before and after.

    On held-out episodes where there are any, else on the fitted ones; without rows where no signal is told apart.
    """
    of_models = {m: parts["held_out"] if "held_out" in parts else parts["fit"] for m, parts in result.gap.items()}
    found = _signals(of_models)
    errors = {(s, part, m): _error(gap, s, part) for m, gap in of_models.items() for s, part, _ in found}
    scale = LogScale([1.0, *(errors[s, part, m] / floor for s, part, floor in found for m in of_models)])
    rows = [
        {
            "name": part or s,
            "part": bool(part),
            "unit": _shown(of_models["nominal"].signals[s].unit),
            "dots": [
                {"key": m, "place": place}
                for m in MODELS
                if m in of_models and (place := scale.place(errors[s, part, m] / floor)) is not None
            ],
            "numbers": [
                _digits(errors.get((s, part, m), math.nan), of_models["nominal"].signals[s].unit) for m in MODELS
            ],
            "floor": _digits(floor, of_models["nominal"].signals[s].unit),
        }
        for s, part, floor in found
    ]
    unseen = all("held_out" in parts for parts in result.gap.values())
    on = f"{word(result)}s that were never fitted" if unseen else f"the fitted {word(result)}s"
    return {"rows": rows if len(rows) > 1 else [], "floor": scale.place(1.0), "on": on}


def _shown(unit: str) -> str:
    """The unit in which an error is shown: mm and mrad, else its own."""
    return f"m{unit}" if unit in SMALL else unit_text(unit)


def _digits(error: float, unit: str) -> str:
    """An error in the unit in which it is shown."""
    return thousandths(error) if unit in SMALL else plain(error, 3)


def _signals(of_models: Mapping[Model, Gap]) -> list[tuple[str, str, float]]:
    """Signal, joint or nothing, noise floor; the joints of a signal after it."""
    nominal = of_models["nominal"].signals if "nominal" in of_models else {}
    floors = {name: one.floor if one.floor > 0 else math.nan for name, one in nominal.items()}
    return [(name, part, floors[name]) for name, one in nominal.items() for part in ("", *one.parts)]


def _error(gap: Gap, signal: str, part: str) -> float:
    one = gap.signals.get(signal)
    if one is None:
        return math.nan
    return one.parts.get(part, math.nan) if part else one.rms


def episodes(result: Result) -> dict[str, Any]:
    """The episode selector: error of each model in each episode, on one logarithmic line; the worst ones first."""
    replays, others = chosen(result)
    errors = {(i, m): episode_rmse(r, m) for i, r in enumerate(replays) for m in MODELS}
    scale = LogScale([*errors.values(), result.noise_floor_m])
    best = best_model(result)
    rows = [
        {
            "index": i,
            "name": replay.episode,
            **_who(replay),
            "dots": [
                {"key": m, "place": scale.place(errors[i, m])} for m in MODELS if scale.place(errors[i, m]) is not None
            ],
            "text": thousandths(errors[i, best]),
        }
        for i, replay in enumerate(replays)
    ]
    ticks, floor = scale.ticks(), scale.place(result.noise_floor_m)  # the column's head has the unit
    order = f"Held-out {word(result)}s first, then fitted ones; of each the one with the largest error "
    order += f"({MODEL_LABEL[best]}, rms) on top."
    return {"rows": rows, "ticks": ticks, "floor": floor, "order": order, "not_drawn": _not_drawn(others, word(result))}


def _who(replay: Replay) -> dict[str, str]:
    """Its recording, and in small type where in it a window begins and whether it was held out."""
    ((recording, start),) = by_recording([replay.episode])
    return {"recording": recording, "note": ", ".join(filter(None, [start, "held out" if replay.held_out else ""]))}


def _not_drawn(replays: Sequence[Replay], what: str) -> str:
    """How many episodes are not drawn, and which; empty where all are."""
    if not replays:
        return ""
    unseen, one = sum(replay.held_out for replay in replays), len(replays) == 1
    which = f"those fitted, and {unseen} held out" if 0 < unseen < len(replays) else "held out" if unseen else "fitted"
    smallest = f"with the smallest error{'' if one else 's'}"
    return f"{counted(len(replays), f'further {what}')} {'is' if one else 'are'} not drawn: {which}, {smallest}."
