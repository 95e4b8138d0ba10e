"""A model with laws, fitted together with all parameters."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.special import chdtri

from compass_ros.calibration.least_squares import Fit, normal_equations
from compass_ros.calibration.likelihood import Likelihood
from compass_ros.calibration.residuals import covariance, variances
from compass_ros.discovery.discrepancy import Free, free, spread, with_law
from compass_ros.discovery.first_order import WIDTH
from compass_ros.discovery.response import Response, respond
from compass_ros.discovery.settings import SLIGHT
from compass_ros.discovery.zero import Zero, zero
from compass_ros.simulation import Simulator
from compass_ros.simulation.effects import Attached
from compass_ros.types import Floats

SPREADS = (0.3, 1.0, 3.0, 10.0, 30.0)
"""Spreads of a law of chance that are equally probable before, in its modest size."""


def name_of(laws: Sequence[Attached]) -> str:
    """A model by its laws and their sites, each of these once."""
    said = (f"{a.effect.name}({', '.join(a.distinct)})" if a.objects else a.effect.name for a in laws)
    return " + ".join(sorted(said)) or "none"


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """A set of laws on sites, with its fit."""

    laws: tuple[Attached, ...]
    simulator: Simulator
    likelihood: Likelihood
    fit: Fit
    without: Floats | None = None
    """(E, F, C) what the simulator without laws leaves at its own fit [sigma]; None: this is it."""
    corrections: tuple[Attached, ...] = ()
    """Those of its laws that stand for what the form of the others lacks (`form.py`)."""

    @property
    def name(self) -> str:
        return name_of(self.laws)

    @property
    def physics(self) -> tuple[Attached, ...]:
        """Its laws without the corrections."""
        return tuple(a for a in self.laws if a not in self.corrections)

    @property
    def chi_square(self) -> float:
        return 2 * self.fit.point.cost / self.likelihood.measurements

    @property
    def above_noise(self) -> float:
        """Squared residual above what noise alone leaves [sigma^2]."""
        return max(2 * self.fit.point.cost - self.likelihood.measurements, 0.0)

    @cached_property
    def promised(self) -> float:
        """Fall of half the squared residual that one more Gauss-Newton step promises [sigma^2]."""
        hessian, gradient = normal_equations(
            self.likelihood, self.fit.point, self.fit.linear, self.fit.free, self.fit.robust
        )
        return 0.5 * float(gradient @ np.linalg.solve(hessian, gradient))

    @property
    def at_noise(self) -> bool:
        """Whether the mean square of what its fit leaves is one that the noise exceeds with probability SLIGHT."""
        independent = self.likelihood.measurements / self.likelihood.correlation_time
        return bool(self.chi_square * independent <= chdtri(independent, SLIGHT))

    @cached_property
    def response(self) -> Response:
        return respond(self.simulator, self.likelihood, self.fit)

    @property
    def bare(self) -> Floats:
        """(E, F, C) what the simulator without laws leaves at its own fit [sigma]."""
        return self.fit.linear.residual if self.without is None else self.without

    @cached_property
    def sizes(self) -> Floats:
        """(S,) rms of all its laws along the fitted motion."""
        return self.sizes_of(self.laws)

    def sizes_of(self, laws: Sequence[Attached]) -> Floats:
        """(S,) rms of some of its laws along the fitted motion: accelerations, and errors of signals.

        A force has its size along each line on which it could push a body: its direction may be as wrong as its size.
        What acts on contacts, commands, signals or numbers of the scene counts as what moves the recordings as much as
        the laws do when all parameters have taken their best values with them and without: a stiffer wall beside a
        softer ball is nothing.
        """
        response, squared = self.response, np.zeros(len(self.response.unit))
        moved = self.bare - self.fit.linear.residual
        channels = set()
        for attached, own in self.own():
            if attached not in laws or attached.effect.scattered:
                continue  # of a scatter each episode has its own number: no form that could be wrong
            pushes = attached.effect.forces is not None and attached.effect.channel == "dynamics"
            if pushes:
                squared += np.mean(self._pushed(attached, own) ** 2, axis=(0, 1))
            if not pushes or attached.effect.model is not None:
                channels.add("sensing" if attached.effect.channel == "sensing" else "motion")
        for group in response.groups():
            squared[group] = squared[group].mean()
        if "sensing" in channels:
            squared[len(response.site_of) :] += np.mean((moved * self.likelihood.sigma) ** 2, axis=(0, 1))
        if "motion" in channels:
            squared += self._as_push(moved) ** 2
        return np.sqrt(squared)

    def _pushed(self, attached: Attached, own: slice) -> Floats:
        """(E, K, S) accelerations by a law of forces."""
        values = self.fit.point.values
        if self.response.follows(attached):
            return self.response.accelerations(attached, values[own])
        absent = values.copy()
        absent[own] = np.where(attached.amplitudes, 0.0, values[own])
        return self.response.at_once(values, absent)

    def _as_push(self, moved: Floats) -> Floats:
        """(S,) accelerations, each in proportion to its motion's, that move the recordings together as much."""
        unit = self.response.unit * self.response.forces
        root = spread(self.response, unit)
        by_push = float(np.sum((self.response.tangent.pushes @ root.root) ** 2)) if root is not None else np.inf
        return np.asarray(unit * np.sqrt(np.sum(moved**2) / max(by_push, 1e-300)))

    @cached_property
    def free(self) -> Free:
        """With a discrepancy of any size beside its laws."""
        return free(self.response)

    @cached_property
    def _with_law(self) -> tuple[float, float]:
        return with_law(self.response, self.sizes)

    @property
    def log_evidence(self) -> float:
        """With a discrepancy in proportion to its laws; without laws, with none."""
        chance = sum(law.drawn for law in self.laws)
        return self._with_law[0] - chance * float(np.log(len(SPREADS))) if self.laws else self.free.alone

    @cached_property
    def std(self) -> Floats:
        """(P + Q,) standard deviations of parameters and laws; the prior's where the recordings say nothing.

        A law has the library's formula, which need not be nature's: what the episodes disagree on counts too.
        """
        std, free = self.likelihood.prior_std.copy(), self.fit.free
        std[free] *= np.sqrt(variances(self.likelihood, self.fit))
        for attached, own in self.own():
            if attached.effect.scattered:  # of so few deviations
                std[own] = self.fit.point.values[own] / np.sqrt(2 * len(self.likelihood.inputs))
        return std

    @property
    def among(self) -> Floats:
        """(n, n) covariance of what is free, by the noise, in squares of the prior's standard deviations."""
        n = len(self.fit.free)
        return covariance(self.likelihood, self.fit)[:n, :n]

    @property
    def root(self) -> Floats:
        """(P + Q, n) a square root of the covariance of parameters and laws by the noise; none along the others."""
        free = self.fit.free
        root = np.zeros((len(self.fit.point.values), len(free)))
        size, axes = np.linalg.eigh(self.among)
        root[free] = axes * np.sqrt(np.maximum(size, 0.0)) * self.likelihood.prior_std[free][:, None]
        return root

    def own(self) -> Iterator[tuple[Attached, slice]]:
        """Each of its laws with the place of its numbers among all values."""
        at = len(self.simulator.cell.parameters)
        for attached in self.laws:
            size = len(attached.effect.quantities)
            yield attached, slice(at, at + size)
            at += size

    @cached_property
    def zero(self) -> Zero:
        """Which of its laws may be zero."""
        return zero(self.likelihood, self.fit, tuple(self.own()))

    @property
    def rho(self) -> float:
        """Posterior mean of the discrepancy's size, as a share of the laws' own."""
        return self._with_law[1] if self.laws else 0.0


def played(likelihood: Likelihood, simulator: Simulator) -> Likelihood:
    """The same recordings beside another simulator; its priors are for the caller to say where it has other numbers."""
    return replace(
        likelihood,
        predict=simulator.observe,
        predict_alike=simulator.observe_alike,
        parameters=simulator.parameters,
    )


def widened(simulator: Simulator, likelihood: Likelihood, added: Sequence[Attached]) -> tuple[Simulator, Likelihood]:
    """A simulator and likelihood with more effects; priors wide beside a modest effect, bounded by what is physical."""
    wider = simulator.with_effects([*simulator.effects, *added])
    quantities = [q for a in added for q in a.effect.quantities]
    mean = [q.begins if q.amplitude else q.start for q in quantities]
    std = [WIDTH * q.scale if q.amplitude else (q.high - q.low) / 4 for q in quantities]
    more = sum(a.drawn for a in added)
    return wider, replace(
        played(likelihood, wider),
        inputs=np.pad(likelihood.inputs, ((0, 0), (0, more))),
        launch_std=np.pad(likelihood.launch_std, (0, more)),
        prior_mean=np.concatenate([likelihood.prior_mean, mean]),
        prior_std=np.concatenate([likelihood.prior_std, std]),
    )
