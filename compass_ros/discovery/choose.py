"""Which effects explain what is left: fits of the most promising candidates, alone and in pairs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from compass_ros.calibration.least_squares import (
    Fit,
    Point,
    cost,
    difference_steps,
    linearise,
    minimise,
    robust_loss,
    robust_weight,
)
from compass_ros.calibration.likelihood import Likelihood
from compass_ros.calibration.refine import ROBUST, calmed, covariance
from compass_ros.discovery.candidates import Candidate
from compass_ros.discovery.impulses import impulses
from compass_ros.discovery.joint import Joint, converge, fit_jointly, from_second_start
from compass_ros.discovery.remainder import smooth_excess
from compass_ros.discovery.screen import Score, Space
from compass_ros.discovery.tangents import score

ENOUGH = 0.93
"""Share of the excess (cost above the noise floor) that a single effect must explain to be named alone."""
PAIR_ENOUGH = 0.95
"""The same for two effects."""
SMALL = 0.12
"""Excess of chi-square under which a remainder is put down to the effect's functional form..."""
FORM_SHARE = 0.6
"""...if the effect explains at least this share."""
EQUAL = 3.0
"""Log evidence within which two effects are told apart by nothing."""
EQUAL_SHARE = 0.015
"""The same as a share of the excess: functional forms are never exactly right."""
NEEDED = 0.05
"""Share of the excess that an effect must be worth beside another that is enough."""
FORM_LEFT = 0.25
"""Part of what one effect leaves that a second may leave to be its cause."""
OF_LIMIT = 8.0
"""Log evidence by which an effect must surpass what it comes to at an end of its shapes."""
LEADS = 0.6
"""Share from which the best effect is surely one of two; below, the second best may be instead."""
NEARLY = 0.85
"""Share from which the best effect is first fitted from a second start before others are tried."""
LEADERS = 4
"""Best fits that are continued, and of which one may be named."""
ASKED = 12
"""Names whose fit is sketched, the most promising first."""
SKETCHED = 2
"""Steps of a sketch."""
TRIED = 5
"""Sketches that are fitted at once, the best first; as many again where none of them is enough."""
PROMISING = 0.1
"""Least first-order gain, as a share of the best, to be tried."""
SLIGHT = 0.005
"""Share of the excess that a further step of a fit must promise: models are compared by shares of it."""
HELD_OUT_SHARE = 0.4
"""Share of the held-out excess that a model must remove where there is one."""
HELD_OUT_SEEN = 15.0
"""Held-out excess [log likelihood] from which it can be judged at all."""


@dataclass(frozen=True)
class HeldOut:
    """Episodes that were never fitted, weighted as the fitted ones are."""

    likelihood: Likelihood
    before: float
    """Surprise by the model without effects."""
    floor: float
    """Surprise by noise alone."""

    def surprise(self, joint: Joint) -> float:
        """Minus the log predictive density of a fitted model."""
        return surprise(self.likelihood, joint.likelihood, joint.fit)

    def helps(self, joint: Joint) -> bool:
        """Whether a model predicts these episodes better: clearly, where there is something to gain."""
        excess, gain = self.before - self.floor, self.before - self.surprise(joint)
        return gain > HELD_OUT_SHARE * excess if excess > HELD_OUT_SEEN else gain > -5.0


