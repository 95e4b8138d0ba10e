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


def spread(response: Response, sizes: Floats, memory_s: float = MEMORY_S[0], moving: bool = False) -> Floats | None:
    """Square root of the covariance for (S,) sizes of the discrepancy, (K S, q) or (E, K S, q); None where all are zero.

    `moving`: only along the way that a thing moves, as friction does; else in all directions.
    """
    moments, on = response.kicks.moments_s, np.flatnonzero(sizes > 0)
    if not len(on):
        return None
    kernel = np.exp(-0.5 * ((moments[:, None] - moments) / memory_s) ** 2)
    variance, axes = np.linalg.eigh(kernel)
    kept = variance > KEPT * variance[-1]
    root = axes[:, kept] * np.sqrt(variance[kept])
    if moving:
        ways = sizes[:, None] * response.ways  # (E, K, S, n)
        out = ways[..., None] * root[:, None, None, :]
        return np.asarray(out.reshape(len(out), out.shape[1] * out.shape[2], -1))
    out = np.zeros((len(moments), len(sizes), len(on), root.shape[1]))
    for i, s in enumerate(on):
        out[:, s, i] = sizes[s] * root
    return out.reshape(len(moments) * len(sizes), -1)


def spreads(response: Response, sizes: Floats) -> list[Floats | None]:
    """Of each correlation length; of forces in all directions and along the motion."""
    forced = bool(np.any(sizes[: len(response.site_of)] > 0))
    kinds = (False, True) if forced else (False,)
    return [spread(response, sizes, memory_s, moving) for moving in kinds for memory_s in MEMORY_S]


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
    """(E, K, S) posterior mean of that."""


def free(response: Response) -> Free:
    """The model of a response with a discrepancy of any size: of forces or of signals in time, or of place, velocity or
    both."""
    forced, read = free_spreads(response)
    alone, *found = evidences(response.tangent, [None, *forced, *read])
    logs = np.array([f.log for f in found])
    forces, signals = (log_sum(part) - np.log(len(part)) for part in (logs[: len(forced)], logs[len(forced) :]))
    state = log_sum(np.array([shared(response, kernel).log for kernel in KERNELS])) - float(np.log(len(KERNELS)))
    log = log_sum(np.array([forces, signals, state])) - float(np.log(3))
    shares = np.exp(logs[: len(forced)] - log_sum(logs[: len(forced)]))
    pushes = np.tensordot(shares, [f.pushes for f in found[: len(forced)]], axes=1)
    shape = (-1, len(response.kicks.moments_s), len(response.unit))
    return Free(alone.log, log, float(forces), pushes.reshape(shape))


def free_spreads(response: Response) -> tuple[list[Floats | None], list[Floats | None]]:
    """Discrepancies without a law of all sizes and lengths, equally probable: of forces, and of signals."""
    forces, signals = response.unit * response.forces, response.unit * (1 - response.forces)
    forced, read = ([one for size in FREE for one in spreads(response, size * of)] for of in (forces, signals))
    return forced, read


def with_law(response: Response, sizes: Floats) -> tuple[float, float]:
    """Log evidence of a model with laws, and the posterior mean of rho, the discrepancy's size as a share of theirs.

    In time, or over place, velocity or both, equally probable: a law whose form is wrong is wrong in the same way in
    every episode, and in what the law itself depends on.

    Args:
        sizes: (S,) rms of the laws along the fitted motion.
    """
    kinds = [spreads(response, rho * sizes) for rho in RHO[1:]]
    alone, *found = evidences(response.tangent, [None, *(one for each in kinds for one in each)])
    of_kinds = np.array([f.log for f in found]).reshape(len(kinds), -1)
    in_time = np.logaddexp.reduce(of_kinds, axis=1) - np.log(of_kinds.shape[1])
    logs = [np.append(alone.log, in_time)]
    if np.any(sizes[: len(response.site_of)] > 0):
        for kernel in KERNELS:
            shared_by = of_sizes(response, features_of(response, kernel, sizes), RHO[1:])
            logs.append(np.append(alone.log, [f.log for f in shared_by]))
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
