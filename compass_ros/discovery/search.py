"""Which set of laws: neighbours ranked to first order, the best of them fitted, the probable ones fitted well.

Models are sets of laws on sites. Neighbours of a model have one law more. The search goes on from the best model as
long as a better one is found; where what is left still calls for a discrepancy, laws race from where nothing is bent.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass
from math import log

import numpy as np

from compass_ros.discovery.candidates import Candidate
from compass_ros.discovery.discrepancy import to_first_order
from compass_ros.discovery.evidence import log_sum
from compass_ros.discovery.first_order import FirstOrder, Ranked
from compass_ros.discovery.fits import Begun, finished, from_parent, race, telling, whole, without
from compass_ros.discovery.hypothesis import Hypothesis
from compass_ros.discovery.scatter import ranked_scatter, with_scatter
from compass_ros.discovery.settings import PRIOR_LAW, PRIOR_UNKNOWN, RHO, RHO_PRIOR
from compass_ros.simulation.effects import Attached
from compass_ros.simulation.sites import PLANAR
from compass_ros.types import Floats

RACED = 4
"""Neighbours that are fitted from their parent: a budget."""
DEEPEST = 3
"""Laws of a model at most, by name: a budget, for each one more is a race more."""
SLIGHT = 0.01
"""Probability that is left to models that are not brought to their optimum: a budget. It is the
default false-alarm rate and does not follow that setting."""
STEPS = 4
"""Gauss-Newton steps of each fit from its parent: a budget."""


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
class Found:
    """Models by their log posterior odds against the plain one, the best first; without it and `unknown`."""

    plain: Hypothesis
    unknown: float
    """Log posterior odds of a free discrepancy."""
    models: tuple[Hypothesis, ...]
    odds: tuple[float, ...]
    first: tuple[Ranked, ...]
    """Laws to first order about the plain fit."""

    @property
    def probabilities(self) -> tuple[float, float, Floats]:
        """Of the plain model, of `unknown`, and of each model."""
        logs = np.array([0.0, self.unknown, *self.odds])
        p = np.exp(logs - log_sum(logs))
        return float(p[0]), float(p[1]), p[2:]


Tell = Callable[[str, float], bool]


def rank(first: FirstOrder, candidates: Sequence[Candidate]) -> list[Ranked]:
    """Laws at their best shape, the one that promises most first.

    Joints, drives, pairs and signals have each a size of their own too; what moves in one plane has a law in common or
    alone.
    """
    of_chance = [ranked_scatter(first.response, c) for c in candidates if c.attached.effect.scattered]
    found = [best for c in candidates if not c.attached.effect.scattered for best in first.ranked(c)[:1]]
    moving, alone = first.response.simulator.moving, dict[str, list[Ranked]]()
    for one in found:
        own = [moving[name].kind for name in one.candidate.objects if name in moving]
        alike = one.candidate.attached.effect.moves and any(kind in PLANAR for kind in own)
        own_size = not one.candidate.attached.effect.apart and bool(one.candidate.objects) and not alike
        if one.candidate.alone and one.gain > 0 and own_size:
            alone.setdefault(one.candidate.name, []).append(one)
    several = (first.together(singles) for singles in alone.values() if len(singles) > 1)
    return sorted([*found, *of_chance, *(one for one in several if one)], key=lambda f: -f.gain)


@dataclass(frozen=True, eq=False)
class Known:
    """Models that were fitted, by name, each with its log posterior odds against the plain one."""

    prior: Prior
    plain: float
    """Log evidence of the plain model."""
    models: dict[str, tuple[Hypothesis, float]]

    def odds(self, model: Hypothesis, log_evidence: float) -> float:
        return log_evidence - self.plain + self.prior.of_laws(a.effect.name for a in model.laws)

    def take(self, models: Iterable[Hypothesis]) -> None:
        """The better of two fits of one model stays."""
        for model in models:
            odds = self.odds(model, model.log_evidence)
            if model.name not in self.models or odds > self.models[model.name][1]:
                self.models[model.name] = (model, odds)

    @property
    def ordered(self) -> list[tuple[Hypothesis, float]]:
        """The most probable first."""
        return sorted(self.models.values(), key=lambda one: -one[1])


def search(
    plain: Hypothesis, first: Sequence[Ranked], candidates: Sequence[Candidate], beaten: float, tell: Tell
) -> Found:
    """From the plain model on, with its neighbours ranked `first`; not where none could exceed the odds `beaten`."""
    prior = Prior.of(candidates)
    none = plain.free.alone
    found = Found(plain, plain.free.log - none + PRIOR_UNKNOWN, (), (), tuple(first))
    optimistic = max([found.unknown, *(f.gain + prior.of_laws([f.candidate.name]) for f in first)])
    if optimistic < beaten:
        return found
    known = Known(prior, none, {})
    best, top, ranked = plain, 0.0, list(first)
    while ranked:
        _widen(known, best, ranked, found.unknown > 0)
        if not known.models:
            break  # nothing gains to first order, and no beginning calls for anything
        (leader, odds), *_ = known.ordered
        tell("fit effects", min(0.3 + 0.2 * len(leader.laws), 0.9))
        names = {a.effect.name for a in leader.laws}
        if odds <= top or not calls_for_more(leader, prior.price) or len(names) >= DEEPEST:
            break
        best, top = leader, odds
        ranked = rank(FirstOrder(best.response), candidates)
        if top + max(r.gain + prior.of_laws([r.candidate.name]) for r in ranked) < found.unknown:
            break  # no law more could come up to a free discrepancy
    finish(known, (0.0, found.unknown))
    models = known.ordered
    return Found(plain, found.unknown, tuple(h for h, _ in models), tuple(o for _, o in models), tuple(first))


def _widen(known: Known, best: Hypothesis, ranked: Sequence[Ranked], called: bool) -> None:
    """Fit the neighbours of a model with one law more; from where nothing is bent, where more is `called` for.

    They are fitted to some episodes, and the best of them to all.
    """
    rows = telling(best)
    tried, few = promising(ranked, best)[:RACED], len(rows) < len(best.likelihood.inputs)
    if best.laws and not few:
        tried = [r for r, odds in zip(tried, beside(best, tried, known.prior), strict=True) if odds > 0]
    known.take(with_scatter(best, r) for r in tried if r.candidate.attached.effect.scattered)
    begun = [from_parent(best, r, rows, STEPS) for r in tried if not r.candidate.attached.effect.scattered]
    if called and few:  # what takes all episodes to tell hardly bends a fit
        begun += race(best, cold_starts(ranked, best), rows)
    known.take(whole(best, one) for one in probable(begun, known.prior))


def beside(model: Hypothesis, ranked: Sequence[Ranked], prior: Prior) -> list[float]:
    """Log odds, to first order, of a model with one law more against the model with its discrepancy."""
    of_form = [r for r in ranked if not r.candidate.attached.effect.scattered]
    rises = iter(to_first_order(model.response, model.sizes, [r.columns for r in of_form]))
    return [(next(rises) if r in of_form else r.gain) + prior.of_laws([r.candidate.name]) for r in ranked]


def probable(begun: Sequence[Begun], prior: Prior) -> list[Begun]:
    """Those that could be probable, and the best two in any case; one of each set of laws on the same sites.

    By the likelihood and the prior odds: what shapes cost is of the size of the margin.
    """
    best: dict[frozenset[tuple[str, tuple[str, ...]]], tuple[float, Begun]] = {}
    for one in begun:
        odds = prior.of_laws(a.effect.name for a in one.laws) - one.cost
        sites = frozenset((a.effect.name, a.objects) for a in one.laws)
        if sites not in best or odds > best[sites][0]:
            best[sites] = odds, one
    ordered = sorted(best.values(), key=lambda pair: -pair[0])
    least = ordered[0][0] + 2 * log(SLIGHT) if ordered else 0.0
    return [one for i, (odds, one) in enumerate(ordered) if i < 2 or odds > least]


def finish(known: Known, others: Sequence[float]) -> None:
    """Bring the models that hold all but SLIGHT of the probability to their optimum, in place.

    What a fit still lacks there, and rough differences, are worth some units of log evidence: as much as two laws may
    be apart. One with a law that is within its error bars of zero, as the noise leaves them or as the episodes disagree
    on it (`Hypothesis.weak`), is the model without that law, and stands for it. `others`: log odds of models without
    a law.
    """
    done: set[str] = set()
    while (name := _unfinished(known, others, done)) is not None:
        done.add(name)
        model = finished(known.models.pop(name)[0])
        if not model.weak:
            known.models[name] = model, known.odds(model, model.log_evidence)
        elif len(model.weak) < len(model.laws):
            less = without(model, model.weak)
            known.models.setdefault(less.name, (less, known.odds(less, less.log_evidence)))


def _unfinished(known: Known, others: Sequence[float], done: Collection[str]) -> str | None:
    """The most probable model that holds a share of the probability and is not at its optimum; None: there is none."""
    total = log_sum(np.array([*others, *(odds for _, odds in known.models.values())]))
    rest, found = -np.inf, None
    for name, (_, odds) in sorted(known.models.items(), key=lambda item: item[1][1]):
        rest = np.logaddexp(rest, odds)  # of this one and all less probable ones
        if name not in done and rest - total > np.log(SLIGHT):
            found = name
    return found


def calls_for_more(model: Hypothesis, price: float) -> bool:
    """Whether a model leaves something: a free discrepancy gains more than the prior odds of one law more cost, or one
    of its laws' own is larger than was expected."""
    if model.free.log + (price if model.laws else PRIOR_UNKNOWN) > model.log_evidence:
        return True
    return model.rho > float(np.dot(RHO, RHO_PRIOR))


