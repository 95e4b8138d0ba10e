"""A better set of shots of the same number: forward selection, then exchange of single shots while that helps.

The worth of a set is the sum over effects of log(1 + information), each after the parameters and after the effect that
looks most like it have taken their part. So seeing an effect and telling it from its twin count alike, an effect that
nothing could show costs nothing, and no effect is bought with the last digits of another.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from compass_ros.planning.information import Information
from compass_ros.types import Floats, Ints

PASSES = 3
_TOLD = 0.01
"""Least share that is called left over by a twin: exact twins do not decide."""


@dataclass(frozen=True)
class Chosen:
    """A set of shots out of a pool."""

    shots: Ints
    """(n,) indices."""
    worth: float


def worth(known: Information, shots: Ints) -> float:
    """Of a set of shots out of those of an `Information`."""
    left, _ = known.of_effects(shots)
    names = np.array([known.candidates[c.candidate].name for c in known.columns])
    size = np.sqrt(np.maximum(np.diag(left), 1e-300))
    cosine2 = (left / size[:, None] / size) ** 2
    cosine2[names[:, None] == names] = 0.0
    told = np.maximum(1 - cosine2.max(axis=1, initial=0.0), _TOLD)
    return float(np.sum(_share(known) * np.log1p(np.diag(left) * told)))


def _share(known: Information) -> Floats:
    """(n,) weight of each column, so that each candidate counts once."""
    of = np.array([c.candidate for c in known.columns])
    return np.asarray(1 / np.bincount(of)[of])


def choose(known: Information, count: int) -> Chosen:
    """The best `count` shots that forward selection and exchange find."""
    pool = np.arange(len(known.gram))
    chosen: list[int] = []
    while len(chosen) < min(count, len(pool)):
        chosen.append(_best(known, chosen, pool)[0])
    best = worth(known, np.array(chosen))
    for _ in range(PASSES):
        before = best
        for place in range(len(chosen)):
            others = chosen[:place] + chosen[place + 1 :]
            shot, value = _best(known, others, pool)
            if value > best:
                chosen[place], best = shot, value
        if best <= before:
            break
    return Chosen(np.array(chosen), best)


def _best(known: Information, chosen: list[int], pool: Ints) -> tuple[int, float]:
    """The shot that is worth most beside those chosen, and the worth of the set."""
    values = {int(s): worth(known, np.array([*chosen, s])) for s in pool if s not in chosen}
    shot = max(values, key=lambda s: values[s])
    return shot, values[shot]
