"""The numbers behind the report's interactive figures, as JSON. The drawing itself is in `templates/*.js`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from compass_ros.reporting.extras import ReportExtras, ResidualMap, Scene
from compass_ros.reporting.tracks import drawn
from compass_ros.reporting.windows import began, word
from compass_ros.reporting.words import MODEL_LABEL, MODELS, Model, best_model, told
from compass_ros.types import Floats, Replay, ReplayedTrack, Result

MAX_REPLAYS = 48
"""Episodes drawn at most; a report stays small enough to be sent by mail."""
GRID_M = 0.02
"""Cell of the residual map."""
MAX_GRID = 80
"""Cells of the residual map along one side at most."""


def numbers(values: Floats, decimals: int = 5) -> list[float | None]:
    """A list for JSON: rounded (5 decimals are 10 micrometres), null where not finite."""
    return [round(v, decimals) if math.isfinite(v) else None for v in np.asarray(values, dtype=np.float64).tolist()]


def position(values: Floats) -> Floats:
    """(F, D) -> (F, min(D, 3)): the position without orientation."""
    return values[:, :3]


def error_m(track: ReplayedTrack, model: str) -> Floats | None:
    """(F,) distance between the recorded and the simulated position [m]; None where the model was not run."""
    simulated = {"nominal": track.nominal, "calibrated": track.calibrated, "with_effects": track.with_effects}[model]
    if simulated is None:
        return None
    return np.asarray(np.linalg.norm(position(simulated) - position(track.real), axis=1))


def episode_rmse(replay: Replay, model: str) -> float:
    """Root mean square distance over the frames and objects of one episode [m]; NaN where the model was not run."""
    parts = [e for e in (error_m(track, model) for track in replay.tracks) if e is not None]
    squares = np.concatenate(parts) ** 2 if parts else np.empty(0)
    squares = squares[np.isfinite(squares)]
    return float(np.sqrt(squares.mean())) if squares.size else float("nan")


def plane(replays: Sequence[Replay]) -> tuple[int, int]:
    """The two coordinates to draw: x and y, or those with the widest motion where all that have a place are spatial."""
    placed = [t.real[:, :3] for replay in replays for t in replay.tracks if t.real.shape[1] >= 2]
    spatial = [real for real in placed if real.shape[1] == 3]
    if len(spatial) < max(len(placed), 1):
        return 0, 1
    everything = np.concatenate(spatial)
    spread = np.nanmax(everything, axis=0) - np.nanmin(everything, axis=0)
    first, second = sorted(np.argsort(-spread, kind="stable")[:2].tolist())
    return first, second


def worst_first(replays: Sequence[Replay], model: Model) -> tuple[Replay, ...]:
    """Held-out episodes before fitted ones, of each the one that `model` predicts worst first."""
    return tuple(sorted(replays, key=lambda r: (not r.held_out, -_badness(r, model))))


def _badness(replay: Replay, model: Model) -> float:
    """Error of an episode; a simulator that lost all that it should follow has none and is the worst."""
    error = episode_rmse(replay, model)
    return error if math.isfinite(error) else math.inf


def in_place(result: Result) -> tuple[Replay, ...]:
    """Replays with those tracks alone that say where something is."""
    return tuple(replace(r, tracks=tuple(t for t in r.tracks if not drawn(t, result).columns)) for r in result.replays)


def chosen(result: Result) -> tuple[tuple[Replay, ...], tuple[Replay, ...]]:
    """Episodes that are drawn, MAX_REPLAYS at most, and those that are not: with the smallest errors."""
    ordered = worst_first(result.replays, best_model(result))
    return ordered[:MAX_REPLAYS], ordered[MAX_REPLAYS:]


def _path(values: Floats | None, axes: Sequence[int]) -> list[list[float | None]] | None:
    return None if values is None else [numbers(values[:, axis]) for axis in axes]


def _track(track: ReplayedTrack, result: Result, plane_axes: tuple[int, int]) -> dict[str, Any]:
    """One object in the plane, or all numbers of one signal."""
    shown = drawn(track, result)
    axes = range(len(shown.columns)) if shown.columns else plane_axes
    errors = {model: error_m(track, model) for model in MODELS}
    return {
        "object": track.object,
        "columns": [{"name": column.name, "unit": column.unit} for column in shown.columns],
        "error_unit": shown.thousandth,
        "floor_mm": shown.floor * 1e3 if math.isfinite(shown.floor) else None,
        "time": numbers(track.time_s, 4),
        "real": _path(track.real, axes),
        "nominal": _path(track.nominal, axes),
        "calibrated": _path(track.calibrated, axes),
        "with_effects": _path(track.with_effects, axes),
        "error_mm": {m: None if e is None else numbers(e * 1e3, 3) for m, e in errors.items()},
    }


def _replay(replay: Replay, result: Result, axes: tuple[int, int]) -> dict[str, Any]:
    tracks = [_track(track, result, axes) for track in replay.tracks]
    return {"name": replay.episode, "held_out": replay.held_out, "tracks": tracks}


def _scene(scene: Scene | None) -> dict[str, Any]:
    if scene is None:
        return {"shapes": [], "radius": {}}
    shapes = [{"kind": s.kind, "role": s.role, "centre": s.centre_m, "size": s.size_m} for s in scene.shapes]
    return {"shapes": shapes, "radius": dict(scene.radius_m)}


def distance_map(replays: Sequence[Replay], model: str, axes: tuple[int, int]) -> ResidualMap | None:
    """Mean distance [mm] between recording and simulation, over where the object was.

    None where no planar motion was replayed or the model was not run.
    """
    points, distances = [], []
    for track in (t for replay in replays for t in replay.tracks):
        error = error_m(track, model)
        if error is None or track.real.shape[1] < 2:
            continue
        seen = np.isfinite(error)
        points.append(track.real[seen][:, list(axes)])
        distances.append(error[seen] * 1e3)
    if not points or not sum(map(len, points)):
        return None
    xy = np.concatenate(points)
    low, high = xy.min(axis=0), xy.max(axis=0)
    step = max(GRID_M, float((high - low).max()) / MAX_GRID)
    edges = [np.arange(np.floor(lo / step) * step, hi + step, step) for lo, hi in zip(low, high, strict=True)]
    edges = [edge if edge.size > 1 else np.append(edge, edge[-1] + step) for edge in edges]
    total, _, _ = np.histogram2d(xy[:, 0], xy[:, 1], bins=edges, weights=np.concatenate(distances))
    count, _, _ = np.histogram2d(xy[:, 0], xy[:, 1], bins=edges)
    value = np.where(count > 0, total / np.maximum(count, 1), np.nan)
    centres = [(edge[:-1] + edge[1:]) / 2 for edge in edges]
    return ResidualMap("mean distance between simulation and recording", "mm", centres[0], centres[1], value.T)


def _map(residual: ResidualMap | None) -> dict[str, Any] | None:
    if residual is None:
        return None
    return {
        "label": residual.label,
        "unit": residual.unit,
        "x": numbers(residual.x_m, 4),
        "y": numbers(residual.y_m, 4),
        "value": [numbers(row, 4) for row in residual.value],
    }


def _iterations(result: Result, extras: ReportExtras) -> dict[str, Any]:
    rows = [(i, row) for i, row in enumerate(result.parameters) if told(row)]
    traced = [it for it in result.trace if it.values.size == len(result.parameters)]
    parameters = [
        {
            "name": row.name,
            "unit": row.unit,
            "default": row.default,
            "bounds": numbers(np.asarray(row.bounds), 9),
            "value": row.value if math.isfinite(row.value) else None,
            "std": row.std if math.isfinite(row.std) else None,
            "truth": extras.truth.get(row.name),
            "identifiable": row.identifiable,
            "path": numbers(np.array([it.values[i] for it in traced]), 9),
        }
        for i, row in rows
    ]
    factors = result.graph.factors
    differences = [it for it in result.trace if it.difference.size == len(factors)]
    sparsity = [float(np.mean(it.psi < result.graph.threshold)) if it.psi.size else None for it in result.trace]
    return {
        "rollouts": [it.rollouts for it in traced],
        "parameters": parameters,
        "difference_unit": result.unit,
        "difference_rollouts": [it.rollouts for it in differences],
        "difference": {f: numbers(np.array([it.difference[k] for it in differences])) for k, f in enumerate(factors)},
        "sparsity": sparsity,
    }


def figure_data(result: Result, extras: ReportExtras) -> dict[str, Any]:
    """Everything that the report's scripts draw."""
    placed = in_place(result)
    axes = plane(placed)
    before = extras.residual_before or distance_map(placed, "calibrated", axes)
    after = extras.residual_after if extras.residual_before else distance_map(placed, "with_effects", axes)
    where = result.mismatch.where
    region = where.region if where is not None else None
    return {
        "models": [{"key": m, "label": MODEL_LABEL[m]} for m in MODELS if m in result.gap],
        "word": word(result),
        "began": began(result, extras.scene),
        "axes": ["xyz"[axis] for axis in axes],
        "scene": _scene(extras.scene),
        "episodes": [_replay(replay, result, axes) for replay in chosen(result)[0]],
        "calibration": _iterations(result, extras),
        "maps": {"before": _map(before), "after": _map(after)},
        "region": None if region is None else {"centre": region.centre_m, "radius": region.radius_m},
    }
