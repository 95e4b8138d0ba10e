"""The tables of a campaign, as in the paper, and pictures of real rollouts."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Rectangle

from compass_ros.reporting.markdown import markdown_table
from compass_ros.transfer.campaign import PAPER, Row
from compass_ros.transfer.experiment import Experiment
from compass_ros.transfer.simulators import NAMES
from compass_ros.types import Floats

HEADER = (
    *("simulator", "difference min, max, mean [m]", "of nominal", "policies", "last distance [m]", "success of 10"),
    *("success of 100", "promised in its own simulator", "trained in [s of processor]"),
)
SHOWN = ("nominal", "npdr", "compass", "parameters", "laws", "itself")


def tables(rows: Sequence[Row]) -> str:
    """Markdown: one table for each task, number of recordings and condition."""
    parts = []
    for task, condition, count in dict.fromkeys((r["task"], r["condition"], r["recordings"]) for r in rows):
        own = [r for r in rows if (r["task"], r["condition"], r["recordings"]) == (task, condition, count)]
        body = [line for name in NAMES if (line := _line(name, own))]
        parts.append(f"**{task}, {condition}**, {count} recordings\n\n{markdown_table(HEADER, body)}")
    return "\n\n".join(parts)


def _line(name: str, rows: Sequence[Row]) -> list[str] | None:
    own = [r for r in rows if r["simulator"] == name]
    policies = [r for r in own if r["seed"] != -1]
    if not own:
        return None
    gap, nominal = (_difference(n, rows) for n in (name, "nominal"))
    return [
        NAMES[name],
        "-" if gap is None else ", ".join(f"{x:.2f}" for x in gap),
        "-" if gap is None or nominal is None else f"{gap[2] / nominal[2]:.2f}",
        str(len(policies)),
        *(_spread([_number(r, field) for r in policies]) for field in ("distance_m", "success", "success_100")),
        *(_spread([_number(r, field) for r in policies if field in r]) for field in ("promised", "trained_cpu_s")),
    ]


def _difference(name: str, rows: Sequence[Row]) -> list[float] | None:
    for row in rows:
        if row["simulator"] == name and row["seed"] == -1:
            found = row["difference_m"]
            assert isinstance(found, list)
            return [float(x) for x in found]
    return None


def _number(row: Row, field: str) -> float:
    value = row[field]
    assert isinstance(value, float | int)
    return float(value)


def _spread(values: Sequence[float]) -> str:
    """Mean and standard deviation over policies, as the paper has it."""
    if not values:
        return "-"
    return f"{np.mean(values):.2f} ± {np.std(values):.2f}"


def picture(experiment: Experiment, rows: Sequence[Row], conditions: Sequence[str], path: Path) -> None:
    """Real rollouts of the first policy of each simulator in the table's plane: a line a shot, PAPER of them."""
    names = [n for n in SHOWN if any(r["simulator"] == n and r["seed"] == 0 for r in rows)]
    figure = Figure(figsize=(2.6 * len(names), 1.55 * len(conditions)), layout="constrained")
    axes = np.array(figure.subplots(len(conditions), len(names), squeeze=False))
    low, high = (np.array([getattr(a, end) for a in experiment.cell.action]) for end in ("low", "high"))
    for i, condition in enumerate(conditions):
        for j, name in enumerate(names):
            axis = axes[i, j]
            axis.set_axis_off()
            row = next((r for r in rows if (r["condition"], r["simulator"], r["seed"]) == (condition, name, 0)), None)
            if row is None:
                continue
            action = np.array(row["action"])
            command = low + 0.5 * (np.clip(action, -1, 1) + 1) * (high - low)
            seen = experiment.play(condition, np.tile(command, (PAPER, 1)), 1000).seen
            _drawn(axis, experiment, seen)
            title = f"{NAMES[name].partition(':')[0]}" if i == 0 else ""
            axis.set_title(f"{title}\n{condition}: {_number(row, 'success'):.1f}", fontsize=7)
    with mpl.rc_context({"savefig.dpi": 130}):
        figure.savefig(path)


def _drawn(axis: Axes, experiment: Experiment, seen: Floats) -> None:
    goal = experiment.goal
    if experiment.name == "air_hockey":
        axis.add_patch(Rectangle((-0.45, -0.225), 0.9, 0.45, facecolor="#eef1f4", edgecolor="0.4", linewidth=0.8))
        axis.add_patch(Rectangle((0.0875, -0.09), 0.025, 0.18, color="0.35"))
        axis.set_xlim(-0.46, 0.49)
        axis.set_ylim(-0.26, 0.24)
    axis.add_patch(Circle((goal.centre[0], goal.centre[-1]), goal.radius, color="#33b34d", alpha=0.25, clip_on=True))
    columns = [i for i, n in enumerate(experiment.cell.channels) if n == goal.object][: len(goal.centre)]
    others = [i for i in range(seen.shape[2]) if i not in columns][:2]
    for path in seen:
        if len(others) == 2:
            axis.plot(*path[:, others].T, color="#d62728", linewidth=0.4, alpha=0.6)
        axis.plot(path[:, columns[0]], path[:, columns[-1]], color="#1f4fd6", linewidth=0.7, alpha=0.8)
        axis.plot(path[-1, columns[0]], path[-1, columns[-1]], "o", color="#1f4fd6", markersize=2.5)
    axis.set_aspect("equal")
