"""A race of models with one law more, from where nothing is bent."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from math import log
from typing import TypeVar

import numpy as np

from compass_ros.calibration.cost import Point, cost, start
from compass_ros.calibration.differences import Linear, difference_steps, extended, linearise
from compass_ros.calibration.least_squares import Fit, minimise
from compass_ros.calibration.likelihood import Likelihood
from compass_ros.calibration.refine import Strongest, growing, strongest
from compass_ros.calibration.residuals import typical_residual
from compass_ros.discovery.discrepancy import free
from compass_ros.discovery.first_order import WIDTH
from compass_ros.discovery.fits import FEW, Begun, lacking, shapes, with_law
from compass_ros.discovery.hypothesis import Hypothesis, widened
from compass_ros.discovery.response import respond
from compass_ros.discovery.settings import PRIOR_UNKNOWN, SLIGHT
from compass_ros.simulation import Simulator
from compass_ros.simulation.effects import Attached
from compass_ros.types import Floats, Ints

Runner = TypeVar("Runner")
ETA = 3
"""One in so many goes on (Li et al. 2018, Hyperband: 3 or 4)."""
SHARES = (1.0, 0.3, 0.1, -0.1, -0.3, -1.0)
"""Of a modest size at which a law may begin, a budget: four steps of Gauss-Newton do not come back from one that is
far too large, or of the wrong sign, in contacts. Which sizes stand beside it hardly matters: with 4, 6 or 8, down
to a tenth or a thirtieth the right law of a viscoelastic plate (`bouncing_ball` 1010001) comes to a cost of 1036.6 to
1037.5, and leads; with 1 alone to 1618.0, where most laws are at 1090."""


def race(parent: Hypothesis, starts: Sequence[tuple[tuple[Attached, ...], Floats]], rows: Ints) -> list[Begun]:
    """The best of models with one law more each, by successive halving over a growing horizon of some episodes.

    A simulator without a law bends other parameters to stand for it, and from there a fit may end in a valley beside
    the right one. So the parent is fitted anew from the cell's first guess, to the beginning of each episode and to
    more and more of it, until a free discrepancy is called for: the fit before that is not bent yet. From there each
    law goes on, to the next horizon the better third of them, each on its best sites, and all that are as likely as
    SLIGHT of the best. `starts`: each law with its (q,) numbers; of one law there may be several, on other sites.
    """
    if not starts:
        return []
    unbent = _unbent(parent, rows)
    if not unbent:
        return []  # a fit to all of these episodes calls for nothing
    horizons = unbent[0].horizons
    runners = [_runner(parent, laws, numbers, rows, one) for one in unbent for laws, numbers in starts]
    starts = [*starts] * len(unbent)
    alive = list(range(len(runners)))
    found: dict[int, tuple[Likelihood, Fit]] = {}
    for _ in horizons:
        for i in alive:
            found[i] = next(runners[i])
        alive = sorted(alive, key=lambda i: found[i][1].point.cost)
        of_each = first_of_each(alive, lambda i: starts[i][0][0].effect.name)
        ahead = of_each[: max(len(of_each) // ETA, 2)]
        least = found[alive[0]][1].point.cost - log(SLIGHT)
        alive = [i for i in alive if i in ahead or found[i][1].point.cost < least]
    return [_at_the_end(parent, rows, *_on_its_sites(parent, starts[i][0], *found[i])) for i in alive]


def _on_its_sites(
    parent: Hypothesis, laws: tuple[Attached, ...], likelihood: Likelihood, fit: Fit
) -> tuple[tuple[Attached, ...], Simulator, Likelihood, Point]:
    """A law that raced on several sites without those where it may be absent, if that leaves any; of what these
    episodes do not show, others decide."""
    simulator, _ = widened(parent.simulator, parent.likelihood, laws)
    model = Hypothesis((*parent.laws, *laws), simulator, likelihood, fit)
    absent = model.zero.absent([a for a in laws if model.zero.shown(a)]) if len(laws) > 1 else ()
    if not 0 < len(absent) < len(laws):
        return laws, simulator, likelihood, fit.point
    other, fewer, at = lacking(model, absent)
    point = replace(fit.point, values=fit.point.values[at], cost=np.inf)
    return tuple(a for a in laws if a not in absent), other, fewer, point


def _at_the_end(
    parent: Hypothesis,
    rows: Ints,
    laws: tuple[Attached, ...],
    simulator: Simulator,
    likelihood: Likelihood,
    point: Point,
) -> Begun:
    """Some steps more with all parameters of the parent free, and its loss."""
    free, steps = with_law(parent, point.values)
    robust = max(parent.fit.robust, 3.0 * typical_residual(likelihood, point))
    fit = minimise(likelihood, point, free, FEW, robust, 3.0, steps=steps, fresh=False)
    loss = float(cost(likelihood, [fit.point], parent.fit.robust)[0][0])
    ended = replace(fit, point=replace(fit.point, cost=loss), robust=parent.fit.robust)
    model = Hypothesis((*parent.laws, *laws), simulator, likelihood, ended, without=parent.bare[rows])
    return Begun(laws, model, bent=False)


@dataclass(frozen=True, eq=False)
class _Unbent:
    """A model where laws begin: fitted to the longest horizon that calls for nothing more, or to the shortest one."""

    values: Floats
    """(P,)."""
    strong: Strongest
    horizons: tuple[float, ...]
    """The longer ones."""
    linear: Linear
    """Differences there of the strongest, to the first of these."""


def _unbent(parent: Hypothesis, rows: Ints) -> list[_Unbent]:
    """The parent's model where laws begin, from the cell's first guess on; none: the longest horizon calls for nothing.

    With all that is free in it, to the end: what a fit still lacks, a discrepancy seems to be called for.
    """
    likelihood, first = parent.likelihood.of(rows), len(parent.simulator.cell.parameters)
    values = parent.likelihood.prior_mean.copy()
    values[first:] = parent.fit.point.values[first:]
    strong, held = strongest(likelihood, values), first + shapes(parent.laws)
    horizons, steps = likelihood.horizons, difference_steps(parent.fit.linear)
    for k, (part, rough) in enumerate(growing(likelihood, values, held, strong)):
        fit = minimise(part, rough.point, parent.fit.free, 2 * FEW, parent.fit.robust, 1.0, steps=steps, fresh=False)
        found = free(respond(parent.simulator, part, fit))
        if found.log + PRIOR_UNKNOWN > found.alone:
            which = np.setdiff1d(strong.which, held)
            places = [values] if k else [values, fit.point.values]
            linears = (linearise(part, start(part, place), which, strong.steps[which]) for place in places)
            return [_Unbent(place, strong, horizons[k:], of) for place, of in zip(places, linears, strict=True)]
        values = fit.point.values
    return []


def _runner(
    parent: Hypothesis, laws: Sequence[Attached], numbers: Floats, rows: Ints, unbent: _Unbent
) -> Iterator[tuple[Likelihood, Fit]]:
    """Fits of one model to some episodes, longer from one to the next; shapes stay as they are until the last. Near
    where nothing is bent its parent's differences hold."""
    simulator, likelihood = widened(parent.simulator, parent.likelihood.of(rows), laws)
    first = likelihood.until(unbent.horizons[0] * float(likelihood.time_s.max()))
    values, residual, steps = _of_a_size(first, unbent.values, laws, numbers, parent.fit.robust)
    new = np.arange(len(unbent.values), len(values))
    held = len(simulator.cell.parameters) + shapes((*parent.laws, *laws))
    strong = unbent.strong.beside(values, new, steps)
    which = np.setdiff1d(strong.which, held)
    linear = extended(unbent.linear, first, start(first, values), residual, which, strong.steps[which])
    return growing(likelihood, values, held, strong, unbent.horizons, linear)


