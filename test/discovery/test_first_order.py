"""Laws about a fit, to first order: planted sizes and shapes, beside what the whole simulator says."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from scipy.linalg import block_diag

from compass_ros.calibration.cost import Point, robust_weight
from compass_ros.calibration.differences import linearise
from compass_ros.calibration.least_squares import Fit
from compass_ros.calibration.likelihood import Likelihood
from compass_ros.discovery.candidates import Candidate, candidates
from compass_ros.discovery.evidence import Tangent
from compass_ros.discovery.first_order import FirstOrder, Ranked, best_sizes
from compass_ros.discovery.hypothesis import Hypothesis
from compass_ros.discovery.response import Response
from compass_ros.simulation import Simulator
from compass_ros.types import Floats
from test.simulation import robots


def planted(folder: Path, name: str, numbers: list[float]) -> tuple[Hypothesis, Candidate]:
    """A swinging arm that has a law and a simulator that lacks it, at the true values of all else."""
    cell = robots.robot(folder, ("hinge", "hinge"))
    simulator, inputs = Simulator(cell, threads=1), robots.shots(cell, 4)
    time_s = np.tile(np.arange(0, cell.duration, 0.01), (4, 1))
    asked = candidates(simulator, simulator.defaults, inputs, time_s)
    candidate = next(c for c in asked if c.name == name and c.attached.objects == ("j0",))
    likelihood = robots.recorded(simulator, [candidate.attached], numbers, inputs)
    return plain(simulator, likelihood), candidate


def plain(simulator: Simulator, likelihood: Likelihood) -> Hypothesis:
    point, free = Point(simulator.defaults, np.zeros_like(likelihood.inputs), 0.0), np.arange(len(simulator.parameters))
    linear = linearise(likelihood, point, free, np.full(len(free), 0.01))
    return Hypothesis((), simulator, likelihood, Fit(point, linear, free, 1e6, 0, True))


@pytest.mark.parametrize(
    ("name", "numbers", "within"),
    [
        ("coulomb_friction", [2e-4, 0.0], 0.1),
        ("quadratic_drag", [2e-4], 0.1),
        ("spring", [2e-3, 0.3, 0.0, 0.0], 0.2),
        ("asymmetric_friction", [2e-4], 0.1),
        ("stribeck_friction", [3e-4, 1.0, 0.0], 0.4),
    ],
)
def test_a_small_law_of_force_is_found_with_its_numbers(
    tmp_path: Path, name: str, numbers: list[float], within: float
) -> None:
    model, candidate = planted(tmp_path, name, numbers)
    best = FirstOrder(model.response).ranked(candidate)[0]
    assert best.numbers[:2] == pytest.approx(numbers[:2], rel=within)  # a short way says nothing of a spring's lever
    # what it gains is what its columns gain as parameters
    tangent = model.response.tangent
    wider = tangent.more(best.columns, np.zeros(best.columns.shape[2]))
    gained = _least(wider) - _least(tangent)
    assert best.gain == pytest.approx(gained, rel=1e-3)


def _least(tangent: Tangent) -> float:
    """Largest log posterior of a linear model, by least squares."""
    root = np.sqrt(robust_weight(tangent.residual, tangent.robust) / tangent.correlation_time)[:, :, None]
    columns = np.concatenate(
        [tangent.parameters * root, block_diag(*(tangent.own * root)).reshape(*root.shape[:2], -1)], 2
    )
    columns = columns.reshape(root.size, -1)
    stacked = np.vstack([columns, np.eye(columns.shape[1])])
    asked = np.concatenate([-(tangent.residual * root[..., 0]).ravel(), tangent.away, tangent.own_away.ravel()])
    return -0.5 * float(np.sum((stacked @ np.linalg.lstsq(stacked, asked, rcond=None)[0] - asked) ** 2))


def test_a_law_of_commands_is_rolled_out(tmp_path: Path) -> None:
    cell = robots.robot(tmp_path, ("hinge",), ("position",))
    simulator, inputs = Simulator(cell, threads=1), robots.shots(cell, 4)
    time_s = np.tile(np.arange(0, cell.duration, 0.01), (4, 1))
    asked = candidates(simulator, simulator.defaults, inputs, time_s)
    candidate = next(c for c in asked if c.name == "gain_error")
    likelihood = robots.recorded(simulator, [candidate.attached], [0.02], inputs)
    best = FirstOrder(plain(simulator, likelihood).response).ranked(candidate)[0]
    assert best.numbers == pytest.approx([0.02], rel=0.1)
    assert best.seen


def test_what_is_not_there_gains_no_more_than_noise(tmp_path: Path) -> None:
    model, candidate = planted(tmp_path, "coulomb_friction", [0.0, 0.0])
    ranked: list[Ranked] = FirstOrder(model.response).ranked(candidate)
    assert ranked[0].gain < 1e-6


@pytest.mark.parametrize("seed", range(5))
def test_sizes_within_bounds_are_the_best_ones(seed: int) -> None:
    """Against a grid."""
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(2, 2))
    matrix, pull = root @ root.T, rng.normal(size=2)
    low, high, prior = np.array([0.0, -0.5]), np.array([1.0, 0.5]), np.array([1.0, 2.0])
    sizes, gain = best_sizes(matrix, pull, low, high, prior)

    def fall(x: Floats) -> Floats:
        full = matrix + np.diag(1 / prior**2)
        return np.asarray(-(x @ pull) - 0.5 * np.einsum("ni,ij,nj->n", x, full, x))

    grid = np.stack(np.meshgrid(np.linspace(0, 1, 201), np.linspace(-0.5, 0.5, 201)), axis=-1).reshape(-1, 2)
    assert gain == pytest.approx(float(fall(grid).max()), abs=2e-3)
    assert fall(sizes[None])[0] == pytest.approx(gain, abs=1e-9)


@pytest.mark.parametrize("amplitudes", [1, 3])
def test_an_unstable_episode_takes_nothing_of_what_the_others_say(amplitudes: int) -> None:
    """Its pushes grow to 1e10 sigma and more: beside their squares double precision keeps no digit of the others'."""
    rng, rows, pushes = np.random.default_rng(31), 200, 12
    grown = rng.normal(size=(4, rows, pushes))
    grown[3] = np.exp(np.linspace(0, 30, rows))[:, None] * (1 + 1e-9 * rng.normal(size=(rows, pushes)))
    columns = grown @ rng.normal(size=(pushes, amplitudes))
    residual = rng.normal(size=(4, rows)) - 3 * columns.sum(axis=2)
    residual[3] = 100 * rng.normal(size=rows)
    none = np.zeros((4, rows, 0))
    tangent = Tangent(residual, none, none, grown, np.zeros(0), np.zeros((4, 0)), 1e9, 1.0)
    others = Tangent(residual[:3], none[:3], none[:3], grown[:3], np.zeros(0), np.zeros((3, 0)), 1e9, 1.0)
    far, prior = np.full(amplitudes, 1e3), np.full(amplitudes, 20.0)
    gains = []
    for one, of in ((tangent, columns), (others, columns[:3])):
        about = FirstOrder(cast("Response", SimpleNamespace(tangent=one)))
        gains.append(best_sizes(*about.of_columns(of), -far, far, prior)[1])
    assert gains[0] == pytest.approx(gains[1], rel=1e-9)
    assert gains[0] < 0.5 * float(np.sum(residual[:3] ** 2))
    assert gains[0] > 0.45 * float(np.sum((3 * columns[:3].sum(axis=2)) ** 2))


def test_what_pulls_where_nothing_is_told_is_rounding() -> None:
    """Two amplitudes that do the same to sixteen digits: no gain along their difference."""
    one = np.array([[1e18, 1e18], [1e18, 1e18]])
    wide = np.full(2, 1e9)
    sizes, gain = best_sizes(one, np.array([1e9, 1e9 + 1e4]), -wide, wide, np.full(2, 20.0))
    assert gain == pytest.approx(0.5 * 1e18 / 1e18, rel=1e-3)
    assert sizes[0] == pytest.approx(sizes[1], rel=1e-6)
