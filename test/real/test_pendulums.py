"""The authors' figures are met at the authors' numbers; dry friction and drag predict swings that no fit saw."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from compass_ros.cells import load
from compass_ros.real.imports import episodes
from compass_ros.real.pendulums import CLEAR, EVERY, judged, pieces, single_laws, study
from compass_ros.simulation import Simulator


def numbers(text: str) -> list[float]:
    return [float(part) for part in text.split(", ")]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "published"), [("pendulum_single", [15.1, 20.5]), ("pendulum_double", [4.4, 4.0, 3.4, 12.8])]
)
def test_the_published_figures(name: str, published: list[float], real_data: Path, tmp_path: Path) -> None:
    cell = load(name)
    unseen = [e for e in episodes(cell, name, tmp_path, real_data) if e.name.startswith("validation")]
    simulator = Simulator(cell)
    stated, _, free = judged(simulator, simulator.defaults, cell, unseen)
    assert numbers(stated) == pytest.approx(published, abs=0.1)
    assert max(numbers(free)) < max(published)


def test_pieces(real_data: Path, tmp_path: Path) -> None:
    cell = load("pendulum_single")
    swing = episodes(cell, "pendulum_single", tmp_path, real_data)[0]
    cut = pieces(cell, swing, 1.0)
    assert len(cut) == 9
    for piece in cut:
        angle, rate = piece.initial_state["joint1"]
        track = piece.tracks[0]
        assert len(track.stamp_ns) == 1000 // EVERY
        assert angle == pytest.approx(float(track.value[0, 0]), abs=1e-3)
        ahead = float(track.value[1, 0] - track.value[0, 0]) / 0.01
        assert rate == pytest.approx(ahead, abs=0.5)
        assert np.all(np.diff(track.stamp_ns) == EVERY * 10**6)


@pytest.mark.slow
def test_dry_friction_and_drag_against_viscous_friction(real_data: Path, tmp_path: Path) -> None:
    laws = [law for law in single_laws() if law.name in ("viscous", "dry and drag of the air")]
    found = study("pendulum_single", laws, 1.0, tmp_path, real_data, lambda _: None, swings=4)
    assert "dry and drag of the air" in found.findings[0]
    viscous, right = found.tables[0].rows[1:]
    assert float(right[2]) > CLEAR
    for column in (3, 4, 5):
        assert all(a < b for a, b in zip(numbers(right[column]), numbers(viscous[column]), strict=True))
    assert max(numbers(right[5])) < 9
