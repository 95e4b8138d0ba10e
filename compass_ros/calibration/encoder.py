"""Encoders that count: the step between the values that they can say, and what a value is worth that is said again.

A value y = q round(x / q) is off by up to half a step q. Where x moves by a step or more from frame to frame, that is
white noise of variance q^2 / 12 (Bennett 1948). Where x moves less it is not: while one value is repeated, all that is
known is that x lies within one step, so n equal values in a row are worth one measurement and not n.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from compass_ros.types import Floats

ROOT_12 = float(np.sqrt(12.0))
"""Step over standard deviation of what rounding makes wrong: that of a uniform distribution."""
_FEWEST = 20
"""Changes from which a common spacing is found: by chance, their phases agree as below with probability exp(-19)."""
_IN_PHASE = 0.98
"""Mean cosine of the phases of differences, and of values, on a lattice of this step: rounding of 0.03 steps, as tables
with few digits have it.

Where there is no lattice it is 0 +- 1 / sqrt(2 n): Rayleigh's test (1919) gives exp(-n R^2) for n phases by chance.
"""
_DIVISORS = (1, 2, 3, 4)
"""The smallest difference that occurs may be so many steps."""
_BELOW = 0.02
"""Share of the differences that may be smaller than half a step: a lost digit, a glitch."""
_DIGITS = 5.0
"""Least step in digits that is told from them: the mean cosine of its second differences is 0.82 then, 0.65 at 3.5,
below which rounding hides it."""
_RATIO = 1.5
"""Of the digits that are tried, from a tenth of single precision on."""
_GROWTH = 4.0
"""By how much the range of differences grows from one refinement of the step to the next."""


_SINGLE = 20 * float(np.finfo(np.float32).eps)
"""The finest step over the largest value: messages and tables often have single precision, whose rounding makes second
differences of up to two such units; a tenth of the finest step must be more."""


def encoder_step(series: Sequence[Floats], finest: float) -> float:
    """The greatest common spacing of the values of one signal, 0 where there is none of `finest` or more.

    It is looked for beneath the rounding by a table's digits, whatever these are: an encoder of 0.0879 degrees printed
    to 0.01 degrees says 0.09, 0.18, 0.26, and is as coarse as before.

    Args:
        series: (F,) values of each recording, NaN where nothing was seen. Any unit.
        finest: The least step that is looked for [the same unit].
    """
    seen = [one[~np.isnan(one)] for one in series]
    single = _SINGLE * max((float(np.abs(one).max()) for one in seen if len(one)), default=0.0)
    second = np.concatenate([np.diff(one, 2) for one in seen] or [np.zeros(0)])  # small where it is fast too
    change = np.sort(np.abs(second))
    finest = max(finest, single)
    least, most = 0.1 * single, float(change.max(initial=0.0)) / _DIGITS
    count = int(np.log(most / least) / np.log(_RATIO)) + 1 if most > least > 0 else 0
    digits = [0.0, *(least * _RATIO ** np.arange(count))]
    found = (_spacing(seen, change, max(finest, _DIGITS * digit), digit) for digit in reversed(digits))
    return next((step for step in found if step), 0.0)  # of the coarsest: finer ones see the same lattice again


def _spacing(seen: Sequence[Floats], change: Floats, finest: float, digit: float) -> float:
    """The greatest common spacing, of `finest` or more, of values that were rounded to a `digit` (0: to none).

    `change`: (n,) sizes of second differences, the smallest first.
    """
    moved = change[change > max(0.1 * finest, 2.5 * digit)]  # rounded thrice, one value differs by two digits
    if len(moved) < _FEWEST:
        return 0.0
    least = moved[int(_BELOW * len(moved))]
    smallest = float(np.median(moved[(moved >= least) & (moved <= max(1.2 * least, least + 2 * digit))]))
    for divisor in _DIVISORS:
        step = _lattice(moved, smallest / divisor, digit) if smallest / divisor >= finest else 0.0
        if step and digit:  # slow second differences are one rounded step each: values farther apart say it better
            counts = np.unique(np.round(np.concatenate(seen) / step))  # a value that jumps to and fro has two
            step = _lattice(_apart(seen, step), step, digit) if len(counts) >= _FEWEST else 0.0
        if step >= finest and _rough(seen, step) and all(_in_phase(one, step, digit) for one in seen if len(one)):
            return step
    return 0.0


def _apart(seen: Sequence[Floats], step: float) -> Floats:
    """Sorted distances, of half a `step` or more, between values of a recording that are 1, 2, 4, ... frames apart."""
    lags = [2**k for k in range(int(np.log2(max(map(len, seen)))))]
    apart = np.abs(np.concatenate([one[lag:] - one[:-lag] for one in seen for lag in lags]))
    return np.sort(apart[apart > 0.5 * step])


def _lattice(moved: Floats, guess: float, digit: float) -> float:
    """The step near a guess of which all (n,) differences are multiples, but for a digit; 0 where they are not.

    Small multiples say it roughly, and so let larger ones be counted, which say it better.
    """
    step, reach = guess, _GROWTH * guess
    if np.mean(moved < 0.5 * guess) > _BELOW:
        return 0.0
    while True:
        near = moved[moved <= reach]
        count = np.round(near / step)
        step = float(np.sum(count * near) / max(float(np.sum(count**2)), 1.0))
        if step <= 0:
            return 0.0
        left = np.sinc(digit / step) ** 2 * np.sinc(2 * digit / step)  # mean cosine of roundings once, twice and once
        if np.mean(np.cos(2 * np.pi * near / step)) < _IN_PHASE * left:
            return 0.0
        if reach >= moved[-1]:
            return step
        reach *= _GROWTH


def _in_phase(one: Floats, step: float, digit: float) -> bool:
    """Whether (F,) values, and not only their differences, are on one lattice; a glitch in ten may be elsewhere."""
    phase = np.exp(2j * np.pi * (one - one[0]) / step)
    return bool(np.abs(np.mean(phase)) > 0.8 * _IN_PHASE * np.sinc(digit / step))


def _rough(seen: Sequence[Floats], step: float) -> bool:
    """Whether the values jump as counts do: a fall computed without noise is on a lattice too, and is smooth.

    Fourth differences of counts that change are a step or more, those of a smooth motion next to nothing.
    """
    fourth, moving = [], []
    for one in seen:
        if len(one) >= 5:
            fourth.append(np.abs(np.diff(one, 4)))
            moving.append(np.ptp(np.lib.stride_tricks.sliding_window_view(one, 5), axis=1) > 0.5 * step)
    changing = np.concatenate(fourth)[np.concatenate(moving)] if fourth else np.zeros(0)
    return bool(len(changing)) and float(np.median(changing)) > 0.5 * step


def repeats(values: Floats, step: Floats) -> Floats:
    """(E, F, C) how many equal values in a row each of (E, F, C) values is one of; 1 in columns without a (C,) step.

    Frames in which nothing was seen (NaN) do not end such a row.
    """
    out = np.ones(values.shape)
    for c in np.flatnonzero(step > 0):
        for e in range(len(values)):
            seen = np.flatnonzero(~np.isnan(values[e, :, c]))
            said = values[e, seen, c]
            row = np.concatenate([[0], np.cumsum(np.abs(np.diff(said)) > 0.5 * step[c])]) if len(said) else said
            out[e, seen, c] = np.bincount(row.astype(int))[row.astype(int)] if len(said) else out[e, seen, c]
    return out
