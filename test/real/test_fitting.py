"""Planted friction is found again, with an error bar that holds it, and evidence speaks for the right law."""

from __future__ import annotations

import numpy as np
import pytest

from compass_ros.calibration.noise import correlation_time, neighbour_correlation
from compass_ros.cells import load
from compass_ros.real.fitting import Unknown, fit, gain, residual_at, thinned, with_free_start
from compass_ros.real.pendulums import drag, dry
from compass_ros.simulation import Simulator
from compass_ros.types import Episode, Track

CELL = load("pendulum_single")
DRY, AIR = dry("joint1", 0.0004), drag("link1", 0.03)
TRUTH = {DRY[1].name: 0.0005, AIR[1].name: 0.02, "joint1@dyna@damping": 0.0}


def planted(noise: float = 1e-4) -> list[Episode]:
    """Pieces of swings with dry friction and drag of the air; first states stated a little wrong."""
    simulator = Simulator(CELL, [DRY[0], AIR[0]], threads=1)
    values = simulator.defaults
    for name, value in TRUTH.items():
        values[[p.name for p in simulator.parameters].index(name)] = value
    rng = np.random.default_rng(3)
    time = 0.01 * np.arange(120)
    starts = np.array([[np.pi - 1.2, 0.0], [np.pi + 0.5, 1.0], [np.pi, 8.0], [np.pi - 0.3, -1.5]])
    seen = simulator.observe(np.tile(values, (len(starts), 1)), starts, np.tile(time, (len(starts), 1)))
    stamps = 10**9 + np.round(time * 1e9).astype(np.int64)
    out = []
    for i, (angles, start) in enumerate(zip(seen, starts, strict=True)):
        track = Track("joint1", "joint", stamps, angles + noise * rng.standard_normal(angles.shape))
        state = start + [0.001, 0.02] * rng.standard_normal(2)
        out.append(Episode(f"piece_{i}", CELL.name, "", {}, 10**9, (track,), {"joint1": tuple(state.tolist())}))
    return out


def test_the_right_law_is_found_with_its_coefficients() -> None:
    cut = planted()
    inertia = Unknown("link1@dyna@inertia", 0.00012, 0.00003)
    none = {"joint1@dyna@damping": 0.0}
    right = fit(Simulator(CELL, [DRY[0], AIR[0]], threads=1), cut, (inertia, DRY[1], AIR[1]), True, none)
    viscous = Unknown("joint1@dyna@damping", 0.0002, 0.0002)
    wrong = fit(Simulator(CELL, threads=1), cut, (inertia, viscous))
    for name in (DRY[1].name, AIR[1].name):
        assert right.value(name) == pytest.approx(TRUTH[name], rel=0.03)
        assert abs(right.value(name) - TRUTH[name]) < 4 * right.std[name]
    assert right.value("link1@dyna@inertia") == pytest.approx(0.000109, abs=4e-6)
    assert np.sqrt(right.square) == pytest.approx(1e-4, rel=0.1), "what is left is the noise"
    assert gain(right, wrong) > 20
    assert gain(wrong, right) < 0


def test_a_first_state_is_only_moved_where_it_is_free() -> None:
    piece = planted(0.0)[:1]
    simulator = Simulator(CELL, threads=1)
    stated = float(np.sqrt(np.nanmean(residual_at(simulator, simulator.defaults, piece) ** 2)))
    free = with_free_start(simulator, simulator.defaults, piece)
    assert free.rms[0] < stated
    np.testing.assert_array_equal(free.values, simulator.defaults)
    assert np.any(free.launch != 0)


def test_frames_that_one_independent_one_is_worth() -> None:
    rng = np.random.default_rng(0)
    white = rng.standard_normal((3, 2000, 1))
    slow = np.zeros_like(white)
    for t in range(1, 2000):
        slow[:, t] = 0.8 * slow[:, t - 1] + white[:, t]
    seen = np.ones(white.shape, bool)
    assert correlation_time(neighbour_correlation(white, seen)) == pytest.approx(1.0, abs=0.1)
    assert correlation_time(neighbour_correlation(slow, seen)) == pytest.approx(9.0, rel=0.15)


def test_thinned() -> None:
    assert len(thinned(planted()[0], 10).tracks[0].stamp_ns) == 12