def _of_a_size(
    likelihood: Likelihood, values: Floats, laws: Sequence[Attached], numbers: Floats, robust: float
) -> tuple[Floats, Floats, Floats]:
    """(P + q,) values with the laws' amplitudes at the best of SHARES of their sizes, their residual, and
    (q,) steps of that size."""
    quantities = [q for attached in laws for q in attached.effect.quantities]
    low, high = likelihood.low[len(values) :], likelihood.high[len(values) :]
    begins = np.array([q.begins if q.amplitude else n for q, n in zip(quantities, numbers, strict=True)])
    sized = {share: begins + share * (numbers - begins) for share in SHARES}
    sized = {share: n for share, n in sized.items() if share == 1 or np.all((low <= n) & (n <= high))}
    starts = [start(likelihood, np.append(values, np.clip(n, low, high))) for n in sized.values()]
    costs, residuals = cost(likelihood, starts, robust)
    best = int(np.argmin(costs))
    return starts[best].values, residuals[best], np.full(len(numbers), abs(list(sized)[best]) / WIDTH)


def first_of_each(ordered: Iterable[Runner], name: Callable[[Runner], Hashable]) -> list[Runner]:
    """The first of each name, in their order."""
    found: dict[Hashable, Runner] = {}
    for one in ordered:
        found.setdefault(name(one), one)
    return list(found.values())
