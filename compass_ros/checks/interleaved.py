"""Values of two kinds that take turns: two publishers on one topic, or a driver that fills in what it does not know.

Told apart, each kind is smooth; together they jump. The measure is how far each sample is from the line between its
neighbours: SMOOTHER times less once they are apart, and beyond the noise before.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from compass_ros.checks.finding import Finding, told
from compass_ros.checks.series import Level, Series, between
from compass_ros.types import Bools, Floats, Ints

SMOOTHER = 4.0
"""By how much the parts must be smoother than the whole. Halves of one motion are rougher than it, for their samples
are farther apart: up to four times for a parabola, never less than once."""
VISITS = 2
"""How often the rarer kind must come and go; zeros, which a driver that knows nothing says, once."""
LEAPS = 3.0
"""A visit is a jump there and back of so many steps of the others around it, beyond the noise: an impact jumps by one,
for a body that turns round goes on as fast as it came."""


@dataclass(frozen=True)
class _Parted:
    """One recording, parted."""

    rarer: Ints
    """Indices of the samples of the rarer kind."""
    value: Floats | None
    """(C,) what these say, all of them; None where they differ."""
    regular: bool
    """They come at a rate of their own."""


KINDS = ("zeros", "constant", "two series")
"""Of its findings."""


def interleaved(series: Sequence[Series], level: Level) -> tuple[Finding, ...]:
    """What two kinds of values there are in the recordings of one signal."""
    parted = {one.recording: split for one in series if (split := _parted(one, level))}
    zeros = {name: told(p.rarer) for name, p in parted.items() if p.value is not None and not p.value.any()}
    constant = {name: told(p.rarer) for name, p in parted.items() if p.value is not None and p.value.any()}
    others = {name: told(p.rarer) for name, p in parted.items() if p.value is None}
    regular = {name for name, p in parted.items() if p.regular}
    found = []
    what_of = ("zeros in between", "one and the same other value in between", "two series of values take turns")
    for kind, samples, what in zip(KINDS, (zeros, constant, others), what_of, strict=True):
        count, most = sum(map(len, samples.values())), sum(len(s.value) for s in series if s.recording in samples)
        rate = kind != "zeros" or regular & samples.keys()
        who = "two publishers on one topic" if rate else "samples that nobody filled in"
        found.append(Finding(kind, "bad", series[0].signal, samples, f"{what} ({count} of {most} samples): {who}?"))
    return tuple(one for one in found if one.samples)


def _parted(one: Series, level: Level) -> _Parted | None:
    """The split that makes most of it smooth; None where none does."""
    if len(one.value) < 8:
        return None
    whole = _roughness(one, np.zeros(len(one.value), bool))
    if _rms(whole, level) <= SMOOTHER * _rms(np.zeros_like(whole), level):
        return None  # no split is smoother than noise
    for rarer in _splits(one, level):
        said = one.value[rarer]
        same = bool((said == said[0]).all())
        visits = _visits(one, rarer, level)
        enough = visits >= (1 if same and not said.any() else VISITS)
        if enough and _rms(whole, level) > SMOOTHER * _rms(_roughness(one, rarer), level):
            return _Parted(np.flatnonzero(rarer), said[0] if same else None, _regular(one, rarer))
    return None


def _visits(one: Series, rarer: Bools, level: Level) -> int:
    """How often the rarer kind comes and goes by jumps that the others never make."""
    others = np.flatnonzero(~rarer)
    scaled = one.value / level.apart
    count = 0
    for j in np.flatnonzero(np.diff(others) > 1):
        first, last = others[j] + 1, others[j + 1] - 1
        there = np.linalg.norm(scaled[first] - scaled[first - 1])
        back = np.linalg.norm(scaled[last + 1] - scaled[last])
        around = scaled[others[max(j - 1, 0) : j + 3]]
        steps = np.linalg.norm(np.diff(around, axis=0), axis=1)
        count += bool(min(there, back) > 1 + LEAPS * steps.max(initial=0.0))
    return count


def _rms(roughness: Floats, level: Level) -> float:
    """In standard deviations of the noise; at least that of the noise itself."""
    return float(np.sqrt(np.mean(np.square(roughness / level.noise)) + 1.5))  # var(x - (a + b) / 2) = 1.5 sigma^2


def _roughness(one: Series, rarer: Bools) -> Floats:
    """(F, C) distance of each sample from the line through its neighbours of the same kind; 0 at ends."""
    out = np.zeros(one.value.shape)
    for kind in (rarer, ~rarer):
        own = np.flatnonzero(kind)
        if len(own) >= 3:
            inner, line = own[1:-1], between(one.time_s, one.value, kind)
            out[inner] = np.abs(one.value[inner] - line[inner])
    return out


def _splits(one: Series, level: Level) -> Iterator[Bools]:
    """Ways to part the samples in two, the plainest first; (F,) True for the rarer kind."""
    zero = (one.value == 0.0).all(axis=1)
    yield from _if_rare(zero)
    rows, of, count = np.unique(one.value, axis=0, return_inverse=True, return_counts=True)
    if len(rows) < len(of) and not level.step.all():
        yield from _if_rare(of.ravel() == int(np.argmax(count)))
    yield from _if_rare(np.arange(len(zero)) % 2 == 1)
    yield from _if_rare(_followed(one, level))


def _if_rare(split: Bools) -> Iterator[Bools]:
    share = float(np.mean(split))
    if 0 < share < 1:
        yield split if share <= 0.5 else ~split


def _followed(one: Series, level: Level) -> Bools:
    """Two tracks that begin at the largest jump, each sample given to the one that was nearer last."""
    scaled = one.value / level.noise
    jump = int(np.argmax(np.sum(np.diff(scaled, axis=0) ** 2, axis=1)))
    out = np.zeros(len(scaled), bool)
    out[jump + 1] = True
    for order in (range(jump + 2, len(scaled)), range(jump - 1, -1, -1)):
        last = [scaled[jump], scaled[jump + 1]]
        for i in order:
            nearer = int(np.argmin([np.sum((scaled[i] - value) ** 2) for value in last]))
            last[nearer], out[i] = scaled[i], bool(nearer)
    return out


def _regular(one: Series, rarer: Bools) -> bool:
    """Whether these samples come at a rate of their own: at intervals alike to a tenth."""
    apart = np.diff(one.time_s[rarer])
    return len(apart) >= 3 and float(np.std(apart)) < 0.1 * float(np.mean(apart))