@dataclass(frozen=True)
class Choice:
    """Fitted models, the best first."""

    singles: tuple[Joint, ...]
    pair: Joint | None
    excess: float
    """Cost of the plain model above the noise floor."""
    floor: float
    """Cost that the noise alone leaves."""
    two: bool = False
    """The first single is enough, and the pair still explains what it leaves: there are two."""
    equal: tuple[Joint, ...] = ()
    """Where the first single is enough: others that explain the recordings as well."""

    def share(self, joint: Joint) -> float:
        """Part of the excess that a model explains."""
        return 1 - max(joint.fit.point.cost - self.floor, 0.0) / max(self.excess, 1e-9)

    def remainder(self, joint: Joint) -> float:
        """Excess of chi-square that a model leaves."""
        return 2 * max(joint.fit.point.cost - self.floor, 0.0) / joint.likelihood.measurements

    def explains(self, pair: Joint, first: Joint) -> bool:
        """Whether what one effect leaves has a second cause.

        What a wrong functional form leaves is explained in part by many effects and wholly by none; a second effect is
        explained wholly by one.
        """
        return self.remainder(pair) < FORM_LEFT * self.remainder(first)

    def good(self, unseen: HeldOut) -> list[Joint]:
        """Models of one effect that may be named, the best first."""
        good = [j for j in self.singles[:LEADERS] if self.enough(j) and unseen.helps(j)]
        return sorted(good, key=lambda j: -evidence(j, unseen))

    def enough(self, joint: Joint) -> bool:
        """Whether a model explains what there is to explain."""
        share = self.share(joint)
        form_only = share >= FORM_SHARE and self.remainder(joint) < SMALL
        return share >= (ENOUGH if len(joint.added) == 1 else PAIR_ENOUGH) or form_only


def held_out(judge: Likelihood, space: Space) -> HeldOut:
    """Weigh held-out episodes: frames that the parameters move too much are trusted less, as in the fit."""
    point = Point(space.fit.point.values, np.zeros_like(judge.inputs), np.inf)
    linear = linearise(judge, point, space.fit.free, difference_steps(space.fit.linear))
    calm = calmed(judge, linear)
    floor = noise_cost(calm, replace(space.fit, free=np.zeros(0, dtype=np.int64)))
    return HeldOut(calm, surprise(calm, space.likelihood, space.fit), floor)


def surprise(unseen: Likelihood, fitted: Likelihood, fit: Fit) -> float:
    """Minus the log predictive density of unseen episodes, up to a constant: noise and the fit's own uncertainty.

    A model that is unsure what its parameters are may be wrong about an episode without being refuted by it: the
    residual has the covariance 1 + J C J', C that of the fitted parameters. Outliers are weighed down as in the fit.
    """
    judged = fitted.on(unseen)
    point = Point(fit.point.values, np.zeros_like(unseen.inputs), np.inf)
    linear = linearise(judged, point, fit.free, difference_steps(fit.linear))
    residual, jacobian = linear.residual.ravel(), linear.jacobian.reshape(-1, len(fit.free))
    known = covariance(fitted, fit)[: len(fit.free), : len(fit.free)]
    precision = np.linalg.inv(known)
    left, weight = residual, np.ones_like(residual)
    for _ in range(3):
        weight = robust_weight(left, ROBUST)
        inner = precision + (jacobian * weight[:, None]).T @ jacobian
        move = -np.linalg.solve(inner, jacobian.T @ (weight * residual))
        left = residual + jacobian @ move
    loss = 0.5 * float(np.sum(robust_loss(left, ROBUST)))
    volume = np.linalg.slogdet(inner)[1] - np.linalg.slogdet(precision)[1]
    return loss + 0.5 * float(move @ precision @ move) + 0.5 * float(volume)


def noise_cost(likelihood: Likelihood, fit: Fit) -> float:
    """Cost that unit normal noise leaves under the robust loss, less what the free parameters take."""
    grid = np.linspace(-6, 6, 2001)
    density = np.exp(-0.5 * grid**2) / np.sqrt(2 * np.pi)
    loss = 0.5 * robust_loss(grid, fit.robust)
    noise = likelihood.sigma.min(axis=(0, 1))  # before any collision there is nothing but the tracker's noise
    quiet = noise**2 / likelihood.sigma**2  # where sigma holds more than noise, noise is quieter than one sigma
    of_noise = float(np.sum(density * loss) * (grid[1] - grid[0]))
    measured = ~np.isnan(likelihood.measured)
    return of_noise * float(np.sum(np.broadcast_to(quiet, measured.shape)[measured])) - 0.5 * len(fit.free)


def floor_of(likelihood: Likelihood, fit: Fit, reached: float) -> float:
    """Cost that noise alone leaves, from a fit of cost `reached`: less what is still smooth in its residual."""
    return reached - 0.5 * max(smooth_excess(likelihood, fit.point, fit.robust), 0.0) * likelihood.measurements


