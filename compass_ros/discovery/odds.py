"""Prior odds of models, and those that were fitted."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import log

import numpy as np

from compass_ros.discovery.candidates import Candidate
from compass_ros.discovery.evidence import log_sum
from compass_ros.discovery.fits import without
from compass_ros.discovery.hypothesis import Hypothesis, name_of
from compass_ros.discovery.settings import PRIOR_LAW
from compass_ros.simulation.effects import Attached

Weighed = tuple[Hypothesis, float]
"""A model and its log posterior odds against the plain one."""


@dataclass(frozen=True)
class Prior:
    """Log prior odds of models against the plain one.

    Half of the probability is the plain model's, a quarter that of `unknown`, a quarter that of all laws; a law's share
    is the same for each name, and within it for each set of sites. A second law is as improbable as the first.
    """

    sites: dict[str, int]
    """Choices of sites by name of law: each set of single ones with a size on each, and those with one for all."""
    apart: frozenset[str] = frozenset()
    """Laws that are another one on each site: such a site is a choice, a set of them is several laws."""

    @staticmethod
    def of(candidates: Sequence[Candidate]) -> Prior:
        singles, shared = Counter[str](), Counter[str]()
        for c in candidates:
            (singles if c.alone else shared)[c.name] += 1
        names = dict.fromkeys(c.name for c in candidates)
        apart = frozenset(c.name for c in candidates if c.attached.effect.apart)
        choices = {name: singles[name] if name in apart else 2 ** singles[name] - 1 for name in names}
        return Prior({name: choices[name] + shared[name] for name in names}, apart)

    @property
    def price(self) -> float:
        """What the cheapest law costs."""
        return max(self.of_laws([name]) for name in self.sites)

    def of_laws(self, names: Iterable[str]) -> float:
        """Each law counts once, whatever its sites; one that is another on each of them by its sites."""
        counted = Counter(names)
        return sum(
            (PRIOR_LAW - log(len(self.sites) * self.sites[name])) * (count if name in self.apart else 1)
            for name, count in counted.items()
        )


@dataclass(frozen=True, eq=False)
class Known:
    """Models that were fitted, by name, each with its log posterior odds against the plain one."""

    prior: Prior
    plain: float
    """Log evidence of the plain model."""
    models: dict[str, Weighed]
    finished: set[str]
    """Names of those that were brought to their optimum; one that is not among the models has a law that is zero."""

    def odds(self, model: Hypothesis, log_evidence: float) -> float:
        return log_evidence - self.plain + self.prior.of_laws(a.effect.name for a in model.laws)

    def take(self, models: Iterable[Hypothesis]) -> None:
        """The better of two fits of one model stays, and one at its optimum."""
        for model in models:
            if model.name in self.finished:
                continue
            odds = self.odds(model, model.log_evidence)
            if model.name not in self.models or odds > self.models[model.name][1]:
                self.models[model.name] = (model, odds)

    def without(self, model: Hypothesis, laws: Sequence[Attached]) -> Weighed | None:
        """A model without some of its laws, fitted if it is not known, or was not from as near its optimum as the model
        is; None: another of its laws is zero then."""
        name = name_of([a for a in model.laws if a not in laws])
        if name not in self.models or model.name in self.finished:
            self.take([without(model, laws)])
        return self.models.get(name)

    def total(self, others: Iterable[float]) -> float:
        """Log odds of all models together, and of `others`."""
        return log_sum(np.array([*others, *(odds for _, odds in self.models.values())]))

    @property
    def ordered(self) -> list[Weighed]:
        """The most probable first."""
        return sorted(self.models.values(), key=lambda one: -one[1])
