"""Figures from the results of a benchmark, in the order of the paper's: parameters, differences, graphs, ablations."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from compass_ros.bench.case import Case
from compass_ros.bench.outcome import Row, case_of
from compass_ros.bench.table import held_out_difference
from compass_ros.cells import load
from compass_ros.types import Floats

COLOURS = dict(
    zip(
        ("compass", "causal-map", "npdr", "exi-net", "tune-net", "mujoco-sysid", "cma-es", "random"),
        ("#0072b2", "#000000", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#999999"),
        strict=True,
    )
)
"""Okabe and Ito's palette: told apart by colour-blind readers too."""


def write_figures(rows: Sequence[Row], out: Path) -> list[Path]:
    """Draw what the rows allow; returns the files written under `out` (PNG)."""
    out.mkdir(parents=True, exist_ok=True)
    written: list[Path] = []
    for task in sorted({case_of(r).task for r in rows}):
        own = [r for r in rows if case_of(r).task == task]
        stem = Path(task).stem
        for noise in sorted({case_of(r).noise_m for r in own}):
            usual = [r for r in own if case_of(r) == Case(task, case_of(r).method, case_of(r).seed, noise_m=noise)]
            if usual:
                mark = f"{stem}-noise-{1000 * noise:g}mm"
                written.append(_save(parameter_curves(usual, task), out / f"parameters-{mark}.png"))
                written.append(_save(difference_curves(usual), out / f"difference-{mark}.png"))
        graphs = [r for r in own if case_of(r) == Case(task, "compass", case_of(r).seed)]
        if graphs:
            written.append(_save(psi_over_iterations(graphs[0], task), out / f"psi-iterations-{stem}.png"))
        weighted = [r for r in own if case_of(r).method == "compass" and case_of(r).sparse_weight is not None]
        if weighted:
            written.append(_save(psi_over_weights(weighted, task), out / f"psi-weights-{stem}.png"))
        for field, values in (("real", (5, 10, 20)), ("sim", (32, 64, 128))):
            if _varied(own, field, values):
                written.append(_save(ablation(own, field, values), out / f"ablation-{field}-{stem}.png"))
        random = [r for r in own if case_of(r).start == "random"]
        if random:
            written.append(_save(difference_curves(random), out / f"difference-random-start-{stem}.png"))
    return written


