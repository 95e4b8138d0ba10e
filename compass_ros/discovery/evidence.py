"""Log marginal likelihood of a model: its parameters by Laplace's approximation, a discrepancy integrated out.

With r the residual at the fit, J its derivatives by the p parameters x (each in standard deviations of its prior), L
those by an episode's own numbers l (its launch, or the first state of a window) and R those by pushes d (generalised
forces, hats in time), all in sigma of the noise and linear about the fit,

    -2 log Z = |r + J x + L l + R d|^2 / kappa + |x - a|^2 + |l - b|^2 + d' K^-1 d   integrated over x, l and d,

where kappa is the correlation time of the noise in frames, a and b are where the priors have their means, and K is the
covariance of the discrepancy. Source: MacKay 1992 (evidence); Kennedy and O'Hagan 2001 (discrepancy); the elimination
of an episode's own numbers is the Schur complement.

A robust loss rho is bounded from above by w r^2 + c, with weights w and constant c taken at any residuals (rho is
concave in r^2): for each such choice the formula gives a lower bound of the log evidence, and the largest is taken.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from compass_ros.calibration.cost import robust_loss, robust_weight
from compass_ros.types import Floats, Ints

PIECES = 6
"""Into which an episode is cut for its products: a budget. Nine windows of 530 frames of seven signals, 50 moments:
1.2 s of processor time in one piece, 0.41 in 4, 0.36 in 6, 0.46 in 10, 0.55 in 24."""
ROUNDING = 1e-12
"""Share of a column that sums over ten thousand rows in double precision leave open."""


@dataclass(frozen=True, eq=False)
class Tangent:
    """A fitted model, linear about its fit. E episodes, D residuals of each; 0 where nothing was measured."""

    residual: Floats
    """(E, D) [sigma]"""
    parameters: Floats
    """(E, D, p) by each parameter, in standard deviations of its prior."""
    own: Floats
    """(E, D, l) by the episode's own numbers, in theirs."""
    pushes: Floats
    """(E, D, H) by pushes."""
    away: Floats
    """(p,) from the fit to the prior's mean, in its standard deviations."""
    own_away: Floats
    """(E, l) the same of the episode's own numbers."""
    robust: float
    """Scale of the robust loss [sigma]."""
    correlation_time: float
    """Frames that one independent measurement is worth."""

    def more(self, columns: Floats, away: Floats) -> Tangent:
        """The same with (E, D, n) more parameters whose priors have their means (n,) away."""
        return Tangent(
            self.residual,
            np.concatenate([self.parameters, columns], axis=2),
            self.own,
            self.pushes,
            np.concatenate([self.away, away]),
            self.own_away,
            self.robust,
            self.correlation_time,
        )

    @cached_property
    def normal(self) -> Normal:
        """Its normal equations with the weights of the residual itself."""
        return Normal.of(self, self.residual)


@dataclass(frozen=True, eq=False)
class Normal:
    """Products of all columns, weighted, of each episode: what every size of a discrepancy is judged from."""

    gram: Floats
    """(E, n, n) of parameters, own numbers, pushes and the residual, in this order, over kappa."""
    constant: float
    """What the bound of the robust loss adds, over kappa."""

    @staticmethod
    def of(tangent: Tangent, residual: Floats) -> Normal:
        """With weights taken at (E, D) residuals."""
        weight = robust_weight(residual, tangent.robust)
        gram = _gram((tangent.parameters, tangent.own, tangent.pushes, tangent.residual[:, :, None]), np.sqrt(weight))
        constant = float(np.sum(robust_loss(residual, tangent.robust) - weight * residual**2))
        return Normal(gram / tangent.correlation_time, constant / tangent.correlation_time)


def _gram(parts: Sequence[Floats], root: Floats) -> Floats:
    """(E, n, n) products of all columns of (E, D, n_i) parts, weighted by the squares of (E, D) roots.

    A push does nothing before its moment, and an error of a signal only near its own: of each piece of an episode only
    the columns that are not zero there are multiplied.
    """
    size = sum(part.shape[2] for part in parts)
    out = np.zeros((len(root), size, size))
    for e, weights in enumerate(root):
        for rows in np.array_split(np.arange(len(weights)), PIECES):
            columns = np.concatenate([part[e, rows] for part in parts], axis=1)
            on = np.flatnonzero(columns.any(axis=0))
            columns = columns[:, on] * weights[rows, None]
            out[e][np.ix_(on, on)] += columns.T @ columns
    return out


def block(gram: Floats, rows: Ints, columns: Ints) -> Floats:
    """(E, r, c) of (E, n, n) products, in one piece: a stack of matrices that is not in C's order is multiplied forty
    times as slowly."""
    return np.take(np.take(gram, rows, axis=1), columns, axis=2)


def acting(root: Floats) -> Ints:
    """(a,) pushes that a (..., H, q) discrepancy has."""
    return np.flatnonzero(root.any(axis=tuple(i for i in range(root.ndim) if i != root.ndim - 2)))


def cholesky(matrix: Floats) -> Floats:
    """Cholesky factor of (..., n, n) matrices whose rows may be of very different size.

    Columns that are alike to ROUNDING hold each other as firmly as that.
    """
    scale = np.sqrt(np.diagonal(matrix, axis1=-2, axis2=-1))
    unit = matrix / scale[..., :, None] / scale[..., None, :]
    return np.asarray(np.linalg.cholesky(unit + ROUNDING * np.eye(unit.shape[-1])) * scale[..., :, None])


def log_mean(logs: Sequence[Floats] | Sequence[float] | Floats) -> Floats:
    """(m,) logarithms of the means of exponentials of (n, m)."""
    return np.asarray(np.logaddexp.reduce(logs, axis=0) - np.log(len(logs)))


def log_sum(logs: Floats) -> float:
    """Logarithm of a sum of exponentials."""
    return float(np.logaddexp.reduce(logs))
