"""On what a discrepancy depends: on place, on velocity, or on time alone.

A force that is a function of the state is the same whenever a body comes by again, in any episode: one function for all
of them, where a discrepancy in time is free in each. Functions of place f(q) and of velocity f(v) are Gaussian
processes with Matern's kernel of order 3/2 whose length is half the spread of what was visited, in random Fourier
features (Rahimi and Recht 2007; the spectral density of that kernel is Student's with 3 degrees of freedom). The
features' weights are parameters with a common prior, so evidence is that of any model.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from compass_ros.discovery.evidence import Solved, log_sum, widths
from compass_ros.discovery.response import Response
from compass_ros.discovery.settings import FREE
from compass_ros.types import Floats

Kernel = Literal["place", "velocity", "state"]
"""`state`: of both together."""
KERNELS: tuple[Kernel, ...] = ("place", "velocity", "state")
FEATURES = 60
"""Of each direction; a budget. Of a local field on pucks (3 shots) the log evidence, some 3,400 over none, is 4 (place,
velocity) to 6 (state) higher with 120, and 5 to 17 lower with 30: all alike, so what is compared moves by 2 or so."""
LENGTH, FREEDOM = 0.5, 3
"""Length of the kernel as a share of the spread of what was visited: a prior that a form is smooth over half of that;
degrees of freedom of its spectrum, 2 x 3/2."""


@dataclass(frozen=True, eq=False)
class Shared:
    """A discrepancy that is a function of the state."""

    kernel: Kernel
    log: float
    """Log evidence, its size marginalised."""
    pushes: Floats
    """(E, K, S) posterior mean along the recorded motions: accelerations, zero of signals."""


def shared(response: Response, kernel: Kernel) -> Shared:
    """The model of a response with such a discrepancy of any size on all that is pushed."""
    features = features_of(response, kernel, response.unit)
    found = of_sizes(response, features, FREE)
    best = max(found, key=lambda f: f.log)
    log = log_sum(np.array([f.log for f in found])) - float(np.log(len(found)))
    return Shared(kernel, log, features @ best.parameters[-features.shape[3] :])


def of_sizes(response: Response, features: Floats, sizes: Sequence[float]) -> list[Solved]:
    """The model of a response with a discrepancy in (E, K, S, n) features, for several sizes of their weights."""
    tangent = response.tangent
    p, count = tangent.parameters.shape[2], features.shape[3]
    columns = tangent.pushes @ features.reshape(len(features), -1, count)
    wider = replace(tangent.more(columns, np.zeros(count)), pushes=tangent.pushes[:, :, :0])
    return widths(wider, [np.concatenate([np.ones(p), np.full(count, size)]) for size in sizes])


def features_of(response: Response, kernel: Kernel, sizes: Floats) -> Floats:
    """(E, K, S, n) accelerations by each weight, of a root mean square (S,) in each direction; none where zero."""
    rng = np.random.default_rng(0)
    shape = response.kicks.states.shape[:2]
    on = [s for s in range(len(response.site_of)) if sizes[s] > 0]
    out = np.zeros((*shape, len(response.unit), len(on) * FEATURES))
    for i, s in enumerate(on):
        place, rate = (of / _spread(of) for of in response.along(int(response.site_of[s])))
        at = {"place": place, "velocity": rate, "state": np.concatenate([place, rate], axis=2)}[kernel]
        normal = rng.standard_normal((at.shape[2], FEATURES))
        frequency = normal / np.sqrt(rng.chisquare(FREEDOM, FEATURES) / FREEDOM) / LENGTH
        wave = np.cos(at @ frequency + rng.uniform(0, 2 * np.pi, FEATURES))
        out[:, :, s, i * FEATURES : (i + 1) * FEATURES] = sizes[s] * np.sqrt(2 / FEATURES) * wave
    return out


def _spread(of: Floats) -> Floats:
    """(a,) standard deviation of (E, K, a) numbers, nowhere zero."""
    return np.asarray(np.maximum(of.reshape(-1, of.shape[2]).std(axis=0), 1e-300))
