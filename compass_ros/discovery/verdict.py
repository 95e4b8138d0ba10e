"""The rule: posterior odds at a stated false-alarm rate decide none, named, ambiguous or unknown."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from compass_ros.calibration.likelihood import Likelihood
from compass_ros.calibration.noise import Noise
from compass_ros.discovery.finding import Discovery, Tried, held_out_error
from compass_ros.discovery.floor import TWICE, shown_noise
from compass_ros.discovery.hypothesis import Hypothesis
from compass_ros.discovery.maps import table_map
from compass_ros.discovery.next_shot import next_experiment
from compass_ros.discovery.search import Found
from compass_ros.discovery.where import whereabouts
from compass_ros.discovery.words import DEPENDS, errors, place, value_of, where_of
from compass_ros.simulation import Simulator
from compass_ros.simulation.replay import rms_distance
from compass_ros.simulation.sites import PLANAR
from compass_ros.types import (
    EffectFinding,
    EffectParameter,
    Evidence,
    ExplainedLaw,
    Explanation,
    Floats,
    Mismatch,
    Verdict,
    Where,
)

UNKNOWN = "unknown"
SAID = 6
"""Explanations that a result lists, the most probable first; the rest together are less than a thousandth or so."""


@dataclass(frozen=True, eq=False)
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
        noise, unit = self.noise, f"m{self.simulator.unit}"
        if self._before >= TWICE * self._floor:
            noise = shown_noise(noise, self.found.plain.likelihood, self.found.plain.fit)
        floor = rms_distance(self.simulator.cell, noise.rms[None, None])
        numbers = f"held-out error {1e3 * self._before:.2f} {unit}, noise {1e3 * floor:.2f} {unit}"
        return replace(
            self._said("none", f"Nothing is missing that these recordings could show: {numbers}."), noise=noise
        )

    def _unknown(self) -> Discovery:
        unit = f"m{self.simulator.unit}"
        where = whereabouts(self.found.plain.response, self.found.plain.free)
        sentence = f"{place(where, self._flat)}, something differs that no known law explains"
        sentence += DEPENDS[where.depends_on]
        if self.found.models:
            _, unknown, of_models = self.found.probabilities
            best = self.found.models[0].name
            sentence += f" (probability {unknown:.2f}; the best law, {best}, has {of_models[0]:.2g})"
        before = f"held-out error {1e3 * self._before:.2f} {unit}, floor {1e3 * self._floor:.2f} {unit}"
        return self._said("unknown", f"{sentence}; {before}.", where)

    def _named(self, models: Sequence[Hypothesis], verdict: Verdict) -> Discovery:
        best, values = models[0], models[0].fit.point.values
        after = held_out_error(self.simulator.cell, best.likelihood.on(self.held_out), values)
        evidence = self._evidence(best, after)
        others = dict.fromkeys(a.effect.name for m in models[1:] for a in m.laws)
        findings = tuple(
            EffectFinding(law.name, law.quantities, evidence, tuple(n for n in others if n != law.name))
            for law in _explained(best)
        )
        first = next(own for _, own in best.own())
        where = where_of(best.laws, values[first], self.simulator.movers())
        following = ""
        lacks = " and ".join(dict.fromkeys(a.effect.sentence for a in best.laws))
        if verdict == "ambiguous":
            following = next_experiment(self.simulator, best.likelihood, models, self.seed).sentence
            lacks = "one of these: " + "; ".join(dict.fromkeys(m.name for m in models))
        names = [a.effect.name for a in best.laws]
        sizes = "; ".join(
            value_of(f, a, names.count(a.effect.name) > 1) for f, a in zip(findings, best.laws, strict=True)
        )
        said = errors(self._before, after, self._floor, self.simulator.unit)
        sentence = f"{place(where, self._flat)}, the simulator lacks {lacks}; {sizes}; {said}."
        return self._said(verdict, sentence, where, findings, following, best)

    def _said(
        self,
        verdict: Verdict,
        sentence: str,
        where: Where | None = None,
        findings: tuple[EffectFinding, ...] = (),
        following: str = "",
        best: Hypothesis | None = None,
    ) -> Discovery:
        mismatch = Mismatch(
            verdict, where, findings, self.undetectable, following, sentence, self._explanations(), self.alpha
        )
        tried = self._tried(best, findings[0].evidence.held_out_gain if findings else math.nan)
        plain, cell = self.found.plain, len(self.simulator.cell.parameters)
        before = table_map(plain.response, plain.free.pushes)
        if best is None:
            return Discovery(mismatch, tried=tried, before=before, warnings=self.warnings)
        values, std = best.fit.point.values, best.std
        after = table_map(best.response, best.free.pushes)
        return Discovery(
            mismatch, best.simulator, values, values[:cell], std[:cell], std, tried, before, after, self.warnings
        )

    def _explanations(self) -> tuple[Explanation, ...]:
        none, unknown, of_models = self.found.probabilities
        plain = self.found.plain.log_evidence
        rows = [
            Explanation((), none, plain),
            Explanation((ExplainedLaw(UNKNOWN, (), {}),), unknown, plain + self.found.unknown),
            *(
                Explanation(_explained(m), float(p), m.log_evidence)
                for m, p in list(zip(self.found.models, of_models, strict=True))[:SAID]
            ),
        ]
        return tuple(sorted(rows, key=lambda e: -e.probability))[:SAID]

    def _tried(self, best: Hypothesis | None, gain: float) -> tuple[Tried, ...]:
        """The most probable models. Held-out episodes are opened for the one that is said, and for no other."""
        rows = list(zip(self.found.models, self.found.odds, self.found.probabilities[2], strict=True))[:SAID]
        return tuple(
            Tried(
                m.name,
                m.laws[0].effect.channel,
                odds,
                gain if m is best else math.nan,
                m is best,
                f"probability {p:.3g}",
            )
            for m, odds, p in rows
        )

    def _evidence(self, model: Hypothesis, after: float) -> Evidence:
        odds = self.found.odds[self.found.models.index(model)]
        gain = float(np.clip((self._before - after) / max(self._before - self._floor, 1e-9), -1.0, 1.0))
        alarms = float((1 + np.sum(self.odds >= odds)) / (1 + len(self.odds)))
        return Evidence(gain, odds, alarms)

    @cached_property
    def _before(self) -> float:
        """Held-out error of the simulator without laws."""
        plain = self.found.plain
        return held_out_error(self.simulator.cell, plain.likelihood.on(self.held_out), plain.fit.point.values)

    @property
    def _flat(self) -> bool:
        """Whether something that is tracked slides in a plane."""
        return any(site.kind in PLANAR for site in self.simulator.moving.values())

    @property
    def _floor(self) -> float:
        return rms_distance(self.simulator.cell, self.noise.rms[None, None])


def _explained(model: Hypothesis) -> tuple[ExplainedLaw, ...]:
    """The laws of a model with their numbers."""
    values, out = model.fit.point.values, []
    for attached, own in model.own():
        numbers = zip(attached.effect.quantities, values[own], model.std[own], strict=True)
        quantities = {q.name: EffectParameter(float(v), float(e), q.unit) for q, v, e in numbers}
        out.append(ExplainedLaw(attached.effect.name, attached.objects, quantities))
    return tuple(out)
