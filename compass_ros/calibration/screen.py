"""Which parameters do anything at all: asked in groups, since most of a long list does nothing.

Among hundreds of fields of a scene many are never read in these shots: a wall that no puck reaches, friction of
contacts that have none. A rollout is the same to the last bit whether such a field has one value or another, so a whole
group of them is dismissed by one rollout in which all of its members are moved (group testing, Dorfman 1943). Members
of a group that does move something are looked at one by one by whoever asks.
"""

from __future__ import annotations

from itertools import groupby

import numpy as np

from compass_ros.calibration.least_squares import Point
from compass_ros.calibration.likelihood import Likelihood
from compass_ros.types import Bools, Floats, Ints

GROUP = 16
"""Most members of a group."""
WORTH = 128
"""Parameters from which on groups save more than they cost."""


def acting(likelihood: Likelihood, point: Point, share: float) -> Bools:
    """(P,) False where moving a parameter by `share` of its prior width changes no frame of any recording.

    Costs one rollout of each episode for each group; nothing below WORTH parameters, all of which are then True.
    """
    everything: Bools = np.ones(len(likelihood.parameters), bool)
    if len(everything) < WORTH:
        return everything
    groups = alike([p.name for p in likelihood.parameters])
    step = moved_by(likelihood, point, share)
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


def moved_by(likelihood: Likelihood, point: Point, share: float) -> Floats:
    """(P,) steps of `share` prior widths, to the side that stays inside the bounds."""
    steps = share * likelihood.prior_std
    return np.where(point.values + steps > likelihood.high, -steps, steps)


def alike(names: list[str]) -> list[Ints]:
    """Indices of parameters in groups of at most GROUP whose names end alike: they act, or not, for the same reason."""
    kinds = [name.rpartition("@")[2] for name in names]
    ordered = sorted(range(len(names)), key=lambda i: kinds[i])
    groups: list[Ints] = []
    for _, same in groupby(ordered, key=lambda i: kinds[i]):
        members = np.array(list(same))
        groups += [members[i : i + GROUP] for i in range(0, len(members), GROUP)]
    return groups
