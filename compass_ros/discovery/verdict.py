"""The rule: posterior odds at a stated false-alarm rate decide none, named, ambiguous or unknown."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from compass_ros.calibration.likelihood import Likelihood
from compass_ros.calibration.noise import Noise
from compass_ros.discovery.finding import Discovery, Tried, Weighed, held_out_error
from compass_ros.discovery.floor import TWICE, shown_noise
from compass_ros.discovery.hypothesis import Hypothesis
from compass_ros.discovery.maps import table_map
from compass_ros.discovery.numerics import with_numerics
from compass_ros.discovery.search import Found
from compass_ros.discovery.settings import SLIGHT
from compass_ros.discovery.where import whereabouts
from compass_ros.discovery.words import DEPENDS, corrected, errors, missing, place, short_name, values_of, where_of
from compass_ros.simulation import Simulator
from compass_ros.simulation.effects import Attached
from compass_ros.simulation.replay import rms_distance
from compass_ros.simulation.site_kinds import word_of
from compass_ros.simulation.sites import Site, any_slides
from compass_ros.types import (
    GENERAL,
    EffectFinding,
    EffectParameter,
    Evidence,
    ExplainedLaw,
    Explanation,
    Floats,
    HeldOut,
    Mismatch,
    Verdict,
    Where,
)

UNKNOWN = "unknown"
SAID = 6
"""Models with laws that a result lists; the rest together are less than a thousandth or so."""


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
    warnings: tuple[str, ...]
    opened: dict[str, float] = field(default_factory=dict)
    """Held-out errors by name of the model, as they become known."""

    @property
    def simulator(self) -> Simulator:
        return self.found.plain.simulator

    def discovery(self) -> Discovery:
        """The verdict with all that goes with it."""
        unknown, of_models = self.found.probabilities[1:]
        best = max([self.found.unknown, *self.found.odds], default=-np.inf)
        if best <= self.threshold:
            noise = self._shown()
            return (self if noise is self.noise else replace(self, noise=noise)).none()
        models = self._explaining(of_models)
        if not models or unknown > 0.5:
            return self._unknown()
        return self._named(models, "named" if len(models) == 1 else "ambiguous")

    def _weighed(self) -> tuple[Weighed, ...]:
        """The models that have a share of the probability, the plain one too; others are not at their optimum."""
        none, _, of_models = self.found.probabilities
        rows = [(none, self.found.plain), *zip(of_models, self.found.models, strict=True)]
        return tuple(Weighed(float(p), m.simulator, m.fit.point.values, m.root) for p, m in rows if p >= SLIGHT)

    def _explaining(self, of_models: Floats) -> list[Hypothesis]:
        """The smallest set of models that holds 1 - alpha, the most probable first.

        A law that all of them share is sure, whatever else may be: where models with exactly the laws that are sure
        (posterior inclusion probability, Barbieri and Berger 2004) hold more than alpha, the set is one of these.
        """
        names = [frozenset(a.effect.name for a in m.physics) for m in self.found.models]
        sure = frozenset(
            name
            for name in frozenset[str]().union(*names)
            if sum(p for p, own in zip(of_models, names, strict=True) if name in own) >= 1 - self.alpha
        )
        chosen = [i for i, own in enumerate(names) if own == sure] if sure else []
        if sum(of_models[i] for i in chosen) <= self.alpha:
            chosen = []  # refuted: something has to be beside them, and which is open
        order = sorted(chosen or range(len(names)), key=lambda i: -of_models[i])
        of_order = np.array([of_models[i] for i in order])
        held = np.cumsum(of_order) / (of_order.sum() if chosen else 1.0)
        count = int(np.searchsorted(held, 1 - self.alpha)) + 1
        return [self.found.models[i] for i in order[:count]]

    def _shown(self) -> Noise:
        """The noise, with what the fit has shown of it where nothing is missing and yet much is left."""
        if self._before < TWICE * self._floor:
            return self.noise
        return shown_noise(self.noise, self.found.plain.likelihood, self.found.plain.fit)

    def none(self) -> Discovery:
        """That nothing is missing."""
        unit = f"m{self.simulator.unit}"
        numbers = f"{self._error} {1e3 * self._before:.2f} {unit}, noise {1e3 * self._floor:.2f} {unit}"
        sentence = f"Nothing is missing that these recordings could show: {numbers}."
        return replace(self._said("none", sentence), noise=self.noise)

    def _unknown(self) -> Discovery:
        unit = f"m{self.simulator.unit}"
        where = whereabouts(self.found.plain.response, self.found.plain.free)
        sentence = f"{place(where, self._flat)}, something differs that no known law explains"
        sentence += DEPENDS[where.depends_on]
        _, unknown, of_models = self.found.probabilities
        sentence += f" (probability {unknown:.2f}{self._best_law(of_models)})"
        before = f"{self._error} {1e3 * self._before:.2f} {unit}, floor {1e3 * self._floor:.2f} {unit}"
        return self._said("unknown", f"{sentence}; {before}.", self._of_discrepancy(where))

    def _best_law(self, of_models: Floats) -> str:
        """The most probable model that comes nearer than none, and what it leaves of the episodes that judge."""
        if not self.found.models or self.found.models[0].chi_square >= self.found.plain.chi_square:
            return ""
        best = self.found.models[0]
        has = f"{of_models[0]:.2g}" if of_models[0] >= 0.001 else "less than 0.001"
        left = f"{1e3 * self._after(best):.2f} m{self.simulator.unit}"
        return f"; the best law, {short_name(best.physics)}, has {has}, {self._error} with it {left}"

    def _of_discrepancy(self, where: Where) -> Where:
        """With the site of a discrepancy that no law explains."""
        if where.channel == "sensing":
            return _on(where, self.simulator.places.signals, ())
        sites = [s for s in self.found.plain.response.sites if where.object in ("all", s.name)]
        return _on(where, sites, [sites[0].name] if len(sites) == 1 else ())

    def _named(self, models: Sequence[Hypothesis], verdict: Verdict) -> Discovery:
        best, values = models[0], models[0].fit.point.values
        after = self._after(best)
        evidence = self._evidence(best, after)
        others = dict.fromkeys(a.effect.name for m in models[1:] for a in m.physics)
        findings = tuple(
            EffectFinding(law.name, law.quantities, evidence, tuple(n for n in others if n != law.name))
            for law in _explained(best, best.physics)
        )
        numbers = [values[own] for attached, own in best.own() if attached in best.physics]
        where = where_of(best.physics, numbers[0], self.simulator.movers())
        lacks = missing(best.physics, numbers, self.simulator.places)
        if verdict == "ambiguous":
            lacks = (
                f"the simulator lacks one of these: {'; '.join(dict.fromkeys(short_name(m.physics) for m in models))}"
            )
        sizes = values_of(findings, best.physics)
        sizes = f"the most probable is {sizes}" if verdict == "ambiguous" else sizes
        sizes += corrected(best.corrections)
        gaps = errors(self._error, self._before, after, self._floor, self.simulator.unit)
        sentence = f"{place(where, self._flat)}, {lacks}; {sizes}; {gaps}."
        law = best.physics[0]
        sites = self.simulator.places.sites(law.objects, law.effect.on)
        said = self._said(verdict, sentence, _on(where, sites, law.distinct), findings, best)
        return replace(said, rivals=tuple(models)) if verdict == "ambiguous" else said

    def _said(
        self,
        verdict: Verdict,
        sentence: str,
        where: Where | None = None,
        findings: tuple[EffectFinding, ...] = (),
        best: Hypothesis | None = None,
    ) -> Discovery:
        mismatch = Mismatch(verdict, where, findings, self.undetectable, "", sentence, self._explanations(), self.alpha)
        tried = self._tried(best)
        plain, cell = self.found.plain, len(self.simulator.cell.parameters)
        before = table_map(plain.response, plain.free.pushes)
        if best is None:
            return Discovery(mismatch, tried=tried, before=before, warnings=self.warnings, weighed=self._weighed())
        values, std = best.fit.point.values, with_numerics(best)
        after = table_map(best.response, best.free.pushes)
        return Discovery(
            mismatch, best.simulator, values, values[:cell], std[:cell], std, tried, before, after, self.warnings,
            weighed=self._weighed(),
        )  # fmt: skip

    def _explanations(self) -> tuple[Explanation, ...]:
        """That nothing is missing, `unknown`, and the most probable models, in the order of their probability.

        Held-out episodes are opened for each of them, now that the verdict stands.
        """
        none, unknown, of_models = self.found.probabilities
        plain = self.found.plain
        rows = [
            Explanation((), none, plain.log_evidence, self._held_out(self._before)),
            Explanation((ExplainedLaw(UNKNOWN, (), {}),), unknown, plain.free.log),
            *(
                Explanation(
                    _explained(m, m.physics),
                    float(p),
                    m.log_evidence,
                    self._held_out(self._after(m)),
                    _explained(m, m.corrections),
                )
                for m, p in list(zip(self.found.models, of_models, strict=True))[:SAID]
            ),
        ]
        return tuple(sorted(rows, key=lambda e: (-e.probability, -e.log_evidence)))

    def _held_out(self, after: float) -> HeldOut:
        return HeldOut(self._before, after, self._floor, self.simulator.unit)

    def _tried(self, best: Hypothesis | None) -> tuple[Tried, ...]:
        """The most probable models."""
        rows = list(zip(self.found.models, self.found.odds, self.found.probabilities[2], strict=True))[:SAID]
        return tuple(
            Tried(m.name, m.laws[0].effect.channel, odds, self._gain(self._after(m)), m is best, f"probability {p:.3g}")
            for m, odds, p in rows
        )

    def _evidence(self, model: Hypothesis, after: float) -> Evidence:
        odds = self.found.odds[self.found.models.index(model)]
        alarms = float((1 + np.sum(self.odds >= odds)) / (1 + len(self.odds)))
        return Evidence(self._gain(after), odds, alarms)

    def _gain(self, after: float) -> float:
        """Share of the excess held-out error that a model removes."""
        return float(np.clip((self._before - after) / max(self._before - self._floor, 1e-9), -1.0, 1.0))

    def _after(self, model: Hypothesis) -> float:
        """Held-out error of the simulator with a model's laws."""
        if model.name not in self.opened:
            judged, values = model.likelihood.on(self.held_out), model.fit.point.values
            self.opened[model.name] = held_out_error(self.simulator.cell, judged, values)
        return self.opened[model.name]

    @property
    def _error(self) -> str:
        """What the error of the episodes that judge is called: where all were fitted, they judge themselves."""
        fitted, judging = self.found.plain.likelihood.measured, self.held_out.measured
        alike = fitted.shape == judging.shape and np.array_equal(fitted, judging, equal_nan=True)
        return "error on the fitted episodes" if alike else "held-out error"

    @property
    def _before(self) -> float:
        """Held-out error of the simulator without laws."""
        return self._after(self.found.plain)

    @property
    def _flat(self) -> bool:
        """Whether something that is tracked slides in a plane."""
        return any_slides(self.simulator.moving)

    @property
    def _floor(self) -> float:
        return rms_distance(self.simulator.cell, self.noise.rms[None, None])


def _on(where: Where, sites: Sequence[Site], names: Sequence[str]) -> Where:
    """With its sites, in a result's words; without names: all of these sites."""
    kinds = {word_of(site.kind) for site in sites}
    kind = kinds.pop() if len(kinds) == 1 else None
    phase = GENERAL.get(where.phase, where.phase)
    return replace(where, phase=phase, site_kind=kind, site="+".join(names) or "all")


def _explained(model: Hypothesis, laws: Sequence[Attached]) -> tuple[ExplainedLaw, ...]:
    """Some laws of a model with their numbers."""
    values, out = model.fit.point.values, []
    for attached, own in model.own():
        if attached not in laws:
            continue
        numbers = zip(attached.effect.quantities, values[own], model.std[own], strict=True)
        quantities = {q.name: EffectParameter(float(v), float(e), q.unit) for q, v, e in numbers}
        out.append(ExplainedLaw(attached.effect.name, attached.distinct, quantities))
    return tuple(out)
