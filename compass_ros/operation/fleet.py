"""Several robots of one kind: what they share, how they spread, and which one differs in what.

Each number is a random effect: a unit's true value is normal around the fleet's mean with a spread tau, and its
calibration tells it with an error bar. Mean, tau and shrunk values are those of DerSimonian and Laird, Meta-analysis in
clinical trials, Controlled Clinical Trials 7 (1986). With three to ten units tau is hardly known; where that decides
(is a unit odd? what is the next unit like?) it is integrated out, with DuMouchel's prior (Hierarchical Bayes linear
models for meta-analysis, NISS report 27, 1994), p(tau) = s0 / (s0 + tau)^2, s0^2 the harmonic mean of the squared error
bars.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from scipy.optimize import brentq
from scipy.special import ndtr

from compass_ros.operation.history import value_of
from compass_ros.operation.several import BY_CHANCE, LIKELY, Number, Run, laws, mean, table_of
from compass_ros.reporting.numbers import plain, probability, unit_text
from compass_ros.types import Floats

SCHEMA_ID = "compass/fleet/1"
FEWEST = 3
"""Units from which there is a spread of the others."""
ONE = float(ndtr(1.0))
_LOG_TAU = np.linspace(-7.0, 14.0, 600)
"""ln(tau / s0) at which tau is integrated out: from a thousandth of an error bar to a million of them."""


@dataclass(frozen=True)
class Spread:
    """One number over the fleet; units that are odd in it are not counted."""

    name: str
    units: dict[str, Number]
    mean: Number
    tau: float
    """Spread between units."""
    shrunk: dict[str, Number]
    """Each unit's value when the fleet is taken into account; an odd unit's own."""
    odd: dict[str, float]
    """Units outside the others' spread, with the probability of being so far out by chance."""
    next_unit: Number
    """What a unit that nobody has measured is expected to have: median, and half of the central 68 %."""

    @property
    def sentences(self) -> list[str]:
        unit = unit_text(self.mean.unit)
        return [
            f"{label} differs in {self.name}: {value_of(self.units[label])} {unit}".rstrip()
            + f", the others {plain(self.mean.value, 3)} with a spread of {plain(self.tau, 2)} {unit}".rstrip()
            + f" (by chance: {probability(p)})"
            for label, p in self.odd.items()
        ]


@dataclass(frozen=True)
class Fleet:
    units: tuple[Run, ...]
    spreads: tuple[Spread, ...]
    alone: dict[str, dict[str, Number]]
    """Numbers that less than three units tell."""
    laws: dict[str, dict[str, float]]
    """Probability by law and site, and unit; for those that are likely in one of them."""

    @property
    def comparisons(self) -> int:
        return sum(len(one.units) for one in self.spreads)

    @property
    def odd(self) -> set[str]:
        """Units that differ in a number, or in a law that some units have and others do not."""
        some = [by for by in self.laws.values() if min(by.values()) <= LIKELY]
        having = {unit for by in some for unit, p in by.items() if p > LIKELY}
        return having | {label for one in self.spreads for label in one.odd}

    @property
    def shared_laws(self) -> list[str]:
        return [name for name, by in self.laws.items() if min(by.values()) > LIKELY]

    @property
    def sentences(self) -> list[str]:
        """What differs, in words: laws that some units have and others do not, then numbers."""
        said = []
        for name, by in self.laws.items():
            with_it = [f"{unit} ({probability(p)})" for unit, p in by.items() if p > LIKELY]
            most = max((p for p in by.values() if p <= LIKELY), default=math.nan)
            if math.isfinite(most):
                said.append(
                    f"{name}: {', '.join(with_it)}; in every other unit its probability is below {_above(most)}"
                )
        return said + [sentence for one in self.spreads for sentence in one.sentences]


def _above(p: float) -> str:
    return plain(math.ceil(1e3 * p + 1e-9) / 1e3)


def fleet(runs: Sequence[Run]) -> Fleet:
    """One run a unit. A number needs three units that tell it."""
    table = table_of(runs)
    spreads = tuple(spread(name, by) for name, by in table.items() if len(by) >= FEWEST)
    asked = {run.label: laws(run.result) for run in runs if run.result.mismatch.explanations}
    names = dict.fromkeys(name for by in asked.values() for name, p in by.items() if p > LIKELY)
    likely = {name: {unit: by.get(name, 0.0) for unit, by in asked.items()} for name in names}
    return Fleet(tuple(runs), spreads, {n: by for n, by in table.items() if len(by) < FEWEST}, likely)


