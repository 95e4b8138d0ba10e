"""Ways to a fit of two effects at once, from fits of one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from compass_ros.calibration.least_squares import Point, minimise
from compass_ros.discovery.beginning import OF_TWINS, begun
from compass_ros.discovery.candidates import Candidate
from compass_ros.discovery.choice import OF_LIMIT, Choice
from compass_ros.discovery.joint import ERROR_BARS, Joint, best_of, converge, widened, widths
from compass_ros.discovery.screen import Score, Space
from compass_ros.discovery.tangents import screen
from compass_ros.discovery.trials import TRIED, at_other_rates, different, further, sketched, worth

CLOSE = 4.0
"""How far behind the best pair a second one may be to be followed too, in steps that promise little."""
OF_CONTACTS, FOLLOWED = (0.06, 0.5), 2
"""Sizes from which effects of contacts begin beside another effect, in their scale; how many fits are followed."""
WIDTHS = (1.0, 0.5)
"""Widths of fields that are tried where two effects meet, as parts of those that each has alone."""


def promising_pairs(firsts: Sequence[Joint], candidates: Sequence[Candidate], slight: float) -> list[Joint]:
    """Some fits of one effect, each with the candidates that promise most of what it leaves: the best two, converged.

    The second best only where it leaves little more than the best: two forms of drag differ in the episodes held out.
    """
    found: list[Joint] = []
    for first in firsts:
        there, scores = _beyond(first, candidates)
        for sketch in sketched(there, scores)[:TRIED]:
            joint = further(sketch, slight, 4)
            found.append(replace(joint, added=(*first.added, *joint.added)))
    best = sorted((further(j, slight, 5) for j in sorted(found, key=worth)[:3]), key=worth)
    close = [j for j in best[:2] if worth(j) - worth(best[0]) < max(OF_LIMIT, CLOSE * slight)]
    return sorted((converge(j, slight) for j in close), key=worth)


def of_singles(firsts: Sequence[Joint], choice: Choice, space: Space, slight: float) -> list[Joint]:
    """Some effects with the best other force and the best that is none, as they stand alone, from the first guess.

    Where two effects are large, the parameters bend for the one that is not there, and from there its like is not seen.
    A field has grown wide to stand for both.
    """
    singles, pairs = different(choice.singles), {}
    for first in firsts:
        others = [j for j in singles if j.name != first.name]
        kinds = [[j for j in others if Candidate(j.added[0]).by_force == by_force] for by_force in (True, False)]
        pairs.update({frozenset((first.name, kind[0].name)): (first, kind[0]) for kind in kinds if kind})
    starts = []
    for pair in pairs.values():
        added = tuple(attached for j in pair for attached in j.added)
        numbers = np.concatenate([j.fit.point.values[len(space.fit.point.values) :] for j in pair])
        lengths = widths([q for attached in added for q in attached.effect.quantities])
        wide = [np.where(lengths > 0, np.maximum(lengths, width * numbers), numbers) for width in WIDTHS]
        starts += [(added, start) for start in (wide if lengths.any() else wide[:1])]
    return [converge(j, slight) for j in sorted(best_of(space, starts, 2), key=worth)[:1]]


def with_a_rate(first: Joint, candidates: Sequence[Candidate], slight: float) -> list[Joint]:
    """A fit of one effect with one that has a frequency, from the first guess: alone, it had bent the parameters."""
    there, scores = _beyond(first, candidates)
    other = at_other_rates(there, scores)
    return [replace(converge(other, slight), added=(*first.added, *other.added))] if other else []


def with_a_limit(firsts: Sequence[Joint], candidates: Sequence[Candidate], slight: float) -> list[Joint]:
    """A fit of some effects, each with a limit of the commands: below it first order says nothing of it."""
    limits = [c for c in candidates if c.name == "velocity_saturation"]
    return _begun_beside(firsts, limits, OF_TWINS, slight)


def with_contacts(first: Joint, candidates: Sequence[Candidate], slight: float) -> list[Joint]:
    """A fit of one effect with an effect of contacts.

    First order says little of those: dampings take a small one away, and have to give it back as it grows.
    """
    of_contacts = [c for c in candidates if c.attached.effect.channel == "contact" and not c.attached.effect.on_walls]
    return _begun_beside([first], different(of_contacts), OF_CONTACTS, slight)


def one_of(pair: Joint, i: int, space: Space) -> Joint:
    """One effect of a pair without the other, fitted from where the pair stands.

    The second, since the first was chosen when nothing stood beside it; and either, since the way there may have led
    an effect to the right place that from the plain fit was led to a wrong one.
    """
    kept = pair.added[i]
    simulator, likelihood = widened(space.simulator, space.likelihood, (kept,))
    known, size = len(space.fit.point.values), len(pair.added[0].effect.quantities)
    old = pair.fit.point
    own = old.values[known : known + size] if i == 0 else old.values[known + size :]
    values = np.concatenate([old.values[:known], own])
    free = np.concatenate([pair.fit.free[pair.fit.free < known], np.arange(known, len(values))])
    fit = minimise(likelihood, Point(values, old.launch, np.inf), free, 4, pair.fit.robust, 2.0, fresh=False)
    return Joint(simulator, likelihood, fit, (kept,))


def needs_each(joint: Joint, space: Space) -> bool:
    """Whether a model of two effects is worse without either: by as much as ERROR_BARS from zero come to.

    The rest is fitted again from where the pair stands. So what a longer fit gained is not put down to an effect.
    """
    if len(joint.added) < 2 or any(attached.effect.scattered for attached in joint.added):
        return True
    least = 0.5 * ERROR_BARS**2 * joint.likelihood.correlation_time
    return all(one_of(joint, i, space).fit.point.cost > joint.fit.point.cost + least for i in (0, 1))


def _beyond(first: Joint, candidates: Sequence[Candidate]) -> tuple[Space, list[Score]]:
    """What one effect leaves, and what the other candidates promise there."""
    own = {a.effect.name for a in first.added}
    others = [c for c in candidates if c.name not in own]
    return screen(first.simulator, first.likelihood, first.fit, others)


def _begun_beside(
    firsts: Sequence[Joint], others: Sequence[Candidate], sizes: Sequence[float], slight: float
) -> list[Joint]:
    """The best fit of one effect with another that begins with the best of some sizes, if there is another."""
    joints = [
        replace(
            begun(j.simulator, j.likelihood, j.fit.point, j.fit.free, j.fit.robust, other, sizes),
            added=(*j.added, other.attached),
        )
        for j in firsts
        for other in others
        if other.name not in {a.effect.name for a in j.added}
    ]
    followed = [further(j, slight, 8) for j in sorted(joints, key=worth)[:FOLLOWED]]
    return [converge(j, slight) for j in sorted(followed, key=worth)[:1]]
