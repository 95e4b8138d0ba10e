"""Which effects explain what is left: fits of the most promising candidates, alone and in pairs."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace

from compass_ros.discovery.anew import contacts_anew
from compass_ros.discovery.beginning import in_place_of
from compass_ros.discovery.candidates import Candidate, scattered
from compass_ros.discovery.choice import FORM_LEFT, LEADERS, PREDICTS, SEEN, Choice, comes_to, evidence, undecided
from compass_ros.discovery.joint import Joint, converge, finished, from_second_start
from compass_ros.discovery.pairs import (
    of_singles,
    one_of,
    promising_pairs,
    with_a_limit,
    with_a_rate,
    with_contacts,
)
from compass_ros.discovery.scatter import fit_scattered, follows_command, settled_scatter
from compass_ros.discovery.screen import Score, Space
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

    It has no functional form that could be wrong: it explains all, with a law beside it perhaps, or is not there.
    Asked last, for a number for each episode would stand for two laws as well.
    """
    slight = SLIGHT * choice.excess
    for candidate in scattered(space.simulator, *space.told):
        joint = fit_scattered(space, candidate, slight)
        if choice.of([joint]).share(joint) < LEADS or follows_command(joint):
            continue
        joint = settled_scatter(joint)
        judged = choice.of([joint, *choice.singles])
        if judged.share(joint) > WHOLLY and judged.nameable(joint, unseen):
            return _concluded(judged, space, candidates, unseen)
        for pair in promising_pairs([joint], candidates, slight)[:1]:
            shown = replace(judged.shown_by(pair), pair=pair)
            if shown.share(pair) > WHOLLY and shown.verdict(unseen) is pair:
                return shown
    return choice


def _in_pairs(choice: Choice, space: Space, candidates: Sequence[Candidate], unseen: HeldOut) -> Choice:
    """No effect is enough: two at once, or one that two have led to the right place."""
    slight = SLIGHT * choice.excess
    best, *others = different(choice.singles)
    firsts = [best] if choice.share(best) > LEADS else [best, *(converge(j, slight, 4) for j in others[:1])]
    pairs = promising_pairs(firsts, candidates, slight)
    if not pairs:
        return choice
    if not _enough(choice, pairs, unseen):
        pairs = sorted([*pairs, *of_singles(firsts, choice, space, slight)], key=worth)
    led, choice = pairs[0], _with_each(pairs[0], choice, space)
    leading = different(choice.singles)[:2]
    second = next(j for j in choice.singles if j.added == led.added[1:])
    ways: tuple[Callable[[], list[Joint]], ...] = (
        lambda: with_a_rate(leading[0], candidates, slight),
        lambda: with_a_limit(leading, candidates, slight),
        lambda: with_contacts(leading[0], candidates, slight),
        lambda: promising_pairs([second], candidates, slight),
    )
    for way in ways:
        if not _enough(choice, pairs, unseen):
            pairs += way()
    pair = simplest(sorted(pairs, key=lambda p: -evidence(p, unseen)))
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


def _with_each(pair: Joint, choice: Choice, space: Space) -> Choice:
    """The same with each effect of a pair alone: the way to a pair may need an effect that is not there."""
    alone = [further(one_of(pair, i, space), SLIGHT * choice.excess, 5) for i in (0, 1)]
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
    if not choice.ends(first, unseen):
        choice = _contested(choice, unseen)
        first = simplest(choice.good(unseen))
    equal = _equals(first, choice, unseen)
    others = [j for j in choice.singles if j is not first]
    end = finished if choice.ends(first, unseen) else from_second_start
    choice = choice.of([end(first), *others])
    return _with_second(replace(choice, equal=equal), candidates, unseen)


def _contested(choice: Choice, unseen: HeldOut) -> Choice:
    """The same with all effects that may be named at their optimum, where none of them reaches the noise floor.

    Along a valley a step gains little long before the end, and the right effect may be behind a wrong one there.
    """
    good = different(choice.good(unseen))
    if len(good) < 2:
        return choice
    ended = [finished(j) for j in good]
    contested = choice.of(sorted([*ended, *(j for j in choice.singles if j not in good)], key=worth))
    return contested if contested.good(unseen) else choice


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
        if joint.name != best.name
        and top - evidence(joint, unseen) < margin
        and unseen.helps(joint)
        and not joint.stands_in
        and joint.distinct
    ]
    names = {best.name, *(joint.name for joint in equal)}
    return tuple(joint for joint in equal if joint.added[0].effect.limit not in names)


def simplest(good: Sequence[Joint]) -> Joint:
    """The best, or what it comes to at an end of its shapes where that explains as much."""
    return next((j for j in good if comes_to(good[0], j)), good[0])


def _with_second(choice: Choice, candidates: Sequence[Candidate], unseen: HeldOut) -> Choice:
    """The same with a second effect where the first leaves something, and that has a cause of its own."""
    first = choice.singles[0]
    if choice.ends(first, unseen):
        return choice
    slight = SLIGHT * choice.excess
    pairs = promising_pairs([first], candidates, slight)
    if not pairs:
        return choice
    judged = _beside(first, pairs, choice, unseen)
    if not judged.two:
        pairs += with_a_limit([first], candidates, slight)
        judged = _beside(first, pairs, choice, unseen)
    if not judged.two and unseen.share(first) < PREDICTS:
        pairs += with_contacts(first, candidates, slight)
        judged = _beside(first, pairs, choice, unseen)
    return judged


def _beside(first: Joint, pairs: Sequence[Joint], choice: Choice, unseen: HeldOut) -> Choice:
    """The same with the best of some pairs with the first effect, and whether there are two."""
    pair = simplest(sorted(pairs, key=lambda p: -evidence(p, unseen)))
    choice = replace(choice.shown_by(pair), pair=pair)
    predicts = unseen.beside(first).helps(pair)
    needed = choice.remainder(first) > SEEN or unseen.remainder(pair) < FORM_LEFT * unseen.remainder(first)
    return replace(choice, two=predicts and needed and choice.explains(pair, first))
