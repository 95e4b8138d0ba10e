"""Log evidences of discrepancies of many sizes: their products are diagonalised once, for any number of sizes.

With each episode's own numbers integrated out, a discrepancy M z, z ~ N(0, s^2), has the products M' G M = V w V'. That
of size s has a determinant of prod(1 + s^2 w), and takes s^2 / (1 + s^2 w) of the products along each axis of V.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq

from compass_ros.discovery.evidence import (
    ROUNDING,
    Normal,
    Tangent,
    acting,
    block,
    cholesky,
    log_mean,
)
from compass_ros.discovery.settings import A_DECADE, SHOWN
from compass_ros.types import Floats, Ints

ROUNDS = 2
"""How often weights are taken anew, as long as the bound rises by RISE: a tenth of what odds are read to."""
RISE = 0.1
FAR = 100.0
"""Log evidence below the best one from which no weights are taken anew: a budget. What is so far below decides nothing,
and its bound holds: at a fit of `kinova3` (1040001) the same evidence to all digits, in 6.2 s and not 14.3."""
UNTOLD = 64 * np.finfo(float).eps
"""Share of the largest eigenvalue below which double precision tells none, nor what goes along its axis: its rounding
grows as the root of the columns (Higham 2002), of which there are less than 64^2. About a fit
whose motion is unstable a push grows to 1e15 sigma (`two_joint_arm` 1070003), and axes of noise took more of the
residual than there is."""
_NOTHING = 1e-12
"""Size of a discrepancy, as a share of all that is at work, that no recording shows."""


@dataclass(frozen=True, eq=False)
class Spread:
    """A discrepancy `root` z, z standard normal, of any size."""

    root: Floats
    """(H, q), or (E, H, q) where episodes differ."""
    shared: bool = False
    """One z for all episodes; else another one in each."""


@dataclass(frozen=True, eq=False)
class Sized:
    """A discrepancy in several sizes that are equally probable."""

    sizes: Floats
    """(S,)"""
    logs: Floats
    """(S,) log evidences."""

    @property
    def log(self) -> float:
        return float(log_mean(self.logs))


@dataclass(frozen=True, eq=False)
class Maximum:
    """Where everything is at its maximum."""

    parameters: Floats
    """(p,) change of the parameters, in standard deviations of the prior."""
    pushes: Floats
    """(E, H) posterior mean of the discrepancy."""
    residual: Floats
    """(E, D) what is left."""


@dataclass(frozen=True, eq=False)
class Axes:
    """A discrepancy along the axes of its products, of all episodes together where it is shared."""

    values: Floats
    """(E, q) eigenvalues."""
    across: Floats
    """(E, q, p + m) products with parameters and residuals."""
    directions: Floats
    """(E, q, q) of what is drawn, each axis a column."""

    def shown(self) -> Floats:
        """(S,) sizes from the least that recordings would show to be absent, A_DECADE of each up to 1.

        Where there is none, its log evidence is less by sum(log(1 + s^2 w) - s^2 w / (1 + s^2 w)) / 2 in the mean.
        """

        def against(log_size: float) -> float:
            x = np.exp(2 * log_size) * self.values
            return 0.5 * float(np.sum(np.log1p(x) - x / (1 + x))) - SHOWN

        first = np.log(_NOTHING)
        if against(0.0) <= 0 or against(first) >= 0:
            return np.ones(1)
        least = float(brentq(against, first, 0.0))
        return np.geomspace(np.exp(least), 1.0, int(np.ceil(-least / np.log(10) * A_DECADE)) + 1)


class Reduced:
    """A tangent with each episode's own numbers integrated out, for any residuals."""

    def __init__(
        self, tangent: Tangent, normal: Normal, last: Floats | None = None, squares: Floats | None = None
    ) -> None:
        """`last`, `squares`: (E, n, m) products of all columns with m residuals and (m,) their squares, weighted as
        `normal`; None: the tangent's own residual."""
        gram = normal.gram
        if last is None or squares is None:
            last, squares = gram[:, :-1, -1:], gram[:, -1, -1].sum(keepdims=True)
        self._p, numbers = tangent.parameters.shape[2], tangent.own.shape[2]
        self._first = self._p + tangent.pushes.shape[2]
        own = slice(self._p, self._p + numbers)
        rest = np.delete(np.arange(gram.shape[1] - 1), own)
        factor = self._factor = cholesky(gram[:, own, own] + np.eye(numbers))
        with_own = last[:, own] - tangent.own_away[:, :, None]
        self._tangent, self._with_own, self._own_pull = tangent, gram[:, own][:, :, rest], with_own[:, :, 0]
        half = np.linalg.solve(factor, np.concatenate([self._with_own, with_own], axis=2))
        self._left = np.concatenate([gram[:, rest][:, :, rest], last[:, rest]], axis=2)
        self._left -= half[:, :, : len(rest)].transpose(0, 2, 1) @ half
        squares = squares + np.sum(tangent.own_away**2) + np.sum(tangent.away**2) + normal.constant
        self._squares = squares - np.sum(half[:, :, len(rest) :] ** 2, axis=(0, 1))
        self._determinant = float(np.log(np.diagonal(factor, axis1=1, axis2=2)).sum())
        self._away = tangent.away
        self._rounding = 1 + ROUNDING * np.diagonal(gram[:, : self._p, : self._p].sum(axis=0))
        self._known: dict[bytes, tuple[Floats, Floats]] = {}

    def _products(self, on: Ints) -> tuple[Floats, Floats]:
        """Of some pushes: (E, a, a) among each other, (E, a, p + m) with parameters and residuals; many discrepancies
        have the same ones."""
        key, p = on.tobytes(), self._p
        if key not in self._known:
            columns = np.r_[:p, self._first : self._left.shape[2]]
            self._known[key] = block(self._left, p + on, p + on), block(self._left, p + on, columns)
        return self._known[key]

    def axes(self, spread: Spread | None) -> Axes:
        p, first = self._p, self._first
        if spread is None:
            return Axes(np.zeros((1, 0)), np.zeros((1, 0, p + self._left.shape[2] - first)), np.zeros((1, 0, 0)))
        root, on = spread.root, acting(spread.root)
        turned = np.swapaxes(root[..., on, :], -2, -1)
        among, beside = self._products(on)
        products = turned @ among @ np.swapaxes(turned, -2, -1)
        across = turned @ beside
        if spread.shared:
            products, across = products.sum(axis=0, keepdims=True), across.sum(axis=0, keepdims=True)
        values, axes = np.linalg.eigh(products)
        known = values > UNTOLD * values[:, -1:]
        across = np.where(known[:, :, None], np.swapaxes(axes, -2, -1) @ across, 0.0)
        return Axes(np.where(known, values, 0.0), across, axes)

    def logs(self, axes: Axes, sizes: Sequence[float] | Floats) -> Floats:
        """(S, m) log evidences."""
        p, out = self._p, []
        for size in sizes:
            shrunk, outer, pulled = self._of_a_size(axes, size)
            square = self._squares - np.einsum("eqm,eq->m", axes.across[:, :, p:] ** 2, shrunk)
            wide = self._determinant + 0.5 * np.log1p(size**2 * axes.values).sum() + np.log(np.diagonal(outer)).sum()
            out.append(-0.5 * (square - np.sum(pulled**2, axis=0)) - wide)
        return np.array(out)

    def _of_a_size(self, axes: Axes, size: float) -> tuple[Floats, Floats, Floats]:
        """(E, q) how much a discrepancy takes along its axes, and beside it (p, p) the root of the parameters'
        precision and (p, m) their pull in its units."""
        p, first = self._p, self._first
        fixed = np.concatenate([self._left[:, :p, :p], self._left[:, :p, first:]], axis=2).sum(axis=0)
        fixed[:, p:] -= self._away[:, None]
        shrunk = size**2 / (1 + size**2 * axes.values)
        both = fixed - np.tensordot(axes.across[:, :, :p], axes.across * shrunk[:, :, None], axes=([0, 1], [0, 1]))
        outer = cholesky(both[:, :p] + np.diag(self._rounding))
        return shrunk, outer, np.linalg.solve(outer, both[:, p:])

    def maximum(self, spread: Spread | None, axes: Axes, size: float) -> Maximum:
        """Of the tangent's own residual, beside a discrepancy with its axes."""
        tangent, p = self._tangent, self._p
        shrunk, outer, pulled = self._of_a_size(axes, size)
        step = -np.linalg.solve(outer.T, pulled[:, 0])
        along = -shrunk * (axes.across[:, :, p] + axes.across[:, :, :p] @ step)
        pushes = np.zeros((len(tangent.residual), tangent.pushes.shape[2]))
        if spread is not None:
            pushes += (spread.root @ (axes.directions @ along[:, :, None]))[..., 0]
        moved = tangent.residual + tangent.parameters @ step + (tangent.pushes @ pushes[:, :, None])[..., 0]
        pull = (
            self._own_pull + self._with_own[:, :, :p] @ step + (self._with_own[:, :, p:] @ pushes[:, :, None])[..., 0]
        )
        half = np.linalg.solve(self._factor, pull[:, :, None])
        own = -np.linalg.solve(self._factor.transpose(0, 2, 1), half)
        return Maximum(step, pushes, moved + (tangent.own @ own)[..., 0])


