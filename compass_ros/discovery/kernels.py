"""On what a discrepancy depends: on place, on velocity, or on time alone.

A force that is a function of the state is the same whenever a body comes by again, in any episode: one function for all
of them, where a discrepancy in time is free in each. Functions of place f(q) and of velocity f(v) are Gaussian
processes with Matern's kernel of order 3/2 whose length is a share of the spread of what was visited, in random Fourier
features (Rahimi and Recht 2007; the spectral density of that kernel is Student's with 3 degrees of freedom). The
features' weights are parameters with a common prior, so evidence is that of any model.
"""

from __future__ import annotations

from typing import Literal

import numpy as np

from compass_ros.discovery.response import Response
from compass_ros.discovery.sized import Spread
from compass_ros.types import Floats

Kernel = Literal["place", "velocity", "state"]
"""`state`: of both together."""
KERNELS: tuple[Kernel, ...] = ("place", "velocity", "state")
FEATURES = 60
"""Of each direction; a budget. Of a local field on pucks (3 shots) the log evidence, some 3,400 over none, is 4 (place,
velocity) to 6 (state) higher with 120, and 5 to 17 lower with 30: all alike, so what is compared moves by 2 or so."""
LENGTHS, FREEDOM = (0.5, 0.2), 3
"""Lengths of the kernel, equally probable, as shares of the spread of what was visited: a form that is smooth over half
of that, or a place in it. Of a field of 0.2 m on pucks forces of place have log evidences of -3162 with a half, -2141
with a fifth and -2207 with a tenth. Degrees of freedom of its spectrum, 2 x 3/2."""


def shared(response: Response, kernel: Kernel, sizes: Floats) -> list[Spread]:
    """Such discrepancies of a root mean square (S,) in each direction; none where all are zero."""
    if not np.any(sizes[: len(response.site_of)] > 0):
        return []
    each = (features_of(response, kernel, sizes, length) for length in LENGTHS)
    return [Spread(of.reshape(len(of), -1, of.shape[3]), shared=True) for of in each]


def features_of(response: Response, kernel: Kernel, sizes: Floats, length: float) -> Floats:
    """(E, K, S, n) accelerations by each weight, of a root mean square (S,) in each direction; none where zero."""
    rng = np.random.default_rng(0)
    shape = response.kicks.states.shape[:2]
    on = [s for s in range(len(response.site_of)) if sizes[s] > 0]
    out = np.zeros((*shape, len(response.unit), len(on) * FEATURES))
    for i, s in enumerate(on):
        place, rate = (of / _spread(of) for of in response.along(int(response.site_of[s])))
        at = {"place": place, "velocity": rate, "state": np.concatenate([place, rate], axis=2)}[kernel]
        normal = rng.standard_normal((at.shape[2], FEATURES))
        frequency = normal / np.sqrt(rng.chisquare(FREEDOM, FEATURES) / FREEDOM) / length
        wave = np.cos(at @ frequency + rng.uniform(0, 2 * np.pi, FEATURES))
        out[:, :, s, i * FEATURES : (i + 1) * FEATURES] = sizes[s] * np.sqrt(2 / FEATURES) * wave
    return out


def _spread(of: Floats) -> Floats:
    """(a,) standard deviation of (E, K, a) numbers, nowhere zero."""
    return np.asarray(np.maximum(of.reshape(-1, of.shape[2]).std(axis=0), 1e-300))