def choose(space: Space, scores: Sequence[Score], candidates: Sequence[Candidate], unseen: HeldOut) -> Choice:
    """Fit the promising candidates; where none is enough, others, and then the best of them with a second one."""
    base = float(cost(space.likelihood, [space.fit.point], space.fit.robust)[0][0])
    slight = SLIGHT * (base - floor_of(space.likelihood, space.fit, base))
    choice = _weighed([], base, floor_of(space.likelihood, space.fit, base))
    rounds = _rounds(space, scores)
    for promising in rounds:
        tried = [further(j, slight, 3) for j in promising]
        choice = _weighed(sorted([*choice.singles, *tried], key=_worth), base, choice.floor)
        clear = _clear(choice)
        if not clear:
            choice = _weighed(_compared(choice, slight), base, choice.floor)
        best, *others = choice.singles
        promises = LEADS if clear or promising is rounds[-1] else NEARLY
        if not choice.good(unseen) and choice.share(best) > promises:
            choice = _weighed([from_second_start(best), *others], base, choice.floor)
        if good := choice.good(unseen):
            first = simplest(good)
            equal = _equals(first, choice, unseen)
            others = [j for j in choice.singles if j is not first]
            choice = _weighed([from_second_start(first), *others], base, choice.floor)
            return _with_second(replace(choice, equal=equal), candidates, unseen)
    if not choice.singles:
        return choice
    best, *others = _different(choice.singles)
    firsts = [best] if choice.share(best) > LEADS else [best, *(converge(j, slight, 4) for j in others[:1])]
    pair = _second(firsts, candidates, slight)
    if pair and pair.fit.point.cost < min(j.fit.point.cost for j in choice.singles):
        floor = floor_of(pair.likelihood, pair.fit, pair.fit.point.cost)
        choice = replace(choice, excess=choice.excess + choice.floor - floor, floor=floor)
    return replace(choice, pair=pair)


def _rounds(space: Space, scores: Sequence[Score]) -> list[list[Joint]]:
    """Sketches of the fits to try, most promising first, in up to two rounds.

    What the simulator says of two cheap steps orders candidates better than their first-order gain does.
    """
    sketches = sorted((fit_jointly(space, [s], SKETCHED, anew=False) for s in _promising(scores)), key=_worth)
    return [part for part in (sketches[:TRIED], sketches[TRIED : 2 * TRIED]) if part]


def _clear(choice: Choice) -> bool:
    """Whether one effect explains much and no other half as much."""
    best, *others = _different(choice.singles)
    share = choice.share(best)
    return share > LEADS and all(choice.share(j) < 0.5 * share for j in others)


def _compared(choice: Choice, slight: float) -> list[Joint]:
    """The same models with the leading ones converged, the best first."""
    best = choice.share(choice.singles[0])
    leading = [j for j in choice.singles[:LEADERS] if choice.share(j) > 0.5 * best]
    rest = [j for j in choice.singles if not any(j is other for other in leading)]
    leading = sorted((j if j.converged else further(j, slight, 5) for j in leading), key=_worth)
    ended = [j if j.converged else converge(j, slight) for j in leading[:2]]
    return sorted([*ended, *leading[2:], *rest], key=_worth)


def _weighed(singles: Sequence[Joint], base: float, floor: float) -> Choice:
    """Shares are of what the best of them shows to be above the noise."""
    if singles:
        cheapest = min(singles, key=lambda j: j.fit.point.cost)
        floor = floor_of(cheapest.likelihood, cheapest.fit, cheapest.fit.point.cost)
    return Choice(tuple(singles), None, base - floor, floor)


def _equals(best: Joint, choice: Choice, unseen: HeldOut) -> tuple[Joint, ...]:
    """Other effects that explain the recordings as well: within EQUAL of log evidence, or EQUAL_SHARE."""
    top = evidence(best, unseen)
    margin = max(EQUAL, EQUAL_SHARE * choice.excess / best.likelihood.correlation_time)
    return tuple(
        joint
        for joint in _different(choice.singles)
        if best.name not in (joint.name, joint.added[0].effect.limit)
        and top - evidence(joint, unseen) < margin
        and unseen.helps(joint)
    )