def parameter_curves(rows: Sequence[Row], task: str) -> Figure:
    """The causal parameters against rollouts spent; mean line and standard deviation over seeds; dashed: the target."""
    names = _strings(rows[0], "causal")
    targets = {s.name: s.truth for s in load(task).spec.parameters}
    columns = min(4, len(names))
    lines = -(-len(names) // columns)
    figure = Figure(figsize=(3.4 * columns, 2.5 * lines), layout="constrained")
    axes = np.atleast_1d(np.array(figure.subplots(lines, columns, squeeze=False))).ravel()
    for i, name in enumerate(names):
        axes[i].axhline(targets[name], color="0.4", linestyle="--", linewidth=1)
        for method in _methods(rows):
            curves = [_steps(r, lambda step, i=i: step["values"][i]) for r in rows if case_of(r).method == method]
            _band(axes[i], curves, method)
        axes[i].set_title(name, fontsize=8)
        axes[i].tick_params(labelsize=7)
        if i + columns >= len(names):
            axes[i].set_xlabel("simulated rollouts", fontsize=8)
    for axis in axes[len(names) :]:
        axis.set_axis_off()
    _legend(figure, axes[0])
    return figure


def difference_curves(rows: Sequence[Row]) -> Figure:
    """Mean trajectory difference on the fitted shots against rollouts spent."""
    figure = Figure(figsize=(6, 3.6), layout="constrained")
    axis = figure.subplots()
    for method in _methods(rows):
        curves = [_steps(r, lambda s: float(np.mean(s["difference"]))) for r in rows if case_of(r).method == method]
        _band(axis, curves, method, logarithmic=True)
    axis.set_yscale("log")
    axis.set_xlabel("simulated rollouts")
    axis.set_ylabel("mean trajectory difference [m]")
    _legend(figure, axis)
    return figure


def psi_over_iterations(row: Row, task: str, shown: int = 6) -> Figure:
    """The learned graph after each iteration, factors as rows."""
    steps = [s for s in _trace(row) if np.size(s["psi"])][:shown]
    titles = [f"psi at iteration {i}" for i in range(len(steps))]
    return _graphs([np.array(s["psi"]) for s in steps], titles, _strings(row, "factors"), task)


def psi_over_weights(rows: Sequence[Row], task: str) -> Figure:
    """The graph after the first iteration for each sparsity weight, one seed."""
    ordered = {case_of(r).sparse_weight: r for r in sorted(rows, key=lambda r: -case_of(r).seed)}
    weights = sorted(w for w in ordered if w is not None)
    graphs = [np.array(_trace(ordered[w])[1]["psi"]) for w in weights]
    return _graphs(graphs, [f"lambda = {w:g}" for w in weights], _strings(rows[0], "factors"), task)


def ablation(rows: Sequence[Row], field: str, values: Sequence[int]) -> Figure:
    """Held-out trajectory difference of each method against N (`real`) or M (`sim`)."""
    figure = Figure(figsize=(5, 3.4), layout="constrained")
    axis = figure.subplots()
    chosen = _varied(rows, field, values)
    for method in _methods(chosen):
        points = [
            [held_out_difference(r) for r in chosen if case_of(r).method == method and getattr(case_of(r), field) == v]
            for v in values
        ]
        present = [(v, p) for v, p in zip(values, points, strict=True) if p]
        middle, spread = [float(np.mean(p)) for _, p in present], [float(np.std(p)) for _, p in present]
        axis.errorbar(
            [v for v, _ in present], middle, spread, marker="o", capsize=3, label=method, color=_colour(method)
        )
    axis.set_xticks(values)
    axis.set_yscale("log")
    axis.set_xlabel({"real": "recorded shots N", "sim": "rollouts M for each of them"}[field])
    axis.set_ylabel("held-out trajectory difference [m]")
    _legend(figure, axis)
    return figure


def _varied(rows: Sequence[Row], field: str, values: Sequence[int]) -> list[Row]:
    """Rows that differ from the main experiment in nothing but `field`; empty unless more than one value is there."""
    chosen = [
        r
        for r in rows
        for case in (case_of(r),)
        if getattr(case, field) in values
        and case == Case(case.task, case.method, case.seed, case.iterations, **{field: getattr(case, field)})
    ]
    return chosen if len({getattr(case_of(r), field) for r in chosen}) > 1 else []


def _graphs(graphs: Sequence[Floats], titles: Sequence[str], factors: Sequence[str], task: str) -> Figure:
    names = [p.name for p in load(task).parameters]
    figure = Figure(figsize=(0.17 * len(names) + 1.5, 0.5 * len(graphs) * len(factors) + 2.6), layout="constrained")
    axes = np.array(figure.subplots(len(graphs), 1, squeeze=False, sharex=True)).ravel()
    for axis, psi, title in zip(axes, graphs, titles, strict=True):
        axis.imshow(psi.T, vmin=0, vmax=1, cmap="Greens", aspect="auto", interpolation="nearest")
        axis.set_yticks(range(len(factors)), factors, fontsize=7)
        axis.set_title(title, fontsize=8, loc="left")
    axes[-1].set_xticks(range(len(names)), names, rotation=90, fontsize=5)
    return figure


def _band(axis: Axes, curves: Sequence[Floats], method: str, logarithmic: bool = False) -> None:
    """Mean and standard deviation of (steps, 2) curves (rollouts, value), or of their logarithms.

    A value is held until it changes.
    """
    if not curves:
        return
    at = np.unique(np.concatenate([c[:, 0] for c in curves]))
    held = np.stack([c[np.maximum(np.searchsorted(c[:, 0], at, side="right") - 1, 0), 1] for c in curves])
    held = np.log(held) if logarithmic else held
    middle, spread = held.mean(axis=0), held.std(axis=0)
    lines = [middle, middle - spread, middle + spread]
    middle, low, high = np.exp(lines) if logarithmic else lines
    axis.plot(at, middle, label=method, color=_colour(method), linewidth=1.2)
    axis.fill_between(at, low, high, color=_colour(method), alpha=0.15, linewidth=0)


def _steps(row: Row, read: Any) -> Floats:
    return np.array([[s["rollouts"], read(s)] for s in _trace(row)], dtype=np.float64)


def _trace(row: Row) -> list[dict[str, Any]]:
    trace = row["trace"]
    assert isinstance(trace, list)
    return trace


def _strings(row: Row, field: str) -> list[str]:
    value = row[field]
    assert isinstance(value, list)
    return value


def _methods(rows: Sequence[Row]) -> list[str]:
    present = {case_of(r).method for r in rows}
    return [m for m in COLOURS if m in present] + sorted(present - set(COLOURS))


def _colour(method: str) -> str:
    return COLOURS.get(method, "#7f3c8d")


def _legend(figure: Figure, axis: Axes) -> None:
    handles, labels = axis.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4, fontsize=7, frameon=False)


def _save(figure: Figure, path: Path) -> Path:
    with mpl.rc_context({"savefig.dpi": 130}):
        figure.savefig(path)
    return path
