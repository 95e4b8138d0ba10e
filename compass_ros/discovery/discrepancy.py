"""The discrepancy: a Gaussian process over generalised forces and over signals, in time or over the state.

delta_s(t) ~ GP(0, size_s^2 exp(-(t - t')^2 / (2 MEMORY_S^2))): an acceleration in each direction s of what is tracked,
or an error of each signal s, another one in each episode; or an acceleration that is one function of place and velocity
in all of them (`kernels.py`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from compass_ros.discovery.evidence import Tangent, evidences, log_sum
from compass_ros.discovery.kernels import KERNELS, features_of, of_sizes, shared
from compass_ros.discovery.response import Response
from compass_ros.discovery.settings import FREE, KEPT, MEMORY_S, RHO, RHO_PRIOR
from compass_ros.types import Floats


def spread(response: Response, sizes: Floats) -> Floats | None:
    """(K S, q) square root of the covariance for (S,) sizes of the discrepancy; None where all are zero."""
    moments = response.kicks.moments_s
    kernel = np.exp(-0.5 * ((moments[:, None] - moments) / MEMORY_S) ** 2)
    variance, axes = np.linalg.eigh(kernel)
    kept = variance > KEPT * variance[-1]
    root = axes[:, kept] * np.sqrt(variance[kept])
    on = np.flatnonzero(sizes > 0)
    if not len(on):
        return None
    out = np.zeros((len(moments), len(sizes), len(on), root.shape[1]))
    for i, s in enumerate(on):
        out[:, s, i] = sizes[s] * root
    return out.reshape(len(moments) * len(sizes), -1)


@dataclass(frozen=True, eq=False)
class Free:
    """A model as it is, and with a discrepancy of any size."""

    alone: float
    """Log evidence of the model as it is."""
    log: float
    """Of the same with a free discrepancy, of forces or of signals."""
    in_time: float
    """Of the same with one of forces in time."""
    pushes: Floats
    """(E, K, S) posterior mean of that, of the most probable size."""


def free(response: Response) -> Free:
    """The model of a response with a discrepancy of any size: of forces or of signals in time, or of place, velocity or
    both."""
    alone, *found = evidences(response.tangent, [None, *(spread(response, size) for size in free_sizes(response))])
    logs = np.array([f.log for f in found])
    forces, signals = (log_sum(part) - np.log(len(FREE)) for part in (logs[: len(FREE)], logs[len(FREE) :]))
    state = log_sum(np.array([shared(response, kernel).log for kernel in KERNELS])) - float(np.log(len(KERNELS)))
    best, moments = int(np.argmax(logs[: len(FREE)])), len(response.kicks.moments_s)
    pushes = found[best].pushes.reshape(-1, moments, len(response.unit))
    log = log_sum(np.array([forces, signals, state])) - float(np.log(3))
    return Free(alone.log, log, float(forces), pushes)


def free_sizes(response: Response) -> list[Floats]:
    """(S,) sizes that a discrepancy without a law may have, equally probable: of forces first, then of signals."""
    kinds = [response.unit * response.forces, response.unit * (1 - response.forces)]
    return [size * kind for kind in kinds for size in FREE]


def with_law(response: Response, sizes: Floats) -> tuple[float, float]:
    """Log evidence of a model with laws, and the posterior mean of rho, the discrepancy's size as a share of theirs.

    In time, or over place, velocity or both, equally probable: a law whose form is wrong is wrong in the same way in
    every episode, and in what the law itself depends on.

    Args:
        sizes: (S,) rms of the laws along the fitted motion.
    """
    in_time = evidences(response.tangent, [spread(response, rho * sizes) for rho in RHO])
    logs = [np.array([f.log for f in in_time])]
    if np.any(sizes[: len(response.site_of)] > 0):
        for kernel in KERNELS:
            found = of_sizes(response, features_of(response, kernel, sizes), RHO[1:])
            logs.append(np.append(logs[0][:1], [f.log for f in found]))
    each = np.array(logs) + np.log(RHO_PRIOR) - np.log(len(logs))
    total = log_sum(each.ravel())
    return total, float(np.exp(each - total).sum(axis=0) @ np.array(RHO))


def to_first_order(response: Response, sizes: Floats, columns: Sequence[Floats]) -> list[float]:
    """Rise of the log evidence of a model with laws by one law more, for each (E, D, a) columns of such a one.

    `sizes`: as in `with_law`, of the laws that the model has; the discrepancy stays theirs.
    """
    spreads = [spread(response, rho * sizes) for rho in RHO]

    def of(tangent: Tangent) -> float:
        return log_sum(np.array([f.log for f in evidences(tangent, spreads)]) + np.log(RHO_PRIOR))

    alone = of(response.tangent)
    return [of(response.tangent.more(c, np.zeros(c.shape[2]))) - alone for c in columns]
