"""Effects tried on the beginning of the episodes, where the plain simulator has only begun to fail.

What is missing bends a trajectory a little at first; some collisions later a fit without it is somewhere else, and what
a first-order argument says there means nothing. The beginning names candidates and their sizes; the fit of each then
grows with the horizon, its effect inside from the start.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from compass_ros.calibration.least_squares import Fit, Point, cost, minimise
from compass_ros.calibration.likelihood import Likelihood
from compass_ros.calibration.refine import Refined, growing, polish
from compass_ros.discovery.candidates import Candidate
from compass_ros.discovery.joint import Joint, grown, widened
from compass_ros.discovery.screen import Score, Space
from compass_ros.discovery.tangents import changes, screen
from compass_ros.discovery.trials import TRIED, different, further, sketched, worth
from compass_ros.simulation import Simulator
from compass_ros.simulation.effects import Attached, Quantity
from compass_ros.types import Floats, Ints

BEGUN = 1.1
"""Mean squared residual at which a simulator has begun to fail."""
SLIGHT = 2.0
"""Log likelihood that a further step of these first fits must promise."""
SIZES, AROUND = (0.5, 1.0, 4.0, 16.0), 12
"""Of an effect that is tried, in its scale; directions of two amplitudes."""
OF_TWINS = (1.0, 2.0, 4.0, 8.0, 16.0, 32.0)
"""Sizes of an effect that is tried in place of another."""
FEW = 2
"""Forces that are followed to the end, and as many others."""


@dataclass(frozen=True)
class Beginning:
    """The shortest part of the episodes that the plain simulator does not follow."""

    followed: Fit
    """Of its strongest parameters to the part before."""
    failed: Refined
    """The best plain fit there."""


def from_the_beginning(
    simulator: Simulator, likelihood: Likelihood, fit: Fit, asked: Sequence[Candidate]
) -> Iterator[list[Joint]]:
    """Effects that explain the beginning, each fitted to the whole episodes.

    An effect is there on the objects that the beginning tells, which not all may have moved by then, and on all.
    `likelihood` and `fit`: what the plain simulator follows of the episodes.
    """
    beginning = _where_it_fails(likelihood)
    if beginning is None:
        return
    failed = beginning.failed
    space, scores = screen(simulator, failed.likelihood, failed.fit, asked)
    forces = [s for s in scores if s.candidate.by_force]
    others = sorted((s for s in scores if not s.candidate.by_force), key=lambda s: -max(s.gain, _gain(space, s)))
    known, fit_of = failed.likelihood, beginning.followed
    started = (
        begun(simulator, known, fit_of.point, fit_of.free, failed.fit.robust, s.candidate)
        for s in different(others)[:TRIED]
    )
    kinds = sketched(space, forces)[:TRIED], [_freed(joint, beginning) for joint in sorted(started, key=_left)[:FEW]]
    tried = [sorted((further(j, SLIGHT, 4) for j in promising), key=_left) for promising in kinds]
    for joint in sorted((j for kind in tried for j in different(kind)[:FEW]), key=worth):
        own = joint.added[0]
        widest = next(c.attached for c in asked if c.name == joint.name and c.attached.effect.on == own.effect.on)
        sets = dict.fromkeys((own, widest if own.effect.moves else own))
        yield [grown(joint, attached, simulator, likelihood, fit.robust) for attached in sets]


def _left(joint: Joint) -> float:
    return joint.fit.point.cost


def _where_it_fails(likelihood: Likelihood) -> Beginning | None:
    """None where the plain simulator follows all of the episodes."""
    noise = np.broadcast_to(likelihood.sigma.min(axis=(0, 1)), likelihood.sigma.shape)
    followed: Fit | None = None
    for part, fit in growing(replace(likelihood, sigma=noise.copy()), likelihood.prior_mean):
        if 2 * fit.point.cost > BEGUN * part.measurements:
            failed = polish(part, fit.point)
            if 2 * failed.fit.point.cost > BEGUN * part.measurements:
                return Beginning(followed or fit, failed)
        followed = fit
    return None


def _gain(space: Space, score: Score) -> float:
    """What the best of some sizes explains that the parameters cannot [log likelihood]; first order may miss it."""
    candidate = score.candidate
    change = changes(space, candidate, np.array(_sizes(candidate.attached.effect.quantities)))
    left = space.off_parameters(space.residual[:, None] + change)
    return 0.5 * float(left[:, 0] @ left[:, 0] - np.min(np.sum(left**2, axis=0)))


def begun(
    simulator: Simulator,
    likelihood: Likelihood,
    point: Point,
    free: Ints,
    robust: float,
    candidate: Candidate,
    sizes: Sequence[float] = SIZES,
) -> Joint:
    """A candidate of which first order says little (contacts, commands, sensors), fitted from where all was well.

    It begins with nothing, and with the best of some sizes, in its scale. The simulator is without the candidate.
    """
    added = (candidate.attached,)
    wider, likelihood = widened(simulator, likelihood, added)
    everything = np.concatenate([free, np.arange(len(point.values), len(likelihood.prior_mean))])
    starts, best = _starts(likelihood, point, candidate.attached, sizes, robust)
    fits = [
        minimise(likelihood, starts[i], everything, 5, robust, SLIGHT, fresh=False) for i in dict.fromkeys((0, best))
    ]
    fit = min(fits, key=lambda f: f.point.cost)
    return Joint(wider, likelihood, fit, added)


def in_place_of(first: Joint, attached: Attached, simulator: Simulator, likelihood: Likelihood) -> Joint:
    """Another effect, fitted from where one has led the parameters, beginning with the best of some sizes.

    Simulator and likelihood are those without either.
    """
    wider, whole = widened(simulator, likelihood, (attached,))
    known, fit = len(likelihood.prior_mean), first.fit
    free = np.concatenate([fit.free[fit.free < known], np.arange(known, len(whole.prior_mean))])
    there = replace(fit.point, values=fit.point.values[:known])
    starts, best = _starts(whole, there, attached, OF_TWINS, fit.robust)
    return Joint(wider, whole, minimise(whole, starts[best], free, 5, fit.robust, SLIGHT, fresh=False), (attached,))


def _starts(
    likelihood: Likelihood, point: Point, attached: Attached, sizes: Sequence[float], robust: float
) -> tuple[list[Point], int]:
    """A point with none of an effect and with some sizes of it, and which of them is best."""
    starts = [
        Point(np.concatenate([point.values, numbers]), point.launch, np.inf)
        for numbers in _sizes(attached.effect.quantities, sizes)
    ]
    return starts, int(np.argmin(cost(likelihood, starts, robust)[0]))


def _sizes(quantities: Sequence[Quantity], sizes: Sequence[float] = SIZES) -> list[Floats]:
    """(q,) settings to begin with: none, and each amplitude alone, small and large, or two of one unit all around.

    Some act beyond a limit only. What an offset does at an impact is of second order: its direction must be tried.
    """
    none, scale, low, high = np.array([(q.start, q.scale, q.low, q.high) for q in quantities]).T
    axes = np.eye(len(quantities))[[q.amplitude for q in quantities]]
    rays = [sign * axis for axis in axes for sign in (1.0, -1.0)]
    if len(axes) == 2 and len({q.unit for q in quantities if q.amplitude}) == 1:
        rays = [np.cos(angle) * axes[0] + np.sin(angle) * axes[1] for angle in np.arange(AROUND) * 2 * np.pi / AROUND]
    numbers = [none + size * ray * scale for size in sizes for ray in rays]
    return [none, *(n for n in numbers if np.all((low <= n) & (n <= high)))]


def _freed(joint: Joint, beginning: Beginning) -> Joint:
    """With all parameters that are felt there, not the strongest alone."""
    failed, fit = beginning.failed.fit, joint.fit
    free = np.concatenate([failed.free, np.arange(len(failed.point.values), len(fit.point.values))])
    return replace(joint, fit=minimise(joint.likelihood, fit.point, free, 1, fit.robust, SLIGHT, fresh=False))
