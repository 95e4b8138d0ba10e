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


@dataclass(frozen=True, eq=False)
class Solved:
    """Log evidence and where its maximum lies."""

    log: float
    parameters: Floats
    """(p,) change of the parameters, in standard deviations of the prior."""
    own: Floats
    """(E, l)"""
    pushes: Floats
    """(E, H) posterior mean of the discrepancy."""
    determinant: float
    """What the log evidence has lost by the widths of all posteriors beside their priors."""


def solve(tangent: Tangent, normal: Normal, spread: Floats | None) -> Solved:
    """Log evidence and maximum with a discrepancy `spread` z, z standard normal: (H, q), or (E, H, q) where episodes
    differ; None: without."""
    gram, p, own_numbers = normal.gram, tangent.parameters.shape[2], tangent.own.shape[2]
    mixed = np.zeros((tangent.pushes.shape[2], 0)) if spread is None else spread
    on = acting(mixed)
    mixed = np.broadcast_to(mixed[..., on, :], (len(gram), len(on), mixed.shape[-1]))
    turned = mixed.transpose(0, 2, 1)
    own, hats, q = slice(p, p + own_numbers), p + own_numbers + on, mixed.shape[2]
    inner = np.empty((len(gram), own_numbers + q, own_numbers + q))
    inner[:, :own_numbers, :own_numbers] = gram[:, own, own]
    inner[:, :own_numbers, own_numbers:] = block(gram, np.r_[own], hats) @ mixed
    inner[:, own_numbers:, :own_numbers] = inner[:, :own_numbers, own_numbers:].transpose(0, 2, 1)
    inner[:, own_numbers:, own_numbers:] = turned @ block(gram, hats, hats) @ mixed
    factor = cholesky(inner + np.eye(own_numbers + q))
    half = np.linalg.solve(factor, np.concatenate([gram[:, own, :p], turned @ block(gram, hats, np.arange(p))], axis=1))
    taken, whole = np.einsum("eij,eik->jk", half, half), gram[:, :p, :p].sum(axis=0)
    outer = cholesky(whole - taken + np.diag(1 + ROUNDING * np.diagonal(whole)))
    determinant = sum(float(np.log(np.diagonal(f, axis1=-2, axis2=-1)).sum()) for f in (factor, outer))
    last = gram[:, :-1, -1]
    pulled = np.concatenate([last[:, own] - tangent.own_away, (turned @ last[:, hats, None])[..., 0]], axis=1)
    back = np.linalg.solve(factor, pulled[..., None])[..., 0]
    pull = last[:, :p].sum(axis=0) - np.einsum("eip,ei->p", half, back) - tangent.away
    step = -np.linalg.solve(outer.T, np.linalg.solve(outer, pull))
    square = gram[:, -1, -1].sum() + np.sum(tangent.own_away**2) + np.sum(tangent.away**2)
    square += pull @ step - np.sum(back**2)
    within = -np.linalg.solve(factor.transpose(0, 2, 1), (half @ step + back)[..., None])[..., 0]
    push = np.zeros((len(gram), tangent.pushes.shape[2]))
    push[:, on] = (mixed @ within[:, own_numbers:, None])[..., 0]
    log = float(-0.5 * (square + normal.constant) - determinant)
    return Solved(log, step, within[:, :own_numbers], push, determinant)


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


def residual_of(tangent: Tangent, solved: Solved) -> Floats:
    """(E, D) what is left where everything is at its maximum."""
    left = tangent.residual + tangent.parameters @ solved.parameters
    left += (tangent.own @ solved.own[:, :, None])[..., 0] + (tangent.pushes @ solved.pushes[:, :, None])[..., 0]
    return np.asarray(left)


def log_mean(logs: Sequence[Floats] | Sequence[float] | Floats) -> Floats:
    """(m,) logarithms of the means of exponentials of (n, m)."""
    return np.asarray(np.logaddexp.reduce(logs, axis=0) - np.log(len(logs)))


def log_sum(logs: Floats) -> float:
    """Logarithm of a sum of exponentials."""
    return float(np.logaddexp.reduce(logs))
