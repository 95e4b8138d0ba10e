"""The picture of a verdict on an arm, and what the calibration prints.

    python -m scripts.arm_picture docs/images/arm-verdict.png      # from the root; 15 s of one core

An arm of three joints on position servos is simulated with a drag on its second joint that its model lacks, with wrong
damping and with noise; ten recordings of a second are calibrated as anybody's are.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from compass_ros.config import CalibrationConfig
from compass_ros.pipeline import calibrate
from compass_ros.reporting import print_result
from compass_ros.reporting.figures import LINE, save, styled
from compass_ros.reporting.palette import LIGHT
from compass_ros.reporting.words import MODEL_LABEL, MODELS, held_out_rmse
from compass_ros.simulation import Simulator
from compass_ros.simulation.effects import Attached, effect
from compass_ros.simulation.sizes import unit_joint
from compass_ros.types import Result
from test.discovery.servo import noisy
from test.simulation import robots

DRAG = 0.16
"""Planted on the second joint [N m s/rad]."""
JOINT = "j1"


def result() -> Result:
    """The calibration of the planted arm."""
    with tempfile.TemporaryDirectory() as folder:
        cell = robots.robot(Path(folder), ("hinge",) * 3, ("position",) * 3)
        law = Attached(effect("viscous_drag").at(unit_joint("hinge")), (JOINT,))
        slow = [0.3 if action.name[0] == "v" else 1.0 for action in cell.action]
        values = [*(1.1 * cell.defaults), DRAG]
        real = Simulator(cell, [law], threads=1)
        episodes = noisy(real, values, robots.shots(cell, 10) * slow, 1.0, cell.spec.noise_m / 2, 3)
        return calibrate(episodes, cell, CalibrationConfig(threads=1))[0]


def draw(found: Result) -> Figure:
    """Left, a held-out recording; right, the held-out error of each simulator, and how probable each explanation is."""
    with styled():
        figure = Figure(figsize=(8.4, 3.0), layout="constrained")
        left, right = figure.subplots(1, 2, width_ratios=[1.25, 1.0])
        _motion(left, found)
        _errors(right, found)
        effects = found.mismatch.explanations[0]
        named = " + ".join(law.name for law in effects.laws)
        figure.suptitle(
            f"{found.mismatch.verdict}: {named} on {JOINT}, probability {effects.probability:.3f}",
            fontsize=10, fontweight="bold", x=0.01, ha="left",
        )  # fmt: skip
    return figure


def _motion(axes: Axes, found: Result) -> None:
    replay = max(
        (one for one in found.replays if one.held_out),
        key=lambda one: float(np.ptp(next(t.real for t in one.tracks if t.object == JOINT))),
    )
    track = next(one for one in replay.tracks if one.object == JOINT)
    paths = {"nominal": track.nominal, "calibrated": track.calibrated, "with_effects": track.with_effects}
    recorded: Mapping[str, Any] = {"color": LIGHT["real"], "ms": 3, "mfc": "none", "label": "recorded, never fitted"}
    axes.plot(track.time_s, track.real[:, 0], "o", **recorded)
    for model in MODELS:
        path = paths[model]
        if path is not None:
            axes.plot(track.time_s, path[:, 0], LINE[model], color=LIGHT[model], lw=1.6, label=MODEL_LABEL[model])
    axes.set(xlabel="time [s]", ylabel=f"angle of {JOINT} [rad]")
    axes.legend(fontsize=7.5)


def _errors(axes: Axes, found: Result) -> None:
    models = [model for model in MODELS if np.isfinite(held_out_rmse(found, model))]
    floor = 1e3 * found.noise_floor_m
    for place, model in enumerate(models):
        error = 1e3 * held_out_rmse(found, model)
        axes.barh(place, error, color=LIGHT[model], height=0.55)
        axes.annotate(f"{error:.3g}", (error, place), (4, 0), textcoords="offset points", va="center", weight="bold")
    axes.axvline(floor, color=LIGHT["ink"], ls=":", lw=1.4)
    axes.annotate("noise", (floor, len(models) - 0.45), (3, 0), textcoords="offset points", fontsize=7.5)
    axes.set_yticks(range(len(models)), [MODEL_LABEL[model] for model in models])
    axes.set_ylim(len(models) - 0.3, -0.6)
    axes.margins(x=0.15)
    axes.grid(visible=False, axis="y")
    axes.set_xlabel("held-out error, rms [mrad]")


if __name__ == "__main__":
    said = result()
    print_result(said)
    save(draw(said), Path(sys.argv[1]))
