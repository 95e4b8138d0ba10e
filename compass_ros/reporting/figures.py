"""Still figures for documents, in one style. Each function returns a figure; `save` writes it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any, cast

import numpy as np
from matplotlib import rc_context
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Patch, Rectangle

from compass_ros.reporting.drawing import plane
from compass_ros.reporting.extras import Scene, Shape
from compass_ros.reporting.numbers import unit_text, with_unit
from compass_ros.reporting.palette import LIGHT
from compass_ros.reporting.words import MODEL_LABEL, MODELS, Model, held_out_rmse, told
from compass_ros.types import Floats, Graph, Replay, ReplayedTrack, Result

STYLE: Mapping[str, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 8.5,
    "axes.titlesize": 9,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.labelcolor": LIGHT["soft"],
    "axes.edgecolor": LIGHT["line"],
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "grid.color": LIGHT["grid"],
    "text.color": LIGHT["ink"],
    "xtick.color": LIGHT["faint"],
    "ytick.color": LIGHT["faint"],
    "xtick.major.size": 0,
    "ytick.major.size": 0,
    "legend.frameon": False,
    "lines.solid_capstyle": "round",
    "savefig.dpi": 160,
    "svg.hashsalt": "compass",
}
LINE: Mapping[Model, str] = {"nominal": ":", "calibrated": "--", "with_effects": "-"}
ROLE: Mapping[str, Mapping[str, Any]] = {
    "table": {"fill": False, "edgecolor": LIGHT["faint"], "linewidth": 1.0},
    "obstacle": {"facecolor": LIGHT["faint"], "alpha": 0.4},
    "goal": {"facecolor": LIGHT["ink"], "alpha": 0.06},
}


def styled() -> AbstractContextManager[None]:
    """The style of all figures, while the context is open."""
    return rc_context(cast(Any, STYLE))


def save(figure: Figure, path: Path) -> None:
    """Write PNG or SVG after the ending of the path; the same figure gives the same bytes."""
    metadata = {"Date": None} if path.suffix == ".svg" else {}
    with styled():
        figure.savefig(path, metadata=metadata)


def _path(track: ReplayedTrack, model: Model) -> Floats | None:
    return {"nominal": track.nominal, "calibrated": track.calibrated, "with_effects": track.with_effects}[model]


def trajectories(replay: Replay, scene: Scene | None = None) -> Figure:
    """One episode seen from above: recorded points, and each model's path. Needs planar tracks."""
    first, second = plane([replay])
    with styled():
        figure = Figure(figsize=(6.4, 3.6), layout="constrained")
        axes = figure.add_subplot()
        axes.grid(visible=False)
        shapes = scene.shapes if scene else ()
        patches = [axes.add_patch(_patch(shape)) for shape in shapes]
        table = next((patch for shape, patch in zip(shapes, patches, strict=True) if shape.role == "table"), None)
        for patch in patches if table is not None else ():
            patch.set_clip_path(table)
        for i, track in enumerate(replay.tracks):
            recorded = "recorded" if i == 0 else None
            axes.scatter(
                track.real[:, first], track.real[:, second], s=9, color=LIGHT["real"], alpha=0.3, lw=0, label=recorded
            )
            start = (float(track.real[0, first]), float(track.real[0, second]))
            axes.annotate(track.object, start, (5, 5), textcoords="offset points", color=LIGHT["soft"])
            for model in MODELS:
                path = _path(track, model)
                if path is not None:
                    xy = path[:, [first, second]].T
                    name = MODEL_LABEL[model] if i == 0 else None
                    axes.plot(*xy, LINE[model], color=LIGHT[model], lw=1.4, label=name)
        if table is not None:
            box = table.get_extents().transformed(axes.transData.inverted())
            axes.set(xlim=(box.x0 - 0.01, box.x1 + 0.01), ylim=(box.y0 - 0.01, box.y1 + 0.01))
        axes.set_aspect("equal")
        axes.set_xlabel(f"{'xyz'[first]} [m]")
        axes.set_ylabel(f"{'xyz'[second]} [m]")
        figure.legend(loc="outside upper left", ncols=4)
    return figure


def _patch(shape: Shape) -> Patch:
    (x, y), (width, height) = shape.centre_m, shape.size_m
    if shape.kind == "circle":
        return Circle((x, y), width / 2, **ROLE[shape.role])
    return Rectangle((x - width / 2, y - height / 2), width, height, **ROLE[shape.role])