def simplest(good: Sequence[Joint]) -> Joint:
    """The best, or what it comes to at an end of its shapes where that explains as much."""
    best = good[0]
    limit = best.added[0].effect.limit
    plain = next((j for j in good if j.name == limit), None)
    return plain if plain is not None and _worth(plain) - _worth(best) < OF_LIMIT else best


def _with_second(choice: Choice, candidates: Sequence[Candidate], unseen: HeldOut) -> Choice:
    """The same with a second effect where the first leaves something, and that has a cause of its own."""
    first = choice.singles[0]
    if 1 - choice.share(first) < NEEDED:
        return choice
    pair = _second([first], candidates, SLIGHT * choice.excess)
    if pair is None:
        return choice
    floor = floor_of(pair.likelihood, pair.fit, pair.fit.point.cost)
    choice = replace(choice, pair=pair, floor=floor, excess=choice.excess + choice.floor - floor)
    needed = choice.share(pair) - choice.share(first) > NEEDED
    seen, rest = unseen.surprise(first) - unseen.surprise(pair), unseen.surprise(first) - unseen.floor
    predicts = seen > HELD_OUT_SHARE * rest if rest > HELD_OUT_SEEN else seen > -5.0
    return replace(choice, two=predicts and needed and choice.explains(pair, first))


def _worth(joint: Joint) -> float:
    """Order of models: what they leave, and what their numbers cost (Laplace); smaller is better."""
    return -joint.log_evidence(joint.likelihood.correlation_time)


def evidence(joint: Joint, unseen: HeldOut) -> float:
    """Log evidence of all episodes: of the fitted ones, and of the others as they are predicted."""
    return -_worth(joint) - unseen.surprise(joint) / joint.likelihood.correlation_time


def further(joint: Joint, slight: float, iterations: int) -> Joint:
    """A promising fit, continued while a step gains more than is `slight` [log likelihood]."""
    fit, tolerance = joint.fit, max(1.0, slight)
    fit = minimise(joint.likelihood, fit.point, fit.free, iterations, fit.robust, tolerance, fit.linear, fresh=False)
    return replace(joint, fit=fit)


def _promising(scores: Sequence[Score]) -> list[Score]:
    """The best objects of each name, and all objects together where that is almost as good."""
    best: dict[str, list[Score]] = {}
    for s in sorted(scores, key=lambda s: -s.gain):
        best.setdefault(s.candidate.name, []).append(s)
    top = max((s[0].gain for s in best.values()), default=0.0)
    names = sorted(best.values(), key=lambda group: -group[0].gain)[:ASKED]
    out = []
    for group in names:
        if group[0].gain < max(PROMISING * top, 1e-9):
            continue
        out.append(group[0])
        together = max(group, key=lambda s: len(s.candidate.attached.objects))
        if together is not group[0] and together.gain > 0.6 * group[0].gain:
            out.append(together)
    return out


def _second(firsts: Sequence[Joint], candidates: Sequence[Candidate], slight: float) -> Joint | None:
    """Some fits of one effect, each with the candidates that promise most of what it leaves: the best pair."""
    found: list[Joint] = []
    for first in firsts:
        pushes = impulses(first.simulator, first.likelihood, first.fit)
        there = Space(first.simulator, first.likelihood, first.fit, pushes)
        own = {a.effect.name for a in first.added}
        scores = [score(there, c) for c in candidates if c.name not in own]
        for sketch in next(iter(_rounds(there, scores)), []):
            joint = further(sketch, slight, 4)
            found.append(Joint(joint.simulator, joint.likelihood, joint.fit, (*first.added, *joint.added)))
    best = sorted((further(j, slight, 5) for j in sorted(found, key=_worth)[:3]), key=_worth)
    return converge(best[0], slight) if best else None


def _different(singles: Sequence[Joint]) -> list[Joint]:
    """The best fit of each name."""
    seen: dict[str, Joint] = {}
    for joint in singles:
        seen.setdefault(joint.name, joint)
    return list(seen.values())
