"""The next experiment: where explanations that are open so far predict most differently.

A model's prediction of a new recording is uncertain, since its parameters are; draws from its posterior say how much,
chaos included. The difference of two models counts after each has been refitted to first order, that is without the
part that such draws could make up (T-optimal design; Atkinson and Fedorov 1975).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations

import numpy as np

from compass_ros.discovery import Discovery
from compass_ros.discovery.hypothesis import Hypothesis
from compass_ros.discovery.words import listed
from compass_ros.errors import DataError
from compass_ros.planning.other_measurements import Moved, between, how_moved, of_unknown
from compass_ros.planning.trials import Trials, trials
from compass_ros.simulation import Simulator
from compass_ros.types import Floats

DRAWS = 6
TOLD = 5.0
"""Difference [sigma] at which two models are told apart. The verdict's evidence lets the form of a law be wrong, so it
rises by less than half of its square: by 4 and 8 where two kinds of drag differ by 6.4 (test_next_motion.py), and 3 is
what a choice between two needs."""


@dataclass(frozen=True)
class NextExperiment:
    """What to record next."""

    sentence: str
    action: Mapping[str, float] | None = None
    """The shot by name of its fields; None where it is a motion, or no shot helps."""
    apart: float = 0.0
    """Least difference of the models that it tells apart [sigma]; 0 where it is neither shot nor motion."""
    files: Mapping[str, str] = field(default_factory=dict)
    """By name, what a robot needs to do it."""


def with_next(found: Discovery, simulator: Simulator, seed: int) -> Discovery:
    """A verdict that leaves something open, with what would settle it; the verdict stands where that is not found.

    `simulator`: without laws.
    """
    mismatch = found.mismatch
    following = NextExperiment("")
    if mismatch.verdict == "ambiguous":
        try:
            following = next_experiment(simulator, found.rivals, seed)
        except (DataError, np.linalg.LinAlgError) as error:
            following = NextExperiment(f"What to record next could not be worked out: {error}.")
    elif mismatch.verdict == "unknown" and mismatch.where is not None:
        advice = of_unknown(mismatch.where.channel, how_moved(simulator))
        following = NextExperiment(f"To see what it depends on, {advice}.")
    if not following.sentence:
        return found
    return replace(found, mismatch=replace(mismatch, next_experiment=following.sentence), files=following.files)


def next_experiment(simulator: Simulator, rivals: Sequence[Hypothesis], seed: int, count: int = 0) -> NextExperiment:
    """The shot or motion that tells most pairs of rival models apart, and by most; or what is neither.

    `simulator`: without laws; the sigma is that of the rivals' recordings. `count`: how many are tried, 0: as many as
    `trials` says.
    """
    pairs = list(combinations(range(len(rivals)), 2))
    if not pairs:
        return NextExperiment("")
    moved = how_moved(simulator)
    tried = trials(simulator, rivals[0].likelihood, seed, count)
    if tried is None:
        return NextExperiment(_other(rivals, pairs, "recording of this kind", moved))
    rng = np.random.default_rng(seed)
    predicted = [_predictions(rival, tried, rng) for rival in rivals]
    apart = np.array([_apart(predicted[a], predicted[b]) for a, b in pairs])  # (pairs, S)
    told = np.sum(apart > TOLD, axis=0)
    least = np.min(np.where(apart > TOLD, apart, np.inf), axis=0)
    best = int(np.lexsort((np.where(told > 0, least, apart.max(axis=0)), told))[-1])
    if not told[best]:
        return NextExperiment(_other(rivals, pairs, tried.word, moved))
    said = [
        f"{rivals[a].name} from {rivals[b].name} by {d:.0f} sigma"
        for (a, b), d in zip(pairs, apart[:, best], strict=True) if d > TOLD
    ]  # fmt: skip
    sentence = f"{tried.ask(best)}: it tells {', '.join(said)}."
    if left := [pair for pair, d in zip(pairs, apart[:, best], strict=True) if d <= TOLD]:
        sentence += " " + _other(rivals, left, tried.word, moved)
    return NextExperiment(sentence, tried.action(best), float(least[best]), tried.files(best))


def _predictions(rival: Hypothesis, tried: Trials, rng: np.random.Generator) -> Floats:
    """(1 + DRAWS, S, D) predictions [sigma] at the best values, and at draws from the posterior."""
    likelihood, root = rival.likelihood, rival.root
    values = np.tile(rival.fit.point.values, (1 + DRAWS, 1))
    values[1:] += rng.normal(size=(DRAWS, root.shape[1])) @ root.T
    return tried.predicted(rival.simulator, np.clip(values, likelihood.low, likelihood.high))


def _apart(one: Floats, other: Floats) -> Floats:
    """(S,) difference of two models in sigma, without what the posteriors of both could make up."""
    difference = one[0] - other[0]
    spread = np.concatenate([one[1:] - one[0], other[1:] - other[0]]) / np.sqrt(DRAWS)  # (2 DRAWS, S, D)
    out = np.empty(len(difference))
    for s, d in enumerate(difference):
        u = spread[:, s]
        pull = u @ d
        out[s] = d @ d - pull @ np.linalg.solve(u @ u.T + np.eye(len(u)), pull)
    return np.asarray(np.sqrt(np.maximum(out, 0.0)))


def _other(rivals: Sequence[Hypothesis], pairs: Sequence[tuple[int, int]], word: str, moved: Moved) -> str:
    """What tells pairs of rivals apart that nothing recorded in this way does; each advice once."""
    names = [frozenset(a.effect.name for a in rival.laws) for rival in rivals]
    of: dict[str, list[tuple[int, int]]] = {}
    for a, b in pairs:
        of.setdefault(between(names[a], names[b], moved), []).append((a, b))
    return " ".join(f"No {word} tells {_pairs(rivals, told)}: {what}." for what, told in of.items())


def _pairs(rivals: Sequence[Hypothesis], pairs: Sequence[tuple[int, int]]) -> str:
    """'a from b', or 'a, b and c apart' where these are all their pairs."""
    members = sorted({one for pair in pairs for one in pair})
    if len(members) > 2 and len(pairs) == len(members) * (len(members) - 1) // 2:
        return f"{listed([rivals[one].name for one in members])} apart"
    return ", ".join(f"{rivals[a].name} from {rivals[b].name}" for a, b in pairs)