def causal_graph(graph: Graph, rows: int = 24) -> Figure:
    """psi of the `rows` parameters with the strongest edges, strongest on top."""
    order = np.argsort(-graph.psi.max(axis=1), kind="stable")[:rows]
    colours = LinearSegmentedColormap.from_list("psi", [LIGHT["sunken"], LIGHT["heat"]])
    with styled():
        figure = Figure(figsize=(3.2 + 0.7 * len(graph.factors), 0.8 + 0.22 * order.size), layout="constrained")
        axes = figure.add_subplot()
        axes.grid(visible=False)
        image = axes.imshow(graph.psi[order], cmap=colours, vmin=0, vmax=1, aspect="auto")
        axes.set_xticks(range(len(graph.factors)), graph.factors)
        axes.set_yticks(range(order.size), [graph.parameters[i] for i in order], family="DejaVu Sans Mono", size=7)
        axes.xaxis.tick_top()
        figure.colorbar(image, label="ψ", shrink=0.6)
    return figure


def parameter_curves(result: Result, most: int = 12, truth: Mapping[str, float] | None = None) -> Figure:
    """How what was wrong or matters moved; dashed the default, dotted the truth, the band one standard deviation."""
    known, traced = truth or {}, [it for it in result.trace if it.values.size == len(result.parameters)]
    shown = [(i, row) for i, row in enumerate(result.parameters) if told(row)][:most]
    columns, rollouts = min(3, max(len(shown), 1)), [it.rollouts for it in traced]
    with styled():
        figure = Figure(figsize=(2.5 * columns, 1.6 * max(math.ceil(len(shown) / columns), 1)), layout="constrained")
        for place, (i, row) in enumerate(shown):
            axes = figure.add_subplot(math.ceil(len(shown) / columns), columns, place + 1)
            unit = unit_text(row.unit)
            axes.set_title(f"{row.name} [{unit}]" if unit else row.name, fontsize=7)
            if math.isfinite(row.std):
                axes.axhspan(row.value - row.std, row.value + row.std, color=LIGHT["calibrated"], alpha=0.15, lw=0)
            axes.axhline(row.default, color=LIGHT["nominal"], ls="--", lw=1)
            if row.name in known:
                axes.axhline(known[row.name], color=LIGHT["ink"], ls=":", lw=1)
            axes.plot(rollouts, [it.values[i] for it in traced], "o-", color=LIGHT["calibrated"], ms=2.5, lw=1.3)
        figure.supxlabel("rollouts", fontsize=8, color=LIGHT["soft"])
    return figure


def gap_bars(result: Result) -> Figure:
    """Held-out error of each model beside the noise floor, on a logarithmic line."""
    models = [m for m in MODELS if math.isfinite(held_out_rmse(result, m))]
    errors = [held_out_rmse(result, m) * 1e3 for m in models]
    floor = result.noise_floor_m * 1e3
    with styled():
        figure = Figure(figsize=(6.0, 0.75 + 0.36 * len(models)), layout="constrained")
        axes = figure.add_subplot()
        axes.grid(visible=False, axis="y")
        start = floor if math.isfinite(floor) else min(errors, default=1.0)
        for place, (model, error) in enumerate(zip(models, errors, strict=True)):
            axes.plot([start, error], [place, place], color=LIGHT[model], alpha=0.35, lw=3)
            axes.plot(error, place, "o", color=LIGHT[model], ms=7)
            beside: dict[str, Any] = {"textcoords": "offset points", "va": "center", "weight": "bold"}
            axes.annotate(with_unit(error / 1e3, result.unit), (error, place), (8, 0), **beside)
        if math.isfinite(floor):
            axes.axvline(floor, color=LIGHT["faint"], ls=":", lw=1.5)
        axes.set_xscale("log")
        axes.minorticks_off()
        axes.set_yticks(range(len(models)), [MODEL_LABEL[m] for m in models])
        axes.set_ylim(len(models) - 0.5, -0.5)
        axes.margins(x=0.15)
        axes.set_xlabel(f"held-out error, rms [m{result.unit}]; dotted: noise floor")
        axes.xaxis.set_major_formatter("{x:g}")
    return figure