def sized(tangent: Tangent, spreads: Sequence[Spread | None], sizes: Sequence[float] | None = None) -> list[Sized]:
    """Evidences of discrepancies, with the weights of the residuals that the best of them leaves; None: without one.

    `sizes`: None for those that recordings would show to be absent (`Axes.shown`).
    """
    found: dict[int, Sized] = {}
    normal, ahead = tangent.normal, list(range(len(spreads)))
    for _ in range(1 + ROUNDS):
        reduced = Reduced(tangent, normal)
        before = max((float(one.logs.max()) for one in found.values()), default=-np.inf)
        highest, best, of_best = -np.inf, 0, reduced.axes(None)
        for i in ahead:
            axes = reduced.axes(spreads[i])
            if i not in found:
                asked = np.ones(1) if spreads[i] is None else axes.shown() if sizes is None else np.array(sizes)
                found[i] = Sized(asked, np.full(len(asked), -np.inf))
            found[i] = replace(found[i], logs=np.maximum(found[i].logs, reduced.logs(axes, found[i].sizes)[:, 0]))
            if found[i].logs.max() > highest:
                highest, best, of_best = float(found[i].logs.max()), i, axes
        if highest < before + RISE:
            break
        size = float(found[best].sizes[np.argmax(found[best].logs)])
        normal = Normal.of(tangent, reduced.maximum(spreads[best], of_best, size).residual)
        ahead = [i for i in ahead if found[i].logs.max() > highest - FAR]
    return [found[i] for i in range(len(spreads))]


def mean(tangent: Tangent, spread: Spread, size: float) -> Floats:
    """(E, H) posterior mean of a discrepancy of a size."""
    reduced = Reduced(tangent, tangent.normal)
    return reduced.maximum(spread, reduced.axes(spread), size).pushes


def log_alone(tangent: Tangent) -> float:
    """Log evidence without a discrepancy, with the weights of the residual itself."""
    reduced = Reduced(tangent, tangent.normal)
    return float(reduced.logs(reduced.axes(None), np.ones(1))[0, 0])


def best_parameters(tangent: Tangent) -> Floats:
    """(p,) change of the parameters that fits best without a discrepancy, in standard deviations of the prior."""
    reduced = Reduced(tangent, tangent.normal)
    return reduced.maximum(None, reduced.axes(None), 1.0).parameters
