"""A race of models with one law more, from where nothing is bent."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from math import log
from typing import TypeVar

import numpy as np

from compass_ros.calibration.cost import Point, cost, start
from compass_ros.calibration.differences import difference_steps
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
from compass_ros.simulation.effects import Attached
from compass_ros.types import Floats, Ints

Runner = TypeVar("Runner")
ETA = 3
"""One in so many goes on (Li et al. 2018, Hyperband: 3 or 4)."""
SHARES = (0.3, 0.1, -0.1, -0.3, -1.0)
"""Of a modest size at which a law may begin: four steps of Gauss-Newton do not come back from one that is ten times too
large, or of the wrong sign, in contacts (bouncing_ball 1010001: a slope of 0.5 s/m where -0.047 is best)."""


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
    values, begun, horizons = _unbent(parent, rows)
    if not horizons:
        return []  # a fit to all of these episodes calls for nothing
    runners = [_runner(parent, laws, np.append(values, numbers), rows, begun, horizons)
               for laws, numbers in starts]  # fmt: skip
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
    return [_at_the_end(parent, *_on_its_sites(parent, starts[i][0], *found[i])) for i in alive]


def _on_its_sites(
    parent: Hypothesis, laws: tuple[Attached, ...], likelihood: Likelihood, fit: Fit
) -> tuple[tuple[Attached, ...], Likelihood, Point]:
    """A law that raced on several sites without those where it may be absent, if that leaves any; of what these
    episodes do not show, others decide."""
    simulator, _ = widened(parent.simulator, parent.likelihood, laws)
    model = Hypothesis((*parent.laws, *laws), simulator, likelihood, fit)
    absent = model.zero.absent([a for a in laws if model.zero.shown(a)]) if len(laws) > 1 else ()
    if not 0 < len(absent) < len(laws):
        return laws, likelihood, fit.point
    _, fewer, at = lacking(model, absent)
    point = replace(fit.point, values=fit.point.values[at], cost=np.inf)
    return tuple(a for a in laws if a not in absent), fewer, point


def _at_the_end(parent: Hypothesis, laws: tuple[Attached, ...], likelihood: Likelihood, point: Point) -> Begun:
    """Some steps more with all parameters of the parent free, and its loss."""
    free, steps = with_law(parent, point.values)
    robust = max(parent.fit.robust, 3.0 * typical_residual(likelihood, point))
    point = minimise(likelihood, point, free, FEW, robust, 3.0, steps=steps, fresh=False).point
    return Begun(laws, replace(point, cost=float(cost(likelihood, [point], parent.fit.robust)[0][0])), bent=False)


def _unbent(parent: Hypothesis, rows: Ints) -> tuple[Floats, Strongest, tuple[float, ...]]:
    """(P,) the parent's model fitted to the longest horizon that calls for nothing more, and the longer ones.

    With all that is free in it, to the end: what a fit still lacks, a discrepancy seems to be called for.
    """
    likelihood, first = parent.likelihood.of(rows), len(parent.simulator.cell.parameters)
    values = parent.likelihood.prior_mean.copy()
    values[first:] = parent.fit.point.values[first:]
    begun, held = strongest(likelihood, values), first + shapes(parent.laws)
    horizons, steps = likelihood.horizons, difference_steps(parent.fit.linear)
    for k, (part, rough) in enumerate(growing(likelihood, values, held, begun)):
        fit = minimise(part, rough.point, parent.fit.free, 2 * FEW, parent.fit.robust, 1.0, steps=steps, fresh=False)
        found = free(respond(parent.simulator, part, fit))
        if found.log + PRIOR_UNKNOWN > found.alone:
            return values, begun, horizons[k:]
        values = fit.point.values
    return values, begun, ()


def _runner(
    parent: Hypothesis,
    laws: Sequence[Attached],
    values: Floats,
    rows: Ints,
    begun: Strongest,
    horizons: tuple[float, ...],
) -> Iterator[tuple[Likelihood, Fit]]:
    """Fits of one model to some episodes, longer from one to the next; shapes stay as they are until the last."""
    simulator, likelihood = widened(parent.simulator, parent.likelihood, laws)
    new = np.arange(len(parent.fit.point.values), len(values))
    held = len(simulator.cell.parameters) + shapes((*parent.laws, *laws))
    likelihood = likelihood.of(rows)
    first = likelihood.until(horizons[0] * float(likelihood.time_s.max()))
    values = _of_a_size(first, values, new, laws, parent.fit.robust)
    begun = begun.beside(values, new, np.full(len(new), 1 / WIDTH))
    return growing(likelihood, values, held, begun, horizons)


def _of_a_size(likelihood: Likelihood, values: Floats, new: Ints, laws: Sequence[Attached], robust: float) -> Floats:
    """(P,) values with the amplitudes of the new laws at the best of SHARES of their sizes."""
    quantities = [q for attached in laws for q in attached.effect.quantities]
    begins = np.array([q.begins if q.amplitude else n for q, n in zip(quantities, values[new], strict=True)])
    starts = [start(likelihood, values)]
    for share in SHARES:
        numbers = begins + share * (values[new] - begins)
        if np.all((numbers >= likelihood.low[new]) & (numbers <= likelihood.high[new])):
            starts.append(start(likelihood, np.append(values[: new[0]], numbers)))
    costs, _ = cost(likelihood, starts, robust)
    return starts[int(np.argmin(costs))].values


def first_of_each(ordered: Iterable[Runner], name: Callable[[Runner], str]) -> list[Runner]:
    """The first of each name, in their order."""
    found: dict[str, Runner] = {}
    for one in ordered:
        found.setdefault(name(one), one)
    return list(found.values())
