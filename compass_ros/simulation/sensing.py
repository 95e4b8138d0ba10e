"""Laws of sensors one after the other: what several sensors say of what perfect ones would.

A law says something new in the columns of its signals, from what was said there before, at any time. Laws of signals
that share no column know nothing of each other, so each group that does is a chain of its own beside the others; and
what was asked of a chain last is remembered, for a law and the columns that it leaves both ask for it. One long chain
would be asked twice by each of its links: 16,384 times by scales of fourteen signals.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from compass_ros.simulation.effects.effect import Context, Sample
from compass_ros.types import Bools, Floats

Sensing = Callable[[Sample], Sample]
"""A law with its numbers: from what was said before it to what is said after it."""


def link(law: Callable[[Sample, Floats, Context], Sample], numbers: Floats, context: Context) -> Sensing:
    """An effect's `sensing` with its (B, q) numbers."""
    return lambda sample: law(sample, numbers, context)


def through(laws: Sequence[tuple[Bools, Sensing]], perfect: Sample) -> Sample:
    """What sensors with some laws say, each on (C,) columns, of what `perfect` ones say at (B, F) times [s]."""
    if not laws:
        return perfect
    first = _remembered(perfect)
    chains = [(np.any([columns for columns, _ in group], axis=0), _chain(group, first)) for group in _groups(laws)]
    if len(chains) == 1 and chains[0][0].all():
        return chains[0][1]

    def said(time: Floats) -> Floats:
        out = np.array(first(time))
        for columns, chain in chains:
            out[:, :, columns] = chain(time)[:, :, columns]
        return out

    return said


def _groups(laws: Sequence[tuple[Bools, Sensing]]) -> list[list[tuple[Bools, Sensing]]]:
    """Laws that are connected by columns which they share, each group in their order."""
    groups: list[list[int]] = []
    for i, (columns, _) in enumerate(laws):
        touching = [g for g in groups if any(np.any(laws[j][0] & columns) for j in g)]
        groups = [g for g in groups if g not in touching] + [sorted([*(j for g in touching for j in g), i])]
    return [[laws[i] for i in group] for group in groups]


def _chain(laws: Sequence[tuple[Bools, Sensing]], sample: Sample) -> Sample:
    for columns, law in laws:
        sample = _remembered(_where(columns, law(sample), sample))
    return sample


def _where(columns: Bools, sensed: Sample, before: Sample) -> Sample:
    """What a law says in its columns, and in the others what was said before."""
    if columns.all():
        return sensed
    return lambda time: np.where(columns, sensed(time), before(time))


def _remembered(sample: Sample) -> Sample:
    """The same; asked again for the last array of times or the one before it, it says what it said.

    Two: a law that is late asks for other times, and the columns that it leaves for the same.
    """
    last: list[tuple[Floats, Floats]] = []

    def said(time: Floats) -> Floats:
        found = next((one for one in last if one[0] is time), None) or (time, sample(time))
        last[:] = [found, *(one for one in last if one is not found)][:2]
        return found[1]

    return said
