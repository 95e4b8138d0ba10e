"""The next experiment: where two models that explain everything so far predict most differently.

A model's prediction of a new shot is uncertain, since its parameters are; draws from its posterior say how much, chaos
included. The difference of two models counts after each has been refitted to first order, that is without the part that
such draws could make up (T-optimal design; Atkinson and Fedorov 1975).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from types import MappingProxyType
from typing import Protocol

import numpy as np

from compass_ros.calibration.least_squares import Fit, normal_equations
from compass_ros.calibration.likelihood import Likelihood
from compass_ros.discovery.planned import drawn
from compass_ros.simulation import Simulator
from compass_ros.simulation.effects import EFFECTS, Attached
from compass_ros.simulation.sites import PLANAR
from compass_ros.types import Floats

POOL = 32
"""Shots that are tried."""
DRAWS = 6
TOLD = 5.0
"""Difference [sigma] at which two models are told apart."""
_FRAMES = 60
_ENCODERS = "record the arm's own position too, by its encoders: a late command shows there, a late camera does not"
_GRID = "put a puck at rest on nine known points of the table: the camera's errors show there, forces do not"
_FAN_OFF = "repeat a shot with the air or the fan off, and with the launch line turned by 180 degrees"
_ALONE = "repeat a shot with one object alone on the table"
_SLOW = "film one bounce at several speeds with a faster camera"
OTHER: Mapping[frozenset[str], str] = MappingProxyType(
    {
        frozenset({"sensing", "actuation"}): _ENCODERS,
        frozenset({"sensing", "dynamics"}): _GRID,
        frozenset({"sensing", "contact"}): _GRID,
        frozenset({"sensing"}): _GRID,
        frozenset({"actuation"}): _ENCODERS,
        frozenset({"actuation", "dynamics"}): _ENCODERS,
        frozenset({"actuation", "contact"}): _ENCODERS,
        frozenset({"dynamics"}): _FAN_OFF,
        frozenset({"dynamics", "contact"}): _ALONE,
        frozenset({"contact"}): _SLOW,
    }
)
"""What to do that is no shot, by the channels of two effects that no shot tells apart, on a table."""
_ONE_CLOCK = "record the commands and the encoders with stamps of one clock, and a fast step of the command"
_OTHER_SPEED = "repeat the motions at a third of their speed and at three times that, and from other places"
_ONE_AT_A_TIME = "move one joint at a time, the others held"
OF_JOINTS: Mapping[frozenset[str], str] = MappingProxyType(
    {
        **dict.fromkeys(OTHER, _ONE_CLOCK),
        frozenset({"dynamics"}): _OTHER_SPEED,
        frozenset({"dynamics", "contact"}): "repeat the motions where nothing is touched",
        frozenset({"contact"}): "film one touch at several speeds with a fast camera",
    }
)
"""The same where nothing slides in a plane."""


class Rival(Protocol):
    """A fitted model with laws."""

    @property
    def name(self) -> str: ...
    @property
    def laws(self) -> tuple[Attached, ...]: ...
    @property
    def simulator(self) -> Simulator: ...
    @property
    def likelihood(self) -> Likelihood: ...
    @property
    def fit(self) -> Fit: ...


@dataclass(frozen=True)
class NextExperiment:
    """What to record next."""

    sentence: str
    action: Mapping[str, float] | None
    """The shot by name of its fields; None where no shot helps."""
    apart: float
    """Least difference of the models that the shot tells apart [sigma]; 0 without a shot."""


def next_experiment(
    simulator: Simulator, likelihood: Likelihood, rivals: Sequence[Rival], seed: int, pool: int = POOL
) -> NextExperiment:
    """The shot that tells most pairs of two or more rival models apart, and by most; or what is no shot.

    `simulator` and `likelihood` are those without effects; the sigma is the recordings' own.
    """
    pairs = list(combinations(range(len(rivals)), 2))
    if not pairs:
        return NextExperiment("", None, 0.0)
    if not simulator.cell.action or simulator.cell.spec.start:
        return NextExperiment(_sentence_other(rivals, pairs), None, 0.0)
    rng = np.random.default_rng(seed)
    shots = drawn(simulator, pool, rng)
    if not len(shots):
        return NextExperiment(_sentence_other(rivals, pairs), None, 0.0)
    sigma = np.nanmedian(likelihood.sigma[:, : max(likelihood.sigma.shape[1] // 4, 1)], axis=(0, 1))
    predicted = [_predictions(rival, shots, sigma, simulator.cell.duration, rng) for rival in rivals]
    apart = np.array([_apart(predicted[a], predicted[b]) for a, b in pairs])  # (pairs, S)
    told = np.sum(apart > TOLD, axis=0)
    least = np.min(np.where(apart > TOLD, apart, np.inf), axis=0)
    best = int(np.lexsort((np.where(told > 0, least, apart.max(axis=0)), told))[-1])
    if not told[best]:
        return NextExperiment(_sentence_other(rivals, pairs), None, 0.0)
    action = {a.name: float(v) for a, v in zip(simulator.cell.action, shots[best], strict=False)}
    open_pairs = [pair for pair, d in zip(pairs, apart[:, best], strict=True) if d <= TOLD]
    sentence = _sentence(simulator, action, rivals, pairs, apart[:, best])
    if open_pairs:
        sentence += " " + _sentence_other(rivals, open_pairs)
    return NextExperiment(sentence, action, float(least[best]))


def _predictions(rival: Rival, shots: Floats, sigma: Floats, duration: float, rng: np.random.Generator) -> Floats:
    """(1 + DRAWS, S, D) predictions [sigma] at the best values, and at draws from the posterior."""
    fit, likelihood = rival.fit, rival.likelihood
    hessian, _ = normal_equations(likelihood, fit.point, fit.linear, fit.free, fit.robust)
    p = len(fit.free)
    factor = np.linalg.cholesky(np.linalg.inv(hessian)[:p, :p] * likelihood.correlation_time)
    values = np.tile(fit.point.values, (1 + DRAWS, 1))
    values[1:, fit.free] += rng.normal(size=(DRAWS, p)) @ factor.T * likelihood.prior_std[fit.free]
    values = np.clip(values, likelihood.low, likelihood.high)
    time = np.tile(np.linspace(0, duration, _FRAMES), ((1 + DRAWS) * len(shots), 1))
    seen = rival.simulator.observe(np.repeat(values, len(shots), axis=0), np.tile(shots, (1 + DRAWS, 1)), time)
    return np.asarray((seen / sigma).reshape(1 + DRAWS, len(shots), -1))


def _apart(one: Floats, other: Floats) -> Floats:
    """(S,) difference of two models in sigma, without what the posteriors of both could make up."""
    difference = one[0] - other[0]
    spread = np.concatenate([one[1:] - one[0], other[1:] - other[0]]) / np.sqrt(DRAWS)  # (2 DRAWS, S, D)
    out = np.empty(len(difference))
    for s, d in enumerate(difference):
        u = spread[:, s]
        pull = u @ d
        out[s] = d @ d - pull @ np.linalg.solve(u @ u.T + np.eye(len(u)), pull)
    return np.asarray(np.sqrt(np.maximum(out, 0.0)))


def _sentence(
    simulator: Simulator,
    action: Mapping[str, float],
    rivals: Sequence[Rival],
    pairs: Sequence[tuple[int, int]],
    apart: Floats,
) -> str:
    fields = {a.name: a.unit for a in simulator.cell.action}
    shot = ", ".join(f"{name} {value:.3f} {fields[name]}" for name, value in action.items())
    told = [
        f"{rivals[a].name} from {rivals[b].name} by {d:.0f} sigma"
        for (a, b), d in zip(pairs, apart, strict=True) if d > TOLD
    ]  # fmt: skip
    return f"Play the shot {shot}: it tells {', '.join(told)}."


def _sentence_other(rivals: Sequence[Rival], pairs: Sequence[tuple[int, int]]) -> str:
    parts = [
        f"No shot tells {rivals[a].name} from {rivals[b].name}: {other_than_a_shot(rivals[a], rivals[b])}."
        for a, b in pairs
    ]
    return " ".join(parts)


def other_than_a_shot(one: Rival, other: Rival) -> str:
    """What tells two models apart that no shot does."""
    names = {a.effect.name for a in one.laws} ^ {a.effect.name for a in other.laws}
    joints = not any(site.kind in PLANAR for site in one.simulator.moving.values())
    if not names:
        return _ONE_AT_A_TIME if joints else _ALONE
    return (OF_JOINTS if joints else OTHER)[frozenset(sorted({str(EFFECTS[name].channel) for name in names})[-2:])]
