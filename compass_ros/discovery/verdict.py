"""The rule: posterior odds at a stated false-alarm rate decide none, named, ambiguous or unknown."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from compass_ros.calibration.likelihood import Likelihood
from compass_ros.calibration.noise import Noise
from compass_ros.calibration.refine import with_launches
from compass_ros.calibration.residuals import covariance, jackknife
from compass_ros.discovery.finding import Discovery, Tried
from compass_ros.discovery.hypothesis import Hypothesis
from compass_ros.discovery.next_shot import next_experiment
from compass_ros.discovery.search import Found
from compass_ros.discovery.where import left_by, residual_map, whereabouts
from compass_ros.discovery.words import errors, place, value_of, where_of
from compass_ros.simulation import Simulator
from compass_ros.simulation.replay import rms_distance
from compass_ros.types import (
    EffectFinding,
    EffectParameter,
    Evidence,
    ExplainedLaw,
    Explanation,
    Floats,
    Mismatch,
    Verdict,
)

UNKNOWN = "unknown"
SAID = 6
"""Explanations that a result lists, the most probable first; the rest together are less than a thousandth or so."""


@dataclass(frozen=True)
class Judge:
    """What turns probabilities into a verdict; held-out episodes are opened here, after it is settled."""

    found: Found
    held_out: Likelihood
    noise: Noise
    alpha: float
    threshold: float
    """Log posterior odds against the plain model that noise exceeds with probability alpha."""
    odds: Floats
    """Largest ones in recordings simulated from the plain model."""
    undetectable: tuple[str, ...]
    seed: int
    warnings: tuple[str, ...]

    @property
    def simulator(self) -> Simulator:
        return self.found.plain.simulator

    def discovery(self) -> Discovery:
        """The verdict with all that goes with it."""
        unknown, of_models = self.found.probabilities[1:]
        best = max([self.found.unknown, *self.found.odds], default=-np.inf)
        if best <= self.threshold:
            return self._none()
        models = self._explaining(of_models)
        if not models or unknown > 0.5:
            return self._unknown()
        return self._named(models, "named" if len(models) == 1 else "ambiguous")

    def _explaining(self, of_models: Floats) -> list[Hypothesis]:
        """The smallest set of models that holds 1 - alpha, the most probable first.

        A law that all of them share is sure, whatever else may be: where models with exactly the laws that are sure
        (posterior inclusion probability, Barbieri and Berger 2004) were fitted, the set is one of these.
        """
        names = [frozenset(a.effect.name for a in m.laws) for m in self.found.models]
        sure = frozenset(
            name
            for name in frozenset[str]().union(*names)
            if sum(p for p, own in zip(of_models, names, strict=True) if name in own) >= 1 - self.alpha
        )
        chosen = [i for i, own in enumerate(names) if own == sure] if sure else []
        order = sorted(chosen or range(len(names)), key=lambda i: -of_models[i])
        of_order = np.array([of_models[i] for i in order])
        held = np.cumsum(of_order) / (of_order.sum() if chosen else 1.0)
        count = int(np.searchsorted(held, 1 - self.alpha)) + 1
        return [self.found.models[i] for i in order[:count]]

    def _none(self) -> Discovery:
        numbers = f"held-out error {1e3 * self._before:.2f} {self._unit}, noise {1e3 * self._floor:.2f} {self._unit}"
        sentence = f"Nothing is missing that these recordings could show: {numbers}."
        return self._said(Mismatch("none", None, (), self.undetectable, "", sentence, self._explanations(), self.alpha))

    def _unknown(self) -> Discovery:
        where = whereabouts(self.found.plain.response, self.found.plain.free)
        sentence = f"{place(where, self._flat)}, something differs that no known law explains"
        if self.found.models:
            best = self.found.models[0]
            p = self.found.probabilities
            sentence += f" (probability {p[1]:.2f}; the best law, {best.name}, has {p[2][0]:.2g})"
        before = f"held-out error {1e3 * self._before:.2f} {self._unit}, floor {1e3 * self._floor:.2f} {self._unit}"
        mismatch = Mismatch(
            "unknown", where, (), self.undetectable, "", f"{sentence}; {before}.", self._explanations(), self.alpha
        )
        return self._said(mismatch)

    def _named(self, models: Sequence[Hypothesis], verdict: Verdict) -> Discovery:
        best = models[0]
        std = deviations(best)
        findings, at = [], len(self.simulator.cell.parameters)
        for attached in best.laws:
            size = len(attached.effect.quantities)
            others = (a.effect.name for m in models[1:] for a in m.laws)
            findings.append(
                EffectFinding(
                    attached.effect.name,
                    _quantities(attached.effect.quantities, best.fit.point.values[at : at + size], std[at : at + size]),
                    self._evidence(best),
                    tuple(dict.fromkeys(n for n in others if n != attached.effect.name)),
                )
            )
            at += size
        at = len(self.simulator.cell.parameters)
        first = best.fit.point.values[at : at + len(best.laws[0].effect.quantities)]
        where = where_of(best.laws[0], first, self.simulator.movers())
        following = ""
        lacks = " and ".join(dict.fromkeys(a.effect.sentence for a in best.laws))
        if verdict == "ambiguous":
            following = next_experiment(self.simulator, best.likelihood, models, self.seed).sentence
            lacks = "one of these: " + "; ".join(dict.fromkeys(m.name for m in models))
        values = "; ".join(value_of(f, a) for f, a in zip(findings, best.laws, strict=True))
        after = self._error(best)
        said = errors(self._before, after, self._floor, self.simulator.unit)
        sentence = f"{place(where, self._flat)}, the simulator lacks {lacks}; {values}; {said}."
        mismatch = Mismatch(
            verdict,
            where,
            tuple(findings),
            self.undetectable,
            following,
            sentence,
            self._explanations(),
            self.alpha,
        )
        cell = len(self.simulator.cell.parameters)
        return self._said(mismatch, best, std[:cell], std)

    def _said(
        self,
        mismatch: Mismatch,
        best: Hypothesis | None = None,
        std: Floats | None = None,
        all_std: Floats | None = None,
    ) -> Discovery:
        plain = self.found.plain
        values = best.fit.point.values if best else None
        return Discovery(
            mismatch,
            best.simulator if best else None,
            values,
            None if values is None else values[: len(self.simulator.cell.parameters)],
            std,
            all_std,
            self._tried(best),
            residual_map(plain.response, left_by(plain.response, plain.free)),
            residual_map(best.response, left_by(best.response, best.free)) if best else None,
            self.warnings,
        )

    def _explanations(self) -> tuple[Explanation, ...]:
        none, unknown, of_models = self.found.probabilities
        rows = [
            Explanation((), none, self.found.plain.log_evidence),
            Explanation((ExplainedLaw(UNKNOWN, (), {}),), unknown, self.found.plain.log_evidence + self.found.unknown),
        ]
        for model, p in zip(self.found.models, of_models, strict=True):
            rows.append(Explanation(_explained(model), float(p), model.log_evidence))
        return tuple(sorted(rows, key=lambda e: -e.probability))[:SAID]

    def _tried(self, best: Hypothesis | None) -> tuple[Tried, ...]:
        p = self.found.probabilities[2]
        return tuple(
            Tried(m.name, m.laws[0].effect.channel, o, 0.0, m is best, f"probability {q:.3g}")
            for m, o, q in zip(self.found.models, self.found.odds, p, strict=True)
        )

    def _evidence(self, model: Hypothesis) -> Evidence:
        odds = self.found.odds[self.found.models.index(model)]
        before, after, floor = self._before, self._error(model), self._floor
        gain = float(np.clip((before - after) / max(before - floor, 1e-9), -1.0, 1.0))
        alarms = float((1 + np.sum(self.odds >= odds)) / (1 + len(self.odds)))
        return Evidence(gain, odds, alarms)

    def _error(self, model: Hypothesis) -> float:
        """rms distance on held-out episodes [m or rad], each with the launch that agrees best with it."""
        judged = model.likelihood.on(self.held_out)
        values = model.fit.point.values
        inputs = judged.inputs + with_launches(judged, values).launch
        predicted = judged.predict(np.tile(values, (len(inputs), 1)), inputs, judged.time_s)
        return rms_distance(self.simulator.cell, judged.difference(predicted, judged.measured))

    @property
    def _before(self) -> float:
        return self._error(self.found.plain)

    @property
    def _floor(self) -> float:
        return rms_distance(self.simulator.cell, self.noise.rms[None, None])

    @property
    def _unit(self) -> str:
        return f"m{self.simulator.unit}"

    @property
    def _flat(self) -> bool:
        """Whether something that is tracked slides on a table."""
        return any(site.kind not in ("hinge", "slide") for site in self.found.plain.response.sites)


def _explained(model: Hypothesis) -> tuple[ExplainedLaw, ...]:
    std = deviations(model)
    out, at = [], len(model.simulator.cell.parameters)
    for attached in model.laws:
        size = len(attached.effect.quantities)
        own = slice(at, at + size)
        quantities = _quantities(attached.effect.quantities, model.fit.point.values[own], std[own])
        out.append(ExplainedLaw(attached.effect.name, attached.objects, quantities))
        at += size
    return tuple(out)


def _quantities(quantities: Sequence[object], numbers: Floats, std: Floats) -> Mapping[str, EffectParameter]:
    return {
        q.name: EffectParameter(float(v), float(e), q.unit)  # type: ignore[attr-defined]
        for q, v, e in zip(quantities, numbers, std, strict=True)
    }


def deviations(model: Hypothesis) -> Floats:
    """(P + Q,) standard deviations; the prior's where the recordings say nothing.

    A law has the library's formula, which need not be nature's: what the episodes disagree on counts where it is more
    than the noise.
    """
    std = model.likelihood.prior_std.copy()
    free = model.fit.free
    of_noise = np.diag(covariance(model.likelihood, model.fit))[: len(free)]
    of_episodes = np.minimum(np.diag(jackknife(model.likelihood, model.fit)), 1.0)  # the prior's at most
    std[free] *= np.sqrt(np.maximum(of_noise, of_episodes))
    return std
