"""Which set of laws: neighbours ranked to first order, the best of them fitted, the probable ones fitted well.

Models are sets of laws on sites. Neighbours of a model have one law more. The search goes on from the best model as
long as a better one is found; where what is left still calls for a discrepancy, laws race from where nothing is bent.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from math import log

import numpy as np
from scipy.special import expit

from compass_ros.discovery.candidates import Candidate
from compass_ros.discovery.evidence import log_sum
from compass_ros.discovery.first_order import FirstOrder, Ranked
from compass_ros.discovery.fits import finished
from compass_ros.discovery.form import told_apart
from compass_ros.discovery.hypothesis import Hypothesis
from compass_ros.discovery.neighbours import exchange, join, rank, shape_anew, widen
from compass_ros.discovery.odds import Known, Prior
from compass_ros.discovery.settings import PRIOR_UNKNOWN, RHO, RHO_PRIOR, SLIGHT
from compass_ros.simulation.effects import Attached
from compass_ros.types import Floats

DEEPEST = 3
"""Laws of a model at most, by name: a budget, for each one more is a race more."""
LAST_STEPS = 2.0
"""Of the fall that one Gauss-Newton step promises at the end of a fit, as much as its last steps gain at most: of ten
models of arms, a real SO-101 among them, and of a bouncing ball they gained 0.06 to 1.7 of it."""


@dataclass(frozen=True, eq=False)
class Found:
    """Models by their log posterior odds against the plain one, the best first, one for each set of laws that is named;
    without the plain one and `unknown`."""

    plain: Hypothesis
    unknown: float
    """Log posterior odds of a free discrepancy."""
    models: tuple[Hypothesis, ...]
    odds: tuple[float, ...]
    first: tuple[Ranked, ...]
    """Laws to first order about the plain fit."""
    chance: Floats = field(default_factory=lambda: np.zeros(1))
    """(n,) log odds against the plain model that a rough simulator gives to any other one, equally probable."""

    @property
    def probabilities(self) -> tuple[float, float, Floats]:
        """Of the plain model, of `unknown`, and of each model; of the first in the mean over what chance gives."""
        logs = np.array([self.unknown, *self.odds])
        total = log_sum(logs)
        none = float(np.mean(expit(self.chance - total)))
        p = (1 - none) * np.exp(logs - total)
        return none, float(p[0]), p[1:]


Tell = Callable[[str, float], bool]


def search(plain: Hypothesis, first: Sequence[Ranked], candidates: Sequence[Candidate], tell: Tell) -> Found:
    """From the plain model on, with its neighbours ranked `first`; not where nothing is more probable to first order.

    Whether that is more than noise reaches is asked of what is found: about a bent fit first order says too little (of
    a bar on a floor that is rougher to one side, `pushed_bar` 1070001, 12 of log evidence where the law has 77).
    """
    prior = Prior.of(candidates)
    none = plain.free.alone
    found = Found(plain, plain.free.log - none + PRIOR_UNKNOWN, (), (), tuple(first))
    optimistic = max([found.unknown, *(f.gain + prior.of_laws([f.candidate.name]) for f in first)])
    if optimistic <= 0:
        return found
    known = Known(prior, none, {}, set())
    best, top, ranked, widened = plain, 0.0, list(first), {plain.name}
    others, least = (0.0, found.unknown), -np.inf
    while ranked:
        widen(known, best, ranked, found.unknown > 0)
        finish(known, others)
        shape_anew(known, found.unknown)
        finish(known, others)
        exchange(known, candidates, widened, found.unknown, least)
        join(known, candidates)
        finish(known, others)
        if not known.models:
            break  # nothing gains to first order, and no beginning calls for anything
        (leader, odds), *_ = known.ordered
        tell("fit effects", min(0.3 + 0.2 * len(leader.laws), 0.9))
        names = {a.effect.name for a in leader.laws}
        if odds <= top or not calls_for_more(leader, prior.price) or len(names) >= DEEPEST:
            break
        best, top = leader, odds
        widened.add(best.name)
        about = FirstOrder(best.response)
        ranked = rank(about, candidates)
        best_case = top + about.unsaid
        could = [r for r in ranked if best_case + r.gain + prior.of_laws([r.candidate.name]) > found.unknown]
        if not could:
            break  # no law more could come up to a free discrepancy
        if len(names) + 1 == DEEPEST:  # what stays below it there stays below it
            ranked, least = could, found.unknown
    models = told_apart(known, known.total(others) + log(SLIGHT))
    return Found(plain, found.unknown, tuple(h for h, _ in models), tuple(o for _, o in models), tuple(first))


def finish(known: Known, others: Sequence[float]) -> None:
    """Bring the models that hold all but SLIGHT of the probability to their optimum, in place.

    What a fit still lacks there, and rough differences, are worth some units of log evidence: as much as two laws may
    be apart, or a discrepancy may stand for; and first order is what it says about an optimum alone. A law is named
    where it is more than its error bars from zero on all its sites together, as the noise leaves them and as the
    episodes disagree on it; which of them it is on is a matter of evidence. So a model with a law that may be zero
    stands for the one without it, and one with a site that may lack its law where that is as probable, one after the
    other, since each is unsure beside another that does nearly the same. Before its last steps it is so where the model
    without is as probable. `others`: log odds of models without a law.
    """
    while (name := _unfinished(known, others)) is not None:
        begun, odds = known.models.pop(name)
        known.finished.add(name)
        if any(
            _as_probable_without(known, begun, odds, part) for part in (begun.zero.weakest, begun.zero.weakest_site)
        ):
            continue  # its optimum is not worth the search for it
        model = finished(begun)
        odds = known.odds(model, model.log_evidence)
        if weakest := model.zero.weakest:
            if len(weakest) < len(model.laws):
                known.without(model, weakest)
        elif not _as_probable_without(known, model, odds, model.zero.weakest_site):
            known.models[name] = model, odds


def _as_probable_without(known: Known, model: Hypothesis, odds: float, laws: Sequence[Attached]) -> bool:
    """Whether a model without some of its laws is as probable, or the same one; not where that leaves none, or these
    are none."""
    if not 0 < len(laws) < len(model.laws):
        return False
    less = known.without(model, laws)
    return less is not None and (less[1] >= odds or model.zero.nothing(laws))


def _unfinished(known: Known, others: Sequence[float]) -> str | None:
    """The most probable model that is not at its optimum and holds a share of the probability; None: there is none.

    The best one of all too, where its last steps may make it better than all others are: it is compared with a
    discrepancy, which needs no fit. They leave the noise, and gain LAST_STEPS of what one promises, at most.
    """
    total = known.total(others)
    rest, found = -np.inf, None
    ordered = sorted(known.models.items(), key=lambda item: item[1][1])
    for name, (_, odds) in ordered:
        rest = np.logaddexp(rest, odds)  # of this one and all less probable ones
        if name not in known.finished and rest - total > log(SLIGHT):
            found = name
    if ordered:
        name, (model, odds) = ordered[-1]
        could = min(0.5 * model.above_noise, LAST_STEPS * model.promised) / model.likelihood.correlation_time
        if name not in known.finished and odds + could > max(others):
            found = name
    return found


def calls_for_more(model: Hypothesis, price: float) -> bool:
    """Whether a model leaves something: a free discrepancy gains more than the prior odds of one law more cost, or one
    of its laws' own is larger than was expected."""
    if model.free.log + (price if model.laws else PRIOR_UNKNOWN) > model.log_evidence:
        return True
    return model.rho > float(np.dot(RHO, RHO_PRIOR))
