"""The gap in words and places: the headline figure, the table by factor, the episodes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from compass_ros.reporting.drawing import MAX_REPLAYS, chosen, episode_rmse
from compass_ros.reporting.numbers import plain, thousandths
from compass_ros.reporting.words import MODEL_LABEL, MODELS, best_model, fit_rmse, held_out_rmse
from compass_ros.types import Result

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

    def ticks(self, unit: str) -> list[tuple[float, str]]:
        """(place, label in thousandths of the unit) of the powers of ten in range."""
        powers = range(math.ceil(self.low), math.floor(self.high) + 1)
        return [(self.place(10.0**p) or 0.0, f"{10.0 ** (p + 3):g} m{unit}") for p in powers]


def ladder(result: Result) -> dict[str, Any]:
    """The headline figure: held-out error of each model beside the noise floor, on a logarithmic line."""
    models = [m for m in MODELS if m in result.gap]
    scale = LogScale([*(held_out_rmse(result, m) for m in models), result.noise_floor_m])
    rows = []
    for model in models:
        error = held_out_rmse(result, model)
        rows.append(
            {
                "key": model,
                "label": MODEL_LABEL[model],
                "place": scale.place(error),
                "text": thousandths(error),
                "fit": thousandths(fit_rmse(result, model)),
                "times": _times(error / result.noise_floor_m) if result.noise_floor_m > 0 else "",
            }
        )
    return {
        "rows": rows,
        "ticks": scale.ticks(result.unit),
        "floor": scale.place(result.noise_floor_m),
        "floor_text": thousandths(result.noise_floor_m),
    }


def _times(ratio: float) -> str:
    return f"{ratio:.{0 if ratio >= 10 else 1}f} {TIMES} floor" if math.isfinite(ratio) else ""


def factor_table(result: Result) -> list[dict[str, Any]]:
    """Mean trajectory difference by factor on held-out (and fitted) episodes [m]."""
    rows = []
    for factor in result.graph.factors:
        cells = []
        for model in MODELS:
            for part in ("held_out", "fit"):
                gap = result.gap.get(model, {}).get(part)
                cells.append(plain(gap.d.get(factor, math.nan), 3) if gap is not None else plain(math.nan))
        rows.append({"factor": factor, "cells": cells})
    return rows


def episodes(result: Result) -> dict[str, Any]:
    """The episode selector: error of each model in each episode, on one logarithmic line."""
    replays = chosen(result.replays)
    errors = {(i, m): episode_rmse(r, m) for i, r in enumerate(replays) for m in MODELS}
    scale = LogScale([*errors.values(), result.noise_floor_m])
    best = best_model(result)
    rows = [
        {
            "index": i,
            "name": replay.episode,
            "held_out": replay.held_out,
            "dots": [
                {"key": m, "place": scale.place(errors[i, m])} for m in MODELS if scale.place(errors[i, m]) is not None
            ],
            "text": thousandths(errors[i, best]),
        }
        for i, replay in enumerate(replays)
    ]
    left_out = max(len(result.replays) - MAX_REPLAYS, 0)
    ticks, floor = scale.ticks(result.unit), scale.place(result.noise_floor_m)
    return {"rows": rows, "ticks": ticks, "floor": floor, "left_out": left_out}
