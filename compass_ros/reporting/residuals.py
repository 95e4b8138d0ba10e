"""Where and when the simulator and the recordings differ, as numbers that terminal and figures both draw."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from compass_ros.reporting.drawing import distance_map, error_m, in_place, plane
from compass_ros.reporting.extras import ReportExtras, ResidualMap
from compass_ros.reporting.words import MODELS, Model
from compass_ros.types import Floats, Replay, Result


@dataclass(frozen=True)
class ErrorCurve:
    """How far one model is from the recordings of one object, over the episode."""

    object: str
    model: Model
    time_s: Floats
    """(B,) centres of equal intervals since its beginning."""
    rms_m: Floats
    """(B,) over all episodes; NaN where nothing was seen."""


def error_curves(result: Result, bins: int = 40) -> tuple[ErrorCurve, ...]:
    """One curve for each object and model that was run; held-out episodes, or all where none was held out."""
    replays = judged(result.replays)
    objects = list(dict.fromkeys(track.object for replay in replays for track in replay.tracks))
    end = max((float(t.time_s[-1]) for r in replays for t in r.tracks if t.time_s.size), default=1.0)
    edges = np.linspace(0.0, max(end, 1e-9), bins + 1)
    curves = []
    for name in objects:
        tracks = [track for replay in replays for track in replay.tracks if track.object == name]
        for model in MODELS:
            pairs = [(t.time_s, e) for t, e in ((t, error_m(t, model)) for t in tracks) if e is not None]
            if not pairs:
                continue
            time, error = (np.concatenate(part) for part in zip(*pairs, strict=True))
            keep = np.isfinite(error) & (time >= 0)
            square = np.histogram(time[keep], edges, weights=error[keep] ** 2)[0]
            count = np.histogram(time[keep], edges)[0]
            rms = np.sqrt(np.where(count > 0, square / np.maximum(count, 1), np.nan))
            curves.append(ErrorCurve(name, model, (edges[:-1] + edges[1:]) / 2, rms))
    return tuple(curves)


def judged(replays: Sequence[Replay]) -> tuple[Replay, ...]:
    """Held-out episodes; all of them where none was held out."""
    return tuple(r for r in replays if r.held_out) or tuple(replays)


def left_over(result: Result, extras: ReportExtras) -> ResidualMap | None:
    """What the calibrated simulator leaves over, without effects; None where no planar motion was recorded."""
    placed = in_place(result)
    return extras.residual_before or distance_map(placed, "calibrated", plane(placed))
