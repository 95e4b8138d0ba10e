"""Log evidence against the dense Gaussian that it stands for, and against numerical integration of a robust loss."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import multivariate_normal

from compass_ros.calibration.cost import robust_loss
from compass_ros.discovery.evidence import Normal, Tangent, log_sum
from compass_ros.discovery.sized import Reduced, Spread, log_alone, sized
from compass_ros.types import Floats

EPISODES, ROWS, PARAMETERS, OWN, PUSHES = 3, 40, 4, 2, 6
WIDE = 1e6


def drawn(seed: int, robust: float = WIDE, correlation_time: float = 1.0) -> Tangent:
    """A linear model with everything by chance."""
    rng = np.random.default_rng(seed)
    rows = (EPISODES, ROWS)
    return Tangent(
        residual=rng.normal(size=rows),
        parameters=rng.normal(size=(*rows, PARAMETERS)),
        own=rng.normal(size=(*rows, OWN)),
        pushes=rng.normal(size=(*rows, PUSHES)),
        away=rng.normal(size=PARAMETERS),
        own_away=rng.normal(size=(EPISODES, OWN)),
        robust=robust,
        correlation_time=correlation_time,
    )


def dense(tangent: Tangent, spread: Floats | None) -> tuple[Floats, Floats, Floats]:
    """(N, m) what (m,) standard normal numbers do to all residuals, and the mean of those numbers."""
    (episodes, rows_of_each), q = tangent.residual.shape, 0 if spread is None else spread.shape[-1]
    parameters, own = tangent.parameters.shape[2], tangent.own.shape[2]
    count = parameters + episodes * (own + q)
    columns, mean = np.zeros((episodes * rows_of_each, count)), np.zeros(count)
    mean[:parameters] = tangent.away
    for e in range(episodes):
        rows, first = slice(e * rows_of_each, (e + 1) * rows_of_each), parameters + e * (own + q)
        columns[rows, :parameters] = tangent.parameters[e]
        columns[rows, first : first + own] = tangent.own[e]
        mean[first : first + own] = tangent.own_away[e]
        if spread is not None:
            of_episode = np.broadcast_to(spread, (episodes, *spread.shape[-2:]))[e]
            columns[rows, first + own : first + own + q] = tangent.pushes[e] @ of_episode
    return columns, mean, tangent.residual.ravel()


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("kind", ["none", "shared", "by episode"])
@pytest.mark.parametrize("correlation_time", [1.0, 3.0])
def test_log_evidence_is_that_of_the_gaussian(seed: int, kind: str, correlation_time: float) -> None:
    tangent = drawn(seed, correlation_time=correlation_time)
    rng = np.random.default_rng(100 + seed)
    shape = {"none": None, "shared": (PUSHES, 5), "by episode": (EPISODES, PUSHES, 5)}[kind]
    spread = None if shape is None else 0.3 * rng.normal(size=shape)
    reduced = Reduced(tangent, tangent.normal)
    found = reduced.logs(reduced.axes(None if spread is None else Spread(spread)), [1.0])
    assert found[0, 0] == pytest.approx(_alone(tangent, spread), abs=1e-8)


def _alone(tangent: Tangent, spread: Floats | None) -> float:
    """Log evidence by the covariance of all residuals."""
    columns, mean, residual = dense(tangent, spread)
    covariance = tangent.correlation_time * np.eye(len(residual)) + columns @ columns.T
    constant = 0.5 * len(residual) * np.log(2 * np.pi * tangent.correlation_time)
    return float(multivariate_normal.logpdf(residual, -columns @ mean, covariance) + constant)


def test_the_maximum_is_that_of_least_squares() -> None:
    tangent, spread = drawn(5), 0.4 * np.random.default_rng(6).normal(size=(PUSHES, 5))
    columns, mean, residual = dense(tangent, spread)
    stacked = np.vstack([columns, np.eye(len(mean))])
    best = np.linalg.lstsq(stacked, np.concatenate([-residual, mean]), rcond=None)[0]
    reduced = Reduced(tangent, tangent.normal)
    found = reduced.maximum(Spread(spread), reduced.axes(Spread(spread)), 1.0)
    assert found.parameters == pytest.approx(best[:PARAMETERS], abs=1e-9)
    left = residual + columns @ best
    assert found.residual.ravel() == pytest.approx(left, abs=1e-9)


@pytest.mark.parametrize("kind", ["none", "alike", "by episode", "shared"])
def test_many_residuals_and_sizes_at_once_are_as_each_alone(kind: str) -> None:
    tangent = drawn(19)
    rng = np.random.default_rng(8)
    others = rng.normal(size=(4, EPISODES, ROWS))
    root = rng.normal(size=(PUSHES, 5) if kind == "alike" else (EPISODES, PUSHES, 5))
    spread = None if kind == "none" else Spread(root, shared=kind == "shared")
    columns = np.concatenate([tangent.parameters, tangent.own, tangent.pushes], axis=2)
    last, sizes = np.einsum("edn,med->enm", columns, others), (1e-4, 0.3, 20.0)
    reduced = Reduced(tangent, tangent.normal, last, np.sum(others**2, axis=(1, 2)))
    together = reduced.logs(reduced.axes(spread), sizes)
    alone = [[_alone_of_a_size(replace(tangent, residual=r), spread, size) for r in others] for size in sizes]
    assert together == pytest.approx(np.array(alone), abs=1e-8)


def _alone_of_a_size(tangent: Tangent, spread: Spread | None, size: float) -> float:
    """What is shared stands among the parameters."""
    if spread is None or not spread.shared:
        return _alone(tangent, None if spread is None else size * spread.root)
    return _alone(tangent.more(size * tangent.pushes @ spread.root, np.zeros(spread.root.shape[2])), None)


@pytest.mark.parametrize("shared", [False, True])
def test_the_least_size_is_one_that_its_absence_would_show(shared: bool) -> None:
    """Odds of 99 against it, in the mean of recordings that are noise."""
    tangent = drawn(19)
    none = np.zeros((EPISODES, ROWS, 0))
    tangent = replace(
        tangent, parameters=none, own=none, away=np.zeros(0), own_away=np.zeros((EPISODES, 0)), robust=1e9
    )
    rng = np.random.default_rng(18)
    spread = Spread(rng.normal(size=(EPISODES, PUSHES, 5)), shared)
    size = Reduced(tangent, tangent.normal).axes(spread).shown()[0]
    draws = [replace(tangent, residual=rng.normal(size=(EPISODES, ROWS))) for _ in range(400)]
    against = [_alone_of_a_size(t, None, 1.0) - _alone_of_a_size(t, spread, size) for t in draws]
    assert np.mean(against) == pytest.approx(np.log(99), abs=4 * float(np.std(against)) / 20)


def test_pushes_that_grow_beyond_all_digits_take_no_more_than_there_is() -> None:
    """About an unstable motion each push grows from its moment on, to 1e15 sigma: all of them along one direction."""
    rows, count = 400, 50
    later = np.arange(rows)[:, None] - np.linspace(0, rows, count, endpoint=False)
    pushes = np.where(later > 0, np.exp(np.log(1e15) * np.maximum(later, 0) / rows) + np.maximum(later, 0), 0.0)
    rng = np.random.default_rng(19)
    parameters = rng.normal(size=(1, rows, PARAMETERS)) * pushes[:, :1] ** 0.3
    nothing = np.zeros((1, rows, 0))
    tangent = Tangent(
        rng.normal(size=(1, rows)), parameters, nothing, pushes[None], np.zeros(PARAMETERS), np.zeros((1, 0)), WIDE, 1.0
    )
    (free,) = sized(tangent, [Spread(np.eye(count))], [1e3])
    assert np.isfinite(free.log)
    assert free.log < 0
    reduced = Reduced(tangent, tangent.normal)
    left = reduced.maximum(Spread(np.eye(count)), reduced.axes(Spread(np.eye(count))), 1e3).residual
    assert np.sum(left**2) < np.sum(tangent.residual**2)


def test_a_parameter_that_says_nothing_costs_nothing() -> None:
    tangent = drawn(19)
    wider = tangent.more(np.zeros((EPISODES, ROWS, 2)), np.zeros(2))
    assert log_alone(wider) == pytest.approx(log_alone(tangent), abs=1e-9)


def test_a_parameter_that_explains_nothing_pays_for_its_prior() -> None:
    """Occam's factor: half the log of one plus its information, where the residual has nothing of it."""
    none = np.zeros((EPISODES, ROWS, 0))
    empty = replace(drawn(10), parameters=none, away=np.zeros(0), own=none, own_away=np.zeros((EPISODES, 0)))
    column = np.random.default_rng(11).normal(size=empty.residual.shape)
    column -= empty.residual * np.sum(column * empty.residual) / np.sum(empty.residual**2)
    wider = empty.more(column[:, :, None], np.zeros(1))
    paid = log_alone(empty) - log_alone(wider)
    assert paid == pytest.approx(0.5 * np.log1p(np.sum(column**2)), abs=1e-9)