def promising(ranked: Sequence[Ranked], parent: Hypothesis) -> list[Ranked]:
    """Those that the parent does not have on any of their sites; of each name the best two choices of sites."""
    has = {(a.effect.name, site) for a in parent.laws for site in a.named}
    out: list[Ranked] = []
    for r in ranked:
        own = {(r.candidate.name, site) for part in r.candidate.parts for site in part.named}
        if r.gain > 0 and not own & has and sum(o.candidate.name == r.candidate.name for o in out) < 2:
            out.append(r)
    return out


def cold_starts(ranked: Sequence[Ranked], parent: Hypothesis) -> list[tuple[tuple[Attached, ...], Floats]]:
    """Each law that the parent lacks, on the sites that promise most, at a modest size.

    One that promises nothing about a fit that is bent says nothing of its sites either: it starts on all of them.
    """
    has = {a.effect.name for a in parent.laws}
    of: dict[str, list[Ranked]] = {}
    for r in ranked:
        if r.candidate.name not in has and not r.candidate.attached.effect.scattered:
            of.setdefault(r.candidate.name, []).append(r)
    out = []
    for same in of.values():
        pairs = [r for r in same if r.candidate.alone and r.candidate.attached.effect.paired]
        chosen = pairs if same[0].gain <= 0 and pairs else same[:1]
        parts = tuple(part for r in chosen for part in r.candidate.parts)
        out.append((parts, np.concatenate([modest(r) for r in chosen])))
    return out


def modest(ranked: Ranked) -> Floats:
    """(q,) numbers: amplitudes at their modest sizes, shapes as first order has them or where they begin."""
    quantities = ranked.candidate.quantities
    sizes = [q.begins + q.scale if q.amplitude else (n if ranked.gain > 0 else q.start)
             for q, n in zip(quantities, ranked.numbers, strict=True)]  # fmt: skip
    return np.array(sizes)