def spread(name: str, units: Mapping[str, Number]) -> Spread:
    """Of three units or more."""
    odd = {}
    for label, one in units.items():
        p = Next([other for its, other in units.items() if its != label]).chance(one)
        if p < BY_CHANCE:
            odd[label] = p
    inside = {label: one for label, one in units.items() if label not in odd}
    mean, tau = dersimonian_laird([*inside.values()])
    shrunk = {label: one if label in odd else _shrunk(one, mean, tau) for label, one in units.items()}
    return Spread(name, dict(units), mean, tau, shrunk, odd, Next([*inside.values()]).number)


def dersimonian_laird(said: Sequence[Number]) -> tuple[Number, float]:
    """Mean with its error bar, and the spread between units."""
    y, s = _arrays(said)
    w = s**-2
    q = float(w @ (y - w @ y / w.sum()) ** 2)
    scale = float(w.sum() - (w**2).sum() / w.sum())
    tau2 = max(0.0, (q - (len(y) - 1)) / scale) if scale > 0 else 0.0
    return mean(said, tau2), math.sqrt(tau2)


def _shrunk(one: Number, mean: Number, tau: float) -> Number:
    """The posterior mean of a unit's value, with the fleet's mean as uncertain as it is."""
    share = one.std**2 / (one.std**2 + tau**2)
    std = math.sqrt((1 - share) * one.std**2 + (share * mean.std) ** 2)
    return Number((1 - share) * one.value + share * mean.value, std, one.unit)


class Next:
    """The true value of one more unit like these: a mixture of normal distributions, one for each spread tau."""

    def __init__(self, said: Sequence[Number]) -> None:
        y, s = _arrays(said)
        self._unit = said[0].unit
        tau = np.sqrt(len(s) / (s**-2).sum()) * np.exp(_LOG_TAU)
        w = 1 / (s**2 + tau[:, None] ** 2)
        total = w.sum(axis=1)
        self._mean = (w * y).sum(axis=1) / total
        q = (w * (y - self._mean[:, None]) ** 2).sum(axis=1)
        prior = _LOG_TAU - 2 * np.log1p(np.exp(_LOG_TAU))  # DuMouchel's, over ln tau
        log = prior + 0.5 * (np.log(w).sum(axis=1) - np.log(total) - q)
        self._share = np.exp(log - log.max()) / np.exp(log - log.max()).sum()
        self._std = np.sqrt(tau**2 + 1 / total)

    def chance(self, one: Number) -> float:
        """Probability of a measured value as far out as this one, on either side."""
        z = (one.value - self._mean) / np.hypot(self._std, one.std)
        return float(min(1.0, 2 * min(self._share @ ndtr(z), self._share @ ndtr(-z))))

    @property
    def number(self) -> Number:
        """Median and half of the central 68 %."""
        low, middle, high = (self._quantile(p) for p in (1 - ONE, 0.5, ONE))
        return Number(middle, (high - low) / 2, self._unit)

    def _quantile(self, p: float) -> float:
        far = 9 * self._std
        low, high = float((self._mean - far).min()), float((self._mean + far).max())

        def beyond(x: float) -> float:
            return float(self._share @ ndtr((x - self._mean) / self._std)) - p

        return float(brentq(beyond, low, high, xtol=1e-300))


def _arrays(said: Sequence[Number]) -> tuple[Floats, Floats]:
    return np.array([one.value for one in said], dtype=float), np.array([one.std for one in said], dtype=float)


def to_json(found: Fleet) -> dict[str, Any]:
    """What `--json` prints."""
    return {
        "schema": SCHEMA_ID,
        "cell": found.units[0].result.cell,
        "units": [{"name": run.label, "verdict": run.result.mismatch.verdict} for run in found.units],
        "numbers": {one.name: asdict(one) for one in found.spreads},
        "too_few_units": {name: {u: asdict(one) for u, one in by.items()} for name, by in found.alone.items()},
        "laws": found.laws,
        "shared_laws": found.shared_laws,
        "differences": found.sentences,
        "comparisons": found.comparisons,
    }
