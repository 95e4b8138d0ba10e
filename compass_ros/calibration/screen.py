"""Which of hundreds of parameters to look at: those that do anything, and of these the ones that no other stands for.

Among hundreds of fields of a scene many are never read in these shots: a wall that no puck reaches, friction of
contacts that have none. A rollout is the same to the last bit whether such a field has one value or another, so a whole
group of them is dismissed by one rollout in which all of its members are moved (group testing, Dorfman 1943). Members
of a group that does move something are looked at one by one by whoever asks.

Of those that act many do the same: a geom's place in its body and the body's place, friction of a joint and of the
table. A fit needs one of each kind, and the causes that are left then are few.
"""

from __future__ import annotations

from itertools import groupby

import numpy as np

from compass_ros.calibration.cost import Point
from compass_ros.calibration.differences import inward
from compass_ros.calibration.likelihood import Likelihood
from compass_ros.types import Bools, Floats, Ints

GROUP = 16
"""Most members of a group."""
WORTH = 128
"""Parameters from which on groups save more than they cost."""


def many(likelihood: Likelihood) -> bool:
    """Whether there are so many parameters that they are screened."""
    return len(likelihood.parameters) >= WORTH


def acting(likelihood: Likelihood, point: Point, share: float) -> Bools:
    """(P,) False where moving a parameter by `share` of its prior width changes no frame of any recording.

    Costs one rollout of each episode for each group; nothing below WORTH parameters, all of which are then True.
    """
    everything: Bools = np.ones(len(likelihood.parameters), bool)
    if not many(likelihood):
        return everything
    groups = alike([p.name for p in likelihood.parameters])
    every = np.arange(len(likelihood.parameters))
    step = inward(likelihood, point, every, np.full(len(every), share))
    values = np.tile(point.values, (1 + len(groups), 1))
    for row, members in zip(values[1:], groups, strict=True):
        row[members] += step[members]
    episodes = len(likelihood.inputs)
    inputs = np.tile(likelihood.inputs + point.launch, (len(values), 1))
    flat = likelihood.residual(np.repeat(values, episodes, axis=0), inputs, np.tile(np.arange(episodes), len(values)))
    residual = flat.reshape(len(values), -1)
    for members, same in zip(groups, (residual[1:] == residual[0]).all(axis=1), strict=True):
        everything[members] = not same
    return everything


def alike(names: list[str]) -> list[Ints]:
    """Indices of parameters in groups of at most GROUP whose names end alike: they act, or not, for the same reason."""
    kinds = [name.rpartition("@")[2] for name in names]
    ordered = sorted(range(len(names)), key=lambda i: kinds[i])
    groups: list[Ints] = []
    for _, same in groupby(ordered, key=lambda i: kinds[i]):
        members = np.array(list(same))
        groups += [members[i : i + GROUP] for i in range(0, len(members), GROUP)]
    return groups


def independent(gram: Floats, least: float) -> Ints:
    """Parameters that move the recordings by more than `least` sigma where the ones chosen before cannot do the same.

    `gram`: (P, P) products of the changes of all recordings per prior width [sigma^2]. The strongest goes first, and
    what remains of the others is what it leaves over within its prior: pivoted Cholesky decomposition of I + gram.
    """
    left = gram.astype(np.float64, copy=True)
    chosen: list[int] = []
    while len(chosen) < len(left):
        rest = np.diag(left).copy()
        rest[chosen] = 0.0
        best = int(np.argmax(rest))
        if rest[best] <= least**2:
            break
        chosen.append(best)
        column = left[:, best].copy()
        left -= np.outer(column, column) / (1.0 + column[best])
    return np.array(sorted(chosen), dtype=np.int64)


def coupling(gram: Floats, chosen: Ints, share: float) -> Floats:
    """(n,) factors by which what was not chosen makes the chosen parameters less certain.

    Standard deviations with all parameters free over those with the chosen ones alone. `share`: of the information in
    `gram` that counts.
    """
    everything = np.linalg.inv(np.eye(len(gram)) + share * gram)
    alone = np.linalg.inv(np.eye(len(chosen)) + share * gram[np.ix_(chosen, chosen)])
    return np.asarray(np.sqrt(np.maximum(np.diag(everything)[chosen] / np.diag(alone), 1.0)))
