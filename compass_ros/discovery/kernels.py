"""On what a discrepancy depends: on place, on velocity, or on time alone.

A force that is a function of the state is the same whenever a body comes by again, in any episode: one function for all
of them, where a discrepancy in time is free in each. Functions of place f(q) and of velocity f(v) are Gaussian
processes with Matern's kernel of order 3/2 whose length is half the spread of what was visited, in random Fourier
features (Rahimi and Recht 2007; the spectral density of that kernel is Student's with 3 degrees of freedom). The
features' weights are parameters with a common prior, so evidence is that of any model.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from compass_ros.discovery.evidence import log_sum, widths
from compass_ros.discovery.response import Response
from compass_ros.discovery.settings import FREE
from compass_ros.types import Floats

Kernel = Literal["place", "velocity"]
FEATURES = 60
"""Of each direction; a budget: with 120 the evidence of the tests' fields is the same to two units of some hundreds."""
LENGTH, FREEDOM = 0.5, 3
"""Length of the kernel as a share of the spread of what was visited; degrees of freedom of its spectrum, 2 x 3/2."""


@dataclass(frozen=True, eq=False)
class Shared:
    """A discrepancy that is a function of the state."""

    kernel: Kernel
    log: float
    """Log evidence, its size marginalised."""
    pushes: Floats
    """(E, K, S) posterior mean along the recorded motions: accelerations, zero of signals."""


def shared(response: Response, kernel: Kernel) -> Shared:
    """The model of a response with such a discrepancy on all that is pushed."""
    features = _features(response, kernel)
    tangent = response.tangent
    p, count = tangent.parameters.shape[2], features.shape[3]
    columns = tangent.pushes @ features.reshape(len(features), -1, count)
    wider = replace(tangent.more(columns, np.zeros(count)), pushes=tangent.pushes[:, :, :0])
    stds = [np.concatenate([np.ones(p), np.full(count, size)]) for size in FREE]
    found = widths(wider, stds)
    best = max(found, key=lambda f: f.log)
    log = log_sum(np.array([f.log for f in found])) - float(np.log(len(found)))
    return Shared(kernel, log, features @ best.parameters[p:])


def _features(response: Response, kernel: Kernel) -> Floats:
    """(E, K, S, n) accelerations by each weight, of unit variance in the response's units."""
    rng = np.random.default_rng(0)
    shape, count = response.kicks.states.shape[:2], len(response.site_of)
    out = np.zeros((*shape, len(response.unit), count * FEATURES))
    for s, n in enumerate(response.site_of):
        at = response.along(int(n))[0 if kernel == "place" else 1]
        spread = np.maximum(at.reshape(-1, at.shape[2]).std(axis=0), 1e-300)
        normal = rng.standard_normal((at.shape[2], FEATURES))
        frequency = normal / np.sqrt(rng.chisquare(FREEDOM, FEATURES) / FREEDOM) / LENGTH
        wave = np.cos(at / spread @ frequency + rng.uniform(0, 2 * np.pi, FEATURES))
        out[:, :, s, s * FEATURES : (s + 1) * FEATURES] = response.unit[s] * np.sqrt(2 / FEATURES) * wave
    return out
