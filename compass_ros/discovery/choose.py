"""Which effects explain what is left: fits of the most promising candidates, alone and in pairs."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace

import numpy as np

from compass_ros.calibration.least_squares import Point, minimise
from compass_ros.discovery.anew import contacts_anew
from compass_ros.discovery.beginning import OF_TWINS, begun, in_place_of
from compass_ros.discovery.candidates import Candidate, scattered
from compass_ros.discovery.choice import LEADERS, OF_LIMIT, PREDICTS, SEEN, Choice, comes_to, evidence, undecided
from compass_ros.discovery.joint import Joint, best_of, converge, finished, from_second_start, widened, widths
from compass_ros.discovery.scatter import fit_scattered, follows_command, settled_scatter
from compass_ros.discovery.screen import Score, Space
from compass_ros.discovery.tangents import screen
from compass_ros.discovery.trials import TRIED, at_other_rates, different, further, sketched, worth
from compass_ros.discovery.unseen import HeldOut

SURELY = 0.98
"""Share below which the first of two is chosen once more, beside the second."""
EQUAL = 3.0
"""Log evidence within which two effects are told apart by nothing."""
EQUAL_SHARE = 0.015
"""The same as a share of the excess: functional forms are never exactly right."""
LEADS = 0.6
"""Share from which the best effect is surely one of two; below, the second best may be instead."""
NEARLY = 0.85
"""Share from which the best effect, or the best pair, is fitted from a second start before it is given up."""
WHOLLY = 0.95
"""Share that a scatter must explain."""
CLOSE = 4.0
"""How far behind the best pair a second one may be to be followed too, in steps that promise SLIGHT."""
OF_CONTACTS, FOLLOWED = (0.06, 0.5), 2
"""Sizes from which effects of contacts begin beside another effect, in their scale; how many fits are followed."""
WIDTHS = (1.0, 0.5)
"""Widths of fields that are tried where two effects meet, as parts of those that each has alone."""
SLIGHT = 0.005
"""Share of the excess that a further step of a fit must promise: models are compared by shares of it."""


def choose(
    space: Space,
    scores: Sequence[Score],
    candidates: Sequence[Candidate],
    unseen: HeldOut,
    beginnings: Iterable[list[Joint]] = (),
    first: bool = False,
) -> Choice:
    """Fit the promising candidates; where none is enough, others, and then the best of them with a second one.

    `beginnings`: models that the beginnings of the episodes suggest, some at a time, each list fitted when it is asked
    for; tried `first`, or where no other effect is enough.
    """
    choice = undecided(space)
    slight = SLIGHT * choice.excess
    if first:
        choice = _tried(choice, beginnings, unseen)
        if choice.good(unseen):
            return _concluded(choice, space, candidates, unseen)
    sketches = sketched(space, scores)
    rounds = [part for part in (sketches[:TRIED], sketches[TRIED : 2 * TRIED]) if part]
    for promising in rounds:
        tried = [further(j, slight, 3) for j in promising]
        choice = choice.of(sorted([*choice.singles, *tried], key=worth))
        clear = _clear(choice)
        if not clear:
            choice = choice.of(_compared(choice, slight))
        best, *others = choice.singles
        promises = LEADS if clear or promising is rounds[-1] else NEARLY
        if not choice.good(unseen) and choice.share(best) > promises:
            choice = choice.of([from_second_start(best), *others])
        if choice.good(unseen):
            return _concluded(choice, space, candidates, unseen)
    if choice.complete():  # more fits to these episodes would say nothing: others are held out
        return choice
    choice = _tried(choice, ([j] for j in contacts_anew(space, scores)), unseen)
    if not choice.good(unseen) and (other := at_other_rates(space, scores)):
        choice = _tried(choice, [[converge(other, slight)]], unseen)
    if not first and not choice.good(unseen):
        choice = _tried(choice, beginnings, unseen)
    if choice.good(unseen):
        return _concluded(choice, space, candidates, unseen)
    if choice.singles and not choice.untaught(unseen):
        choice = _in_pairs(choice, space, candidates, unseen)
    return choice if choice.verdict(unseen) else _with_scatter(choice, space, candidates, unseen)


def _tried(choice: Choice, more: Iterable[list[Joint]], unseen: HeldOut) -> Choice:
    """The same with more models, the best of each list at its optimum, until one is enough."""
    for models in more:
        best, *others = sorted(models, key=worth)
        choice = choice.of(sorted([best, *others, *choice.singles], key=worth))
        if choice.share(best) > LEADS:
            rest = [j for j in choice.singles if j is not best]
            choice = choice.of(sorted([finished(best), *rest], key=worth))
        if choice.good(unseen):
            break
    return choice


def _with_scatter(choice: Choice, space: Space, candidates: Sequence[Candidate], unseen: HeldOut) -> Choice:
    """The same with what differs from episode to episode by chance, where that explains what no law does.

    It has no functional form that could be wrong: it explains all or is not there. Asked last, for a number for each
    episode would stand for two laws as well. No pair is made of it.
    """
    for candidate in scattered(space.simulator):
        joint = fit_scattered(space, candidate, SLIGHT * choice.excess)
        if choice.of([joint]).share(joint) < LEADS or follows_command(joint):
            continue
        joint = settled_scatter(joint)
        judged = choice.of([joint, *choice.singles])
        if judged.share(joint) > WHOLLY and judged.nameable(joint, unseen):
            return _concluded(judged, space, candidates, unseen)
    return choice


def _in_pairs(choice: Choice, space: Space, candidates: Sequence[Candidate], unseen: HeldOut) -> Choice:
    """No effect is enough: two at once, or one that two have led to the right place."""
    slight = SLIGHT * choice.excess
    best, *others = different(choice.singles)
    firsts = [best] if choice.share(best) > LEADS else [best, *(converge(j, slight, 4) for j in others[:1])]
    pairs = _pairs(firsts, candidates, slight)
    if not pairs:
        return choice
    if not _enough(choice, pairs, unseen):
        pairs = sorted([*pairs, *_of_singles(choice, space, slight)], key=worth)
    led, choice = pairs[0], _with_each(pairs[0], choice, space)
    leading = different(choice.singles)[:2]
    second = next(j for j in choice.singles if j.added == led.added[1:])
    ways: tuple[Callable[[], list[Joint]], ...] = (
        lambda: _with_a_rate(leading[0], candidates, slight),
        lambda: _with_a_limit(leading, candidates, slight),
        lambda: _with_contacts(leading[0], candidates, slight),
        lambda: _pairs([second], candidates, slight),
    )
    for way in ways:
        if not _enough(choice, pairs, unseen):
            pairs += way()
    pair = max(pairs, key=lambda p: evidence(p, unseen))
    if not choice.good(unseen) and pair is not led:
        choice = _with_each(pair, choice, space)
    if choice.good(unseen):
        return _concluded(choice, space, candidates, unseen)
    shown = choice.shown_by(pair)
    if shown.share(pair) > NEARLY and unseen.helps(pair) and not shown.nameable(pair, unseen):
        pair = from_second_start(pair)
    if pair.fit.point.cost < min(j.fit.point.cost for j in choice.singles):
        choice = choice.shown_by(pair)
    return replace(choice, pair=pair)


def _of_singles(choice: Choice, space: Space, slight: float) -> list[Joint]:
    """The best effect with the best other force and the best that is none, as they stand alone, from the first guess.

    Where two effects are large, the parameters bend for the one that is not there, and from there its like is not seen.
    A field has grown wide to stand for both.
    """
    best, *others = different(choice.singles)
    kinds = [[j for j in others if Candidate(j.added[0]).by_force == by_force] for by_force in (True, False)]
    starts = []
    for other in (of_kind[0] for of_kind in kinds if of_kind):
        added = (*best.added, *other.added)
        numbers = np.concatenate([j.fit.point.values[len(space.fit.point.values) :] for j in (best, other)])
        lengths = widths([q for attached in added for q in attached.effect.quantities])
        wide = [np.where(lengths > 0, np.maximum(lengths, width * numbers), numbers) for width in WIDTHS]
        starts += [(added, start) for start in (wide if lengths.any() else wide[:1])]
    return [converge(j, slight) for j in sorted(best_of(space, starts, 2), key=worth)[:1]]


def _with_each(pair: Joint, choice: Choice, space: Space) -> Choice:
    """The same with each effect of a pair alone: the way to a pair may need an effect that is not there."""
    alone = [further(_one_of(pair, i, space), SLIGHT * choice.excess, 5) for i in (0, 1)]
    return choice.of(sorted([*alone, *choice.singles], key=worth))


def _enough(choice: Choice, pairs: Sequence[Joint], unseen: HeldOut) -> bool:
    """Whether an effect alone is enough, or the best of some pairs leaves nothing to look for."""
    best = min(pairs, key=worth)
    return bool(choice.good(unseen)) or (choice.shown_by(best).share(best) > SURELY and unseen.helps(best))


def _concluded(choice: Choice, space: Space, candidates: Sequence[Candidate], unseen: HeldOut) -> Choice:
    """One effect is enough: at its optimum, with what explains as much, and with a second one where that is needed.

    One that reaches the noise floor has nowhere better to go; any other is fitted from a second start too.
    """
    first = simplest(choice.good(unseen))
    choice = choice.of(sorted([*choice.singles, *_in_its_place(first, choice, space, candidates)], key=worth))
    first = simplest(choice.good(unseen))
    equal = _equals(first, choice, unseen)
    others = [j for j in choice.singles if j is not first]
    at_floor = choice.remainder(first) < SEEN
    choice = choice.of([finished(first) if at_floor else from_second_start(first), *others])
    return _with_second(replace(choice, equal=equal), candidates, unseen)


def _in_its_place(first: Joint, choice: Choice, space: Space, candidates: Sequence[Candidate]) -> list[Joint]:
    """Twins of an effect, fitted from where it has led the parameters, where none of their fits came as far.

    What is tried first may be enough before its twins are tried, or before they have converged. Fields are left out:
    their place had to be searched.
    """
    near = {j.name for j in choice.singles if worth(j) - worth(first) < EQUAL}
    twins = next((c.twins for c in candidates if c.attached == first.added[0]), ())
    untried = [c for c in map(Candidate, twins) if c.name not in near and not c.by_force]
    return [
        converge(in_place_of(first, c.attached, space.simulator, space.likelihood), SLIGHT * choice.excess)
        for c in different(untried)
    ]


def _clear(choice: Choice) -> bool:
    """Whether one effect explains much and no other half as much."""
    best, *others = different(choice.singles)
    share = choice.share(best)
    return share > LEADS and all(choice.share(j) < 0.5 * share for j in others)


def _compared(choice: Choice, slight: float) -> list[Joint]:
    """The same models with the leading ones converged, the best first."""
    best = choice.share(choice.singles[0])
    leading = [j for j in choice.singles[:LEADERS] if choice.share(j) > 0.5 * best]
    rest = [j for j in choice.singles if j not in leading]
    leading = sorted((j if j.converged else further(j, slight, 5) for j in leading), key=worth)
    ended = [j if j.converged else converge(j, slight) for j in leading[:2]]
    return sorted([*ended, *leading[2:], *rest], key=worth)


def _equals(best: Joint, choice: Choice, unseen: HeldOut) -> tuple[Joint, ...]:
    """Other effects that explain the recordings as well: within EQUAL of log evidence, or EQUAL_SHARE.

    One that comes to a simpler one among them at an end of its shapes says nothing new.
    """
    top = evidence(best, unseen)
    margin = max(EQUAL, EQUAL_SHARE * choice.excess / best.likelihood.correlation_time)
    equal = [
        joint
        for joint in different(choice.singles)
        if joint.name != best.name and top - evidence(joint, unseen) < margin and unseen.helps(joint)
    ]
    names = {best.name, *(joint.name for joint in equal)}
    return tuple(joint for joint in equal if joint.added[0].effect.limit not in names)


def simplest(good: Sequence[Joint]) -> Joint:
    """The best, or what it comes to at an end of its shapes where that explains as much."""
    return next((j for j in good if comes_to(good[0], j)), good[0])


def _with_second(choice: Choice, candidates: Sequence[Candidate], unseen: HeldOut) -> Choice:
    """The same with a second effect where the first leaves something, and that has a cause of its own."""
    first = choice.singles[0]
    if choice.remainder(first) < SEEN:
        return choice
    slight = SLIGHT * choice.excess
    pairs = _pairs([first], candidates, slight)
    if not pairs:
        return choice
    judged = _beside(first, pairs, choice, unseen)
    if not judged.two:
        pairs += _with_a_limit([first], candidates, slight)
        judged = _beside(first, pairs, choice, unseen)
    if not judged.two and unseen.share(first) < PREDICTS:
        pairs += _with_contacts(first, candidates, slight)
        judged = _beside(first, pairs, choice, unseen)
    return judged


def _beside(first: Joint, pairs: Sequence[Joint], choice: Choice, unseen: HeldOut) -> Choice:
    """The same with the best of some pairs with the first effect, and whether there are two."""
    pair = max(pairs, key=lambda p: evidence(p, unseen))
    choice = replace(choice.shown_by(pair), pair=pair)
    needed, predicts = choice.remainder(first) > SEEN, unseen.beside(first).helps(pair)
    return replace(choice, two=predicts and needed and choice.explains(pair, first))


def _one_of(pair: Joint, i: int, space: Space) -> Joint:
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


def _pairs(firsts: Sequence[Joint], candidates: Sequence[Candidate], slight: float) -> list[Joint]:
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


def _beyond(first: Joint, candidates: Sequence[Candidate]) -> tuple[Space, list[Score]]:
    """What one effect leaves, and what the other candidates promise there."""
    own = {a.effect.name for a in first.added}
    others = [c for c in candidates if c.name not in own]
    return screen(first.simulator, first.likelihood, first.fit, others)


def _with_a_rate(first: Joint, candidates: Sequence[Candidate], slight: float) -> list[Joint]:
    """A fit of one effect with one that has a frequency, from the first guess: alone, it had bent the parameters."""
    there, scores = _beyond(first, candidates)
    other = at_other_rates(there, scores)
    return [replace(converge(other, slight), added=(*first.added, *other.added))] if other else []


def _with_a_limit(firsts: Sequence[Joint], candidates: Sequence[Candidate], slight: float) -> list[Joint]:
    """A fit of some effects, each with a limit of the commands: below it first order says nothing of it."""
    limits = [c for c in candidates if c.name == "velocity_saturation"]
    return _begun_beside(firsts, limits, OF_TWINS, slight)


def _with_contacts(first: Joint, candidates: Sequence[Candidate], slight: float) -> list[Joint]:
    """A fit of one effect with an effect of contacts.

    First order says little of those: dampings take a small one away, and have to give it back as it grows.
    """
    of_contacts = [c for c in candidates if c.attached.effect.channel == "contact" and c.attached.effect.on != "walls"]
    return _begun_beside([first], different(of_contacts), OF_CONTACTS, slight)


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
