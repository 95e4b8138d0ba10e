"""All still figures of one result, as files."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from compass_ros.reporting.drawing import episode_rmse, plane
from compass_ros.reporting.extras import ReportExtras, ResidualMap, Scene
from compass_ros.reporting.figures import LINE, causal_graph, gap_bars, parameter_curves, save, styled, trajectories
from compass_ros.reporting.numbers import unit_text
from compass_ros.reporting.palette import LIGHT
from compass_ros.reporting.residuals import error_curves, judged, left_over
from compass_ros.reporting.windows import began
from compass_ros.reporting.words import MODEL_LABEL, best_model, told
from compass_ros.types import Region, Replay, Result


def write_figures(result: Result, extras: ReportExtras, folder: Path) -> tuple[Path, ...]:
    """Draw what this result has, as PNG; returns the files. The folder must exist."""
    figures: dict[str, Figure] = {"gap": gap_bars(result)}
    if result.graph.psi.any():
        figures["causal_graph"] = causal_graph(result.graph)
    if any(told(row) for row in result.parameters) and result.trace:
        figures["parameters"] = parameter_curves(result, truth=extras.truth)
    if result.replays:
        figures["error_over_time"] = error_over_time(result, extras.scene)
    residual = left_over(result, extras)
    if residual is not None:
        where = result.mismatch.where
        figures["left_over"] = left_over_map(residual, where.region if where else None, plane(result.replays))
    worst = worst_replay(result)
    if worst is not None:
        figures[f"worst_{re.sub(r'[^A-Za-z0-9_.-]', '_', worst.episode)}"] = trajectories(worst, extras.scene)
    files = {folder / f"{name}.png": figure for name, figure in figures.items()}
    for path, figure in files.items():
        save(figure, path)
    return tuple(files)


def worst_replay(result: Result) -> Replay | None:
    """The judged episode with planar tracks that the best model predicts worst."""
    planar = [r for r in judged(result.replays) if r.tracks and all(t.real.shape[1] >= 2 for t in r.tracks)]
    errors = [(episode_rmse(r, best_model(result)), r) for r in planar]
    return max((pair for pair in errors if math.isfinite(pair[0])), key=lambda pair: pair[0], default=(0.0, None))[1]


def error_over_time(result: Result, scene: Scene | None = None) -> Figure:
    """Root mean square distance on held-out episodes over their time, one panel an object; dotted: the noise floor."""
    curves = error_curves(result)
    objects = list(dict.fromkeys(c.object for c in curves))
    with styled():
        figure = Figure(figsize=(6.4, 0.8 + 1.7 * max(len(objects), 1)), layout="constrained")
        for place, name in enumerate(objects):
            axes = figure.add_subplot(len(objects), 1, place + 1)
            axes.set_title(name)
            for curve in (c for c in curves if c.object == name):
                label = MODEL_LABEL[curve.model] if place == 0 else None
                axes.plot(curve.time_s, curve.rms_m * 1e3, LINE[curve.model], color=LIGHT[curve.model], label=label)
            if math.isfinite(result.noise_floor_m):
                axes.axhline(result.noise_floor_m * 1e3, color=LIGHT["faint"], ls=":", lw=1)
            axes.set_yscale("log")
            axes.set_ylabel(f"error [m{result.unit}]")
        figure.supxlabel(f"time since {began(result, scene)} [s]", fontsize=8, color=LIGHT["soft"])
        figure.legend(loc="outside upper right", ncols=3)
    return figure


def left_over_map(residual: ResidualMap, region: Region | None = None, axes_shown: tuple[int, int] = (0, 1)) -> Figure:
    """A residual over the plane of these two coordinates, with the region that the verdict names."""
    half = [float(np.diff(axis[:2])[0]) / 2 if axis.size > 1 else 0.01 for axis in (residual.x_m, residual.y_m)]
    x, y = residual.x_m, residual.y_m
    extent = (float(x[0]) - half[0], float(x[-1]) + half[0], float(y[0]) - half[1], float(y[-1]) + half[1])
    with styled():
        figure = Figure(figsize=(6.4, 3.6), layout="compressed")  # of a plane that is as wide as it is high
        axes = figure.add_subplot()
        axes.grid(visible=False)
        image = axes.imshow(residual.value, origin="lower", extent=extent, cmap="viridis", interpolation="nearest")
        if region is not None:
            axes.add_patch(Circle(region.centre_m, region.radius_m, fill=False, edgecolor=LIGHT["bad"], linewidth=1.5))
            (left, right, low, high), r = extent, 1.02 * region.radius_m
            axes.set_xlim(min(left, region.centre_m[0] - r), max(right, region.centre_m[0] + r))
            axes.set_ylim(min(low, region.centre_m[1] - r), max(high, region.centre_m[1] + r))
        axes.set_xlabel(f"{'xyz'[axes_shown[0]]} [m]")
        axes.set_ylabel(f"{'xyz'[axes_shown[1]]} [m]")
        axes.set_title(residual.label)
        figure.colorbar(image, label=unit_text(residual.unit), shrink=0.8)
    return figure