@pytest.mark.parametrize("outlier", [0.0, 8.0, 30.0, 200.0])
def test_of_a_robust_loss_it_is_a_lower_bound_that_comes_close(outlier: float) -> None:
    """One parameter, one episode, some frames far away: against the integral itself."""
    rng, robust = np.random.default_rng(12), 4.0
    residual = rng.normal(size=(1, 30)) + 2.0
    residual[0, ::7] += outlier
    none = np.zeros((1, 30, 0))
    tangent = Tangent(residual, np.ones((1, 30, 1)), none, none, np.zeros(1), np.zeros((1, 0)), robust, 1.0)

    def cost(x: float) -> float:
        return 0.5 * float(np.sum(robust_loss(residual + x, robust))) + 0.5 * x**2

    least = min(cost(x) for x in np.linspace(-6, 2, 400))
    integral = quad(lambda x: np.exp(least - cost(x)), -8, 4, limit=200)[0]
    exact = float(np.log(integral / np.sqrt(2 * np.pi))) - least
    found = sized(tangent, [None])[0].log
    assert found <= exact + 1e-6
    assert found > exact - 0.7


def test_weights_follow_what_a_discrepancy_explains() -> None:
    """Frames that are far away without it and near with it count fully: the bound of the larger model is not loose."""
    rng = np.random.default_rng(13)
    rows, none = (1, 60), np.zeros((1, 60, 0))
    push = np.repeat(np.eye(3), 20, axis=0)[None]
    residual = (push @ np.array([40.0, -25.0, 30.0]))[..., 0] + rng.normal(size=rows)
    tangent = Tangent(residual, none, none, push, np.zeros(0), np.zeros((1, 0)), 4.0, 1.0)
    without, found = sized(tangent, [None, Spread(np.eye(3))], [30.0])
    exact = replace(tangent, robust=WIDE)
    assert found.log == pytest.approx(_alone(exact, 30.0 * np.eye(3)), abs=3.0)
    assert found.log > without.log + 100


def test_products_are_those_of_all_columns_where_pushes_begin_later() -> None:
    tangent = drawn(5, robust=1.5)
    later = np.arange(ROWS)[:, None] >= 7 * np.arange(PUSHES)
    tangent = replace(tangent, pushes=tangent.pushes * later)
    columns = np.concatenate([tangent.parameters, tangent.own, tangent.pushes, tangent.residual[:, :, None]], axis=2)
    weight = 1 / np.sqrt(1 + (tangent.residual / 1.5) ** 2)
    expected = np.einsum("ed,edi,edj->eij", weight, columns, columns)
    np.testing.assert_allclose(tangent.normal.gram, expected, atol=1e-12)


def test_normal_equations_know_the_constant_of_the_bound() -> None:
    tangent = drawn(14, robust=2.0)
    normal = Normal.of(tangent, tangent.residual)
    weighted = float(normal.gram[:, -1, -1].sum()) + normal.constant
    assert weighted == pytest.approx(float(np.sum(robust_loss(tangent.residual, 2.0))), abs=1e-9)


def test_log_sum() -> None:
    assert log_sum(np.log([0.2, 0.3, 0.5])) == pytest.approx(0.0, abs=1e-12)
