"""Laws of several sensors: to the bit what one long chain says, at a cost that grows with their number alone."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from compass_ros.simulation.effects.effect import Sample
from compass_ros.simulation.sensing import Sensing, through
from compass_ros.types import Bools, Floats

TIME = np.linspace(0, 1, 5)[None].repeat(2, axis=0)


class Perfect:
    """C sensors of one motion, and how often they were asked."""

    def __init__(self, count: int) -> None:
        self.rates, self.asked = np.arange(1.0, count + 1), 0

    def __call__(self, time: Floats) -> Floats:
        self.asked += 1
        return np.asarray(np.sin(time[:, :, None] * self.rates))


def scaled(by: float) -> Sensing:
    return lambda sample: lambda time: np.asarray(by * sample(time))


def late(by: float) -> Sensing:
    return lambda sample: lambda time: sample(time - by)


def turned(columns: Bools) -> Sensing:
    """Each of these columns says what the one before it does."""
    own = np.flatnonzero(columns)

    def of(sample: Sample) -> Sample:
        def said(time: Floats) -> Floats:
            out = sample(time).copy()
            out[:, :, own] = out[:, :, np.roll(own, 1)]
            return out

        return said

    return of


def one_after_the_other(laws: Sequence[tuple[Bools, Sensing]], sample: Sample, time: Floats) -> Floats:
    """The definition."""
    if not laws:
        return sample(time)
    *before, (columns, law) = laws

    def said(when: Floats) -> Floats:
        return one_after_the_other(before, sample, when)

    return np.where(columns, law(said)(time), said(time))


def of(count: int, *columns: int) -> Bools:
    return np.isin(np.arange(count), columns)


MIXED = [
    (of(6, 0, 1), turned(of(6, 0, 1))),
    (of(6, 2), late(0.1)),
    (of(6, 1, 3), scaled(1.5)),
    (of(6, 2), scaled(0.5)),
    (of(6, 4), scaled(2.0)),
    (of(6, 1), late(0.2)),
]


@pytest.mark.parametrize(
    "laws",
    [[], MIXED, MIXED[::-1], [*MIXED, (of(6, *range(6)), late(0.3))], [(of(6, *range(6)), scaled(2.0)), *MIXED]],
    ids=["none", "mixed", "other order", "all late", "all scaled"],
)
def test_it_is_one_law_after_the_other(laws: Sequence[tuple[Bools, Sensing]]) -> None:
    said = through(laws, Perfect(6))(TIME)
    assert said.tobytes() == one_after_the_other(laws, Perfect(6), TIME).tobytes()


@pytest.mark.parametrize(("law", "asked"), [(scaled(1.1), 1), (late(0.1), 15)])
def test_fourteen_sensors_are_asked_a_few_times(law: Sensing, asked: int) -> None:
    perfect = Perfect(14)
    through([(of(14, i), law) for i in range(14)], perfect)(TIME)
    assert perfect.asked == asked


def test_laws_of_all_columns_ask_once_for_each_delay() -> None:
    perfect, every = Perfect(3), of(3, 0, 1, 2)
    said = through([(every, scaled(1.1)), (every, late(0.1)), (every, scaled(0.9))], perfect)
    assert said(TIME).tobytes() == (0.9 * (1.1 * Perfect(3)(TIME - 0.1))).tobytes()
    assert perfect.asked == 1


def test_what_is_remembered_is_of_these_times_alone() -> None:
    said = through(MIXED, Perfect(6))
    first, other = said(TIME), said(TIME + 0.5)
    assert said(TIME).tobytes() == first.tobytes()
    assert not np.array_equal(first, other)
