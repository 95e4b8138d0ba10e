"""Which effects explain what is left: fits of the most promising candidates, alone and in pairs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from compass_ros.calibration.least_squares import Fit, cost
from compass_ros.calibration.likelihood import Likelihood
from compass_ros.discovery.candidates import Candidate
from compass_ros.discovery.impulses import impulses
from compass_ros.discovery.joint import Joint, converge, fit_jointly
from compass_ros.discovery.screen import Score, Space
from compass_ros.discovery.tangents import score

ENOUGH = 0.93
"""Share of the excess (cost above the noise floor) that a single effect must explain to be named alone."""
PAIR_ENOUGH = 0.95
"""The same for two effects."""
SMALL = 0.12
"""Excess of chi-square under which a remainder is put down to the effect's functional form."""
NEEDED = 0.04
"""Share of the excess that each effect of a pair must be worth."""
TRIED = 6
"""Names that are fitted, the most promising first."""
PROMISING = 0.2
"""Least first-order gain, as a share of the best, to be tried."""


@dataclass(frozen=True)
class Choice:
    """Fitted models, the best first."""

    singles: tuple[Joint, ...]
    pair: Joint | None
    excess: float
    """Cost of the plain model above the noise floor."""
    floor: float
    """Cost that the noise alone leaves."""

    def share(self, joint: Joint) -> float:
        """Part of the excess that a model explains."""
        return 1 - max(joint.fit.point.cost - self.floor, 0.0) / max(self.excess, 1e-9)

    def remainder(self, joint: Joint) -> float:
        """Excess of chi-square that a model leaves."""
        return 2 * max(joint.fit.point.cost - self.floor, 0.0) / joint.likelihood.measurements


def noise_cost(likelihood: Likelihood, fit: Fit) -> float:
    """Cost that unit normal noise leaves under the robust loss, less what the free parameters take."""
    grid = np.linspace(-6, 6, 2001)
    density = np.exp(-0.5 * grid**2) / np.sqrt(2 * np.pi)
    loss = fit.robust**2 * (np.sqrt(1 + (grid / fit.robust) ** 2) - 1)
    quiet = np.nanmedian(likelihood.sigma) ** 2 / likelihood.sigma**2  # frames that roughness makes uncertain are quieter
    of_noise = float(np.sum(density * loss) * (grid[1] - grid[0]))
    measured = ~np.isnan(likelihood.measured)
    return of_noise * float(np.sum(np.broadcast_to(quiet, measured.shape)[measured])) - 0.5 * len(fit.free)


def choose(space: Space, scores: Sequence[Score], candidates: Sequence[Candidate]) -> Choice:
    """Fit the promising candidates one by one; where none is enough, the best of them with a second one."""
    base = float(cost(space.likelihood, [space.fit.point], space.fit.robust)[0][0])
    floor = min(noise_cost(space.likelihood, space.fit), base)
    singles = [fit_jointly(space, [s], 6) for s in _promising(scores)]
    singles.sort(key=lambda j: j.fit.point.cost)
    floor = min([floor, *(j.fit.point.cost for j in singles)])
    choice = Choice(tuple(singles), None, base - floor, floor)
    if not singles:
        return choice
    best = converge(singles[0])
    singles[0] = best
    choice = Choice(tuple(singles), None, base - min(floor, best.fit.point.cost), min(floor, best.fit.point.cost))
    if choice.share(best) >= ENOUGH or choice.remainder(best) < SMALL:
        return choice
    pair = _second(space, best, singles, candidates)
    return Choice(choice.singles, pair, choice.excess, min(choice.floor, pair.fit.point.cost if pair else np.inf))


def _promising(scores: Sequence[Score]) -> list[Score]:
    """The best objects of each name, and all objects together where that is almost as good."""
    best: dict[str, list[Score]] = {}
    for s in sorted(scores, key=lambda s: -s.gain):
        best.setdefault(s.candidate.name, []).append(s)
    top = max((s[0].gain for s in best.values()), default=0.0)
    names = sorted(best.values(), key=lambda group: -group[0].gain)[:TRIED]
    out = []
    for group in names:
        if group[0].gain < max(PROMISING * top, 1e-9):
            continue
        out.append(group[0])
        together = max(group, key=lambda s: len(s.candidate.attached.objects))
        if together is not group[0] and together.gain > 0.6 * group[0].gain and group[0].gain > 0.7 * top:
            out.append(together)
    return out


def _second(space: Space, best: Joint, singles: Sequence[Joint], candidates: Sequence[Candidate]) -> Joint | None:
    """The best single effects, each with the candidate that explains most of what it leaves."""
    found: list[Joint] = []
    for first in _different(singles)[:2]:
        done = first if first is best else converge(first, 4)
        pushes = impulses(done.simulator, done.likelihood, done.fit)
        there = Space(done.simulator, done.likelihood, done.fit, pushes)
        own = {a.effect.name for a in first.added}
        scores = [score(there, c) for c in candidates if c.name not in own]
        for s in _promising(scores)[:2]:
            joint = fit_jointly(there, [s], 8)
            found.append(Joint(joint.simulator, joint.likelihood, joint.fit, (*first.added, *joint.added)))
    found.sort(key=lambda j: j.fit.point.cost)
    return converge(found[0]) if found else None


def _different(singles: Sequence[Joint]) -> list[Joint]:
    """The best fit of each name."""
    seen: dict[str, Joint] = {}
    for joint in singles:
        seen.setdefault(joint.name, joint)
    return list(seen.values())
