"""Which laws of a model may be zero: by what the noise leaves of them, and by what the episodes disagree on."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import chdtrc, chdtri

from compass_ros.calibration.least_squares import Fit, normal_equations
from compass_ros.calibration.likelihood import Likelihood
from compass_ros.calibration.residuals import jackknife
from compass_ros.simulation.effects import Attached
from compass_ros.types import Floats, Ints

ERROR_BARS = 2.0
"""Error bars from zero within which a law is not named: a 95 % interval that holds its absence."""


@dataclass(frozen=True, eq=False)
class Zero:
    """Amplitudes of laws, with the errors of their estimates."""

    laws: tuple[tuple[Attached, Ints], ...]
    """Each with the places of its amplitudes; without those of chance, which are judged by their episodes."""
    away: Floats
    """(p,) how far each number is from where it is absent, in standard deviations of the prior."""
    errors: tuple[Floats, ...]
    """(p, p) covariances: by the noise, and by what the episodes disagree on."""
    told: Floats
    """(p,) share of each number's direction (squared) along which the recordings say more than the prior."""

    @property
    def weakest(self) -> tuple[Attached, ...]:
        """The law, on all its sites, that may be zero and lies nearest to it; empty: none may."""
        named: dict[tuple[str, tuple[str, ...]], list[Attached]] = {}
        for a, _ in self.laws:
            named.setdefault((a.effect.name, a.objects if a.effect.apart else ()), []).append(a)
        return self._nearest(list(named.values()))

    @property
    def weakest_site(self) -> tuple[Attached, ...]:
        """The one site of a law on several that may lack it and lies nearest to that; empty: none may."""
        own = [a for a, _ in self.laws if not a.effect.apart]
        count = Counter(a.effect.name for a in own)
        return self._nearest([[a] for a in own if count[a.effect.name] > 1])

    def absent(self, laws: Sequence[Attached]) -> tuple[Attached, ...]:
        """Of some laws the most that may all be zero together, those that lie nearest to it. By the noise alone: a site
        that one of a few episodes shows is for the evidence to keep or to drop."""
        noise = replace(self, errors=self.errors[:1])
        order = noise.nearest_first(laws)
        return next((tuple(order[:n]) for n in range(len(order), 0, -1) if noise.may_lack(order[:n])), ())

    def nothing(self, laws: Sequence[Attached]) -> bool:
        """Whether the fit has all amplitudes of some laws at zero: it is that of the model without them."""
        return all(not np.any(self.away[own]) for a, own in self.laws if a in laws)

    def shown(self, law: Attached) -> bool:
        """Whether the recordings say more of its amplitudes than the prior does, for the most part."""
        return any(a is law and bool(np.all(self.told[own] > 0.5)) for a, own in self.laws)

    def nearest_first(self, laws: Sequence[Attached]) -> list[Attached]:
        """Laws by how far each alone is from zero in its error bars."""
        return sorted(laws, key=lambda a: self._distance([a])[0])

    def may_lack(self, laws: Sequence[Attached]) -> bool:
        """Whether zero is in the region of that confidence of all amplitudes of some laws together. Of two that do
        nearly the same, each may be zero beside the other, and both may not."""
        squared, amplitudes = self._distance(laws)
        return bool(squared < chdtri(amplitudes, chdtrc(1, ERROR_BARS**2)))

    def _nearest(self, choices: Sequence[Sequence[Attached]]) -> tuple[Attached, ...]:
        may = sorted((laws for laws in choices if self.may_lack(laws)), key=lambda laws: self._distance(laws)[0])
        return tuple(may[0]) if may else ()

    def _distance(self, laws: Sequence[Attached]) -> tuple[float, int]:
        """Squared distance of amplitudes from zero in their error bars, the longer ones, and how many they are."""
        own = np.concatenate([at for a, at in self.laws if a in laws])
        return min(_squared(self.away[own], cov[np.ix_(own, own)]) for cov in self.errors), len(own)


def zero(likelihood: Likelihood, fit: Fit, laws: Sequence[tuple[Attached, slice]]) -> Zero:
    """Of laws, each with the place of its numbers among all values of a fit.

    Shapes are taken as they are: at zero these mean nothing, and an amplitude may be unsure because its shape is. Along
    directions of which the recordings say less than the prior nothing is judged: where only ratios show, all numbers
    are unsure by one common factor, and none of them is near zero for that.
    """
    shapes = [own.start + np.flatnonzero(~a.amplitudes) for a, own in laws]
    kept = np.flatnonzero(~np.isin(fit.free, np.concatenate([*shapes, np.empty(0, int)])))
    held = replace(fit, linear=fit.linear.only(kept), free=fit.free[kept])
    free, p = held.free, len(kept)
    hessian, _ = normal_equations(likelihood, held.point, held.linear, free, held.robust)
    prior = np.eye(len(hessian))
    errors = np.linalg.inv((hessian - prior) / likelihood.correlation_time + prior)[:p, :p]
    told, axes = np.linalg.eigh(np.linalg.inv(errors) - np.eye(p))
    axes = axes[:, told > 1.0]
    bars = tuple(axes @ (axes.T @ cov @ axes) @ axes.T for cov in (errors, jackknife(likelihood, held)))
    places = [(a, own.start + np.flatnonzero(a.amplitudes)) for a, own in laws if not a.effect.scattered]
    away = ((fit.point.values - likelihood.prior_mean) / likelihood.prior_std)[free]
    return Zero(tuple((a, np.flatnonzero(np.isin(free, at))) for a, at in places), away, bars, np.sum(axes**2, axis=1))


def _squared(away: Floats, errors: Floats) -> float:
    """Distance of (n,) amplitudes from zero with (n, n) errors; infinite where these are 0."""
    if not np.any(errors):
        return np.inf
    return max(float(away @ np.linalg.lstsq(errors, away, rcond=None)[0]), 0.0)
