"""Models with one law more, or with another one in the place of one: ranked to first order, the best of them fitted."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from math import log

import numpy as np

from compass_ros.discovery.candidates import Candidate
from compass_ros.discovery.discrepancy import to_first_order
from compass_ros.discovery.first_order import FirstOrder, Ranked
from compass_ros.discovery.fits import Begun, from_parent, in_common, telling, whole
from compass_ros.discovery.hypothesis import Hypothesis, name_of
from compass_ros.discovery.odds import Known, Prior, Weighed
from compass_ros.discovery.race import first_of_each, race
from compass_ros.discovery.scatter import ranked_scatter, with_scatter
from compass_ros.discovery.settings import SLIGHT
from compass_ros.simulation.effects import Attached
from compass_ros.simulation.site_kinds import PLANAR
from compass_ros.simulation.sites import Site
from compass_ros.types import Floats

RACED = 4
"""Neighbours that are fitted from their parent: a budget."""
STEPS = 20
"""Gauss-Newton steps of each fit from its parent, which ends before where one gains less than 1: a budget. What is
linear is there in four, what has shapes is not: a balance spring (`kinova3` 1060001) is 74 of log likelihood behind an
error of its encoder after four, 28 after eight, 12 after fourteen, in 7 s where four take 3."""


def rank(first: FirstOrder, candidates: Sequence[Candidate]) -> list[Ranked]:
    """Laws at their best shape, the one that promises most first.

    Where sites have each a size of their own (`_separate`), laws are ranked on several of them too.
    """
    of_chance = [ranked_scatter(first.response, c) for c in candidates if c.attached.effect.scattered]
    found = [best for c in candidates if not c.attached.effect.scattered for best in first.ranked(c)[:1]]
    moving, alone = first.response.simulator.moving, dict[str, list[Ranked]]()
    for one in found:
        if one.gain > 0 and _separate(one.candidate, moving):
            alone.setdefault(one.candidate.name, []).append(one)
    several = (first.together(singles) for singles in alone.values() if len(singles) > 1)
    return sorted([*found, *of_chance, *(one for one in several if one)], key=lambda f: -f.gain)


def _separate(candidate: Candidate, moving: Mapping[str, Site]) -> bool:
    """Whether it is on one of several sites that have each a size of their own: joints, drives, pairs, signals. What
    moves in one plane has a law in common or alone."""
    effect = candidate.attached.effect
    alike = effect.moves and any(moving[name].kind in PLANAR for name in candidate.objects if name in moving)
    return candidate.alone and bool(candidate.objects) and not (effect.apart or alike)


def widen(known: Known, best: Hypothesis, ranked: Sequence[Ranked], called: bool) -> None:
    """Fit the neighbours of a model with one law more; from where nothing is bent too, beside a law where more is
    `called` for.

    They are fitted to some episodes, and the best of them to all.
    """
    rows = telling(best)
    tried, few = promising(ranked, best)[:RACED], len(rows) < len(best.likelihood.inputs)
    if best.laws and not few:
        tried = [r for r, odds in zip(tried, beside(best, tried, known.prior), strict=True) if odds > 0]
    known.take(with_scatter(best, r) for r in tried if r.candidate.attached.effect.scattered)
    begun = [from_parent(best, r, rows, STEPS) for r in tried if not r.candidate.attached.effect.scattered]
    if not best.laws or (called and few):  # what takes all episodes to tell beside a law hardly bends its fit
        begun += race(best, cold_starts(ranked, best), rows)
    known.take(whole(best, one) for one in probable(begun, known.prior))


def exchange(known: Known, candidates: Sequence[Candidate], widened: set[str], unknown: float, least: float) -> None:
    """Fit models with another law in the place of one of the best model's, until none is better.

    The first law that was taken stood for all that differs; beside the second one another may stand for the rest. Where
    the best model is refuted, its first law may be the wrong one: so it is with the best of those with most laws, be it
    better than with fewer or not, and first order about a model that lacks another law excludes nothing.
    `widened`: names of models whose neighbours were fitted; those of this search are added. `unknown`: log odds of a
    free discrepancy. `least`: log odds up to which, to first order, a model that may have no law more is not worth a
    fit.
    """
    last: Hypothesis | None = None
    while known.ordered:
        best, odds = known.ordered[0]
        refuted = odds < unknown and least == -np.inf
        leader = _deepest(known) if refuted else best
        if leader is last:
            break
        last = leader
        for name in dict.fromkeys(a.effect.name for a in leader.laws):
            known_rest = _rest(known, leader, name)
            if known_rest is None or known_rest[0].name in widened:
                continue
            less, of_less = known_rest
            widened.add(less.name)
            about = FirstOrder(less.response)
            worth, price = max(odds, least) - about.unsaid, known.prior.of_laws
            ranked = rank(about, candidates)
            better = [r for r in ranked if refuted or of_less + r.gain + price([r.candidate.name]) > worth]
            widen(known, less, better, unknown > 0)


def shape_anew(known: Known, unknown: float) -> None:
    """Look for the shapes of the best model's law on each of several sites beside the law on the others, where the fit
    is not at the noise: they were found about a fit that lacked the law on all of them, which may have been bent.

    Not where the same law once more on each of these sites, at its best shapes, leaves the model below `unknown`, the
    log odds of a free discrepancy.
    """
    for best, odds in known.ordered[:1]:
        count = Counter(a.effect.name for a in best.laws)
        searched = [a for a in best.laws if count[a.effect.name] > 1 and any(q.grid for q in a.effect.quantities)]
        if best.at_noise or not searched:
            continue
        first = FirstOrder(best.response)
        once_more = sum(r.gain for a in searched for r in first.ranked(Candidate(a))[:1])
        if odds + once_more + first.unsaid < unknown:
            continue
        for attached in searched:
            rest = known.without(best, [attached])
            again = FirstOrder(rest[0].response).ranked(Candidate(attached))[:1] if rest else []
            if rest and again and rest[1] + again[0].gain > odds:
                known.finished.discard(best.name)
                rows = np.arange(len(best.likelihood.inputs))
                known.take([whole(rest[0], from_parent(rest[0], again[0], rows, STEPS))])


def join(known: Known, candidates: Sequence[Candidate]) -> None:
    """Fit the best model with one law in common where it has the law alone on each of what moves in one plane."""
    tried = {*known.models, *known.finished}
    for best, _ in known.ordered[:1]:
        for name in dict.fromkeys(a.effect.name for a in best.laws):
            own = [a for a in best.laws if a.effect.name == name]
            if len(own) == 1 or any(_separate(Candidate(a), best.simulator.moving) for a in own):
                continue
            objects = {site for a in own for site in a.objects}
            rest = [a for a in best.laws if a not in own]
            shared = next((c.attached for c in candidates if c.name == name and set(c.objects) == objects), None)
            if shared is not None and name_of([*rest, shared]) not in tried:
                known.take([in_common(best, own, shared)])


def _deepest(known: Known) -> Hypothesis:
    """The most probable model among those with most laws by name."""
    return max((model for model, _ in known.ordered), key=lambda model: len({a.effect.name for a in model.laws}))


def _rest(known: Known, model: Hypothesis, name: str) -> Weighed | None:
    """The best model with the laws of another one but for one of them; what is left of that one lacks the sites that
    this law had made seem idle."""
    own = [a for a in model.laws if a.effect.name == name]
    names = {a.effect.name for a in model.laws} - {name}
    alike = (one for one in known.ordered if {a.effect.name for a in one[0].laws} == names)
    return next(alike, None) or (known.without(model, own) if names else None)


def beside(model: Hypothesis, ranked: Sequence[Ranked], prior: Prior) -> list[float]:
    """Log odds, to first order, of a model with one law more against the model with its discrepancy."""
    of_form = [r for r in ranked if not r.candidate.attached.effect.scattered]
    rises = iter(to_first_order(model.response, model.sizes, [r.columns for r in of_form]))
    return [(next(rises) if r in of_form else r.gain) + prior.of_laws([r.candidate.name]) for r in ranked]


def probable(begun: Sequence[Begun], prior: Prior) -> list[Begun]:
    """Those that could be probable, and in any case the best two and the best of the best two laws; of each set of laws
    on the same sites the most probable fit.

    By log evidence in the episodes that they were fitted to: what a law leaves may be a discrepancy of its form, and of
    two fits of one law that leave as much one may be in a valley. Where more than one law is missing none of them comes
    near, and what is left says little about which is one of them.
    """
    odds = [(prior.of_laws(a.effect.name for a in one.laws) + one.model.log_evidence, one) for one in begun]
    fits = sorted(odds, key=lambda pair: -pair[0])
    ordered = first_of_each(fits, lambda pair: frozenset((a.effect.name, a.objects) for a in pair[1].laws))
    could = ordered[0][0] + 2 * log(SLIGHT) if ordered else 0.0
    best_laws = first_of_each(ordered, lambda pair: pair[1].laws[0].effect.name)[:2]
    return [pair[1] for i, pair in enumerate(ordered) if i < 2 or pair[0] > could or pair in best_laws]


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
    """Each law that the parent lacks, at a modest size, on all sites that have a size of their own; another one on each
    choice of them: which of them it is on, a fit that is bent cannot say."""
    has = {a.effect.name for a in parent.laws}
    of: dict[str, list[Ranked]] = {}
    for r in ranked:
        if r.candidate.name not in has and not r.candidate.attached.effect.scattered:
            of.setdefault(r.candidate.name, []).append(r)
    out = []
    for same in of.values():
        own = [r for r in same if _separate(r.candidate, parent.simulator.moving)]
        for chosen in [own] if own else [[r] for r in same]:
            parts = tuple(part for r in chosen for part in r.candidate.parts)
            out.append((parts, np.concatenate([modest(r) for r in chosen])))
    return out


def modest(ranked: Ranked) -> Floats:
    """(q,) numbers: amplitudes at their modest sizes, shapes as first order has them or where they begin."""
    quantities = ranked.candidate.quantities
    sizes = [q.begins + q.scale if q.amplitude else (n if ranked.gain > 0 else q.start)
             for q, n in zip(quantities, ranked.numbers, strict=True)]  # fmt: skip
    return np.array(sizes)
