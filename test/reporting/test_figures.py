"""Still figures: what is drawn is what was given."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from compass_ros.reporting import ReportExtras, figures
from compass_ros.types import Result


def test_trajectories_draw_the_recording_and_every_model(result: Result, extras: ReportExtras) -> None:
    replay = result.replays[3]
    axes = figures.trajectories(replay, extras.scene).axes[0]
    assert len(axes.lines) == 3 * len(replay.tracks)
    assert np.array_equal(np.column_stack(axes.lines[1].get_data()), replay.tracks[0].calibrated)
    assert extras.scene is not None
    assert len(axes.patches) == len(extras.scene.shapes)


def test_causal_graph_shows_the_strongest_rows(result: Result) -> None:
    axes = figures.causal_graph(result.graph, rows=5).axes[0]
    drawn = np.asarray(axes.images[0].get_array())
    assert np.array_equal(drawn.max(axis=1), np.sort(result.graph.psi.max(axis=1))[::-1][:5])


def test_parameter_curves_have_one_panel_each(result: Result, extras: ReportExtras) -> None:
    figure = figures.parameter_curves(result, most=4, truth=extras.truth)
    assert len(figure.axes) == 4
    curve = figure.axes[0].lines[-1]
    assert np.array_equal(curve.get_ydata(), [it.values[0] for it in result.trace])


def test_gap_bars_stand_at_the_errors(result: Result) -> None:
    axes = figures.gap_bars(result).axes[0]
    ends = [np.asarray(line.get_xdata()) for line in axes.lines if line.get_marker() == "o"]
    errors = [result.gap[m]["held_out"].rmse_m * 1e3 for m in ("nominal", "calibrated", "with_effects")]
    assert np.concatenate(ends) == pytest.approx(errors)


@pytest.mark.parametrize("ending", ["png", "svg"])
def test_same_figure_same_bytes(result: Result, tmp_path: Path, ending: str) -> None:
    def write(name: str) -> bytes:
        figure: Figure = figures.gap_bars(result)
        path = tmp_path / f"{name}.{ending}"
        figures.save(figure, path)
        return path.read_bytes()

    assert write("a") == write("b")
