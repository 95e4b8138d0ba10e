"""What a law could explain, to first order about a fit: its columns beside those of the parameters, its best shapes.

A law of forces with accelerations a(shape) along the fitted motion changes the residual by R a, with R the responses
to pushes: so its shapes (a centre, a radius, a frequency) are searched without a rollout. Any other law is rolled out.
With the columns T of its amplitudes, what is left after parameters, own numbers and amplitudes have taken their best
values falls by 1/2 g' S^-1 g, where S = T'T and g = T'r after the projection off all the others.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.optimize import lsq_linear

from compass_ros.calibration.cost import robust_weight
from compass_ros.discovery.candidates import Candidate
from compass_ros.discovery.evidence import ROUNDING
from compass_ros.discovery.response import Response
from compass_ros.discovery.shapes import best_shapes, shape_grid
from compass_ros.discovery.sized import UNTOLD
from compass_ros.types import Floats, Ints

SIGMAS = 5.0
"""Standard deviations from which something is seen."""
STARTS, EVALUATIONS = 4, 40
"""Places from which the shapes of a law are searched, and gains that each search asks for each shape: a budget, for at
most two shapes on a joint."""
WIDTH = 20.0
"""Standard deviation of an amplitude's prior, in its modest sizes: as in `joint.widened`, and a fifth of the largest
(`sizes.MODEST`, `LARGEST`)."""
_FELT, _TWICE = 5.0, 3.0
"""Movement of all recordings [sigma] from which a step says what a law does; growth of it by a step twice as long up to
which the law counts as proportional to its size."""


@dataclass(frozen=True, eq=False)
class Ranked:
    """A law at its best first-order numbers."""

    candidate: Candidate
    numbers: Floats
    """(q,)"""
    columns: Floats
    """(E, D, a) change of the residual per standard deviation of each amplitude's prior."""
    gain: float
    """Fall of half the squared residual."""
    seen: bool
    """Whether these recordings would show the largest that is physical by SIGMAS."""


BOTH = ((0, 1), (0, 1))
"""Sums over episodes and rows."""
Products = tuple[Floats, Floats, Floats]
"""Of some pushes: among each other, with the parameters, with the residual; own numbers taken out."""


class FirstOrder:
    """All laws about one response.

    An episode whose motion is unstable says nothing to first order, and the squares of its pushes would leave no digits
    of the others': it is left out where ROUNDING of them is more than all of another one's, in the median.
    """

    def __init__(self, response: Response) -> None:
        self.response = response
        tangent = response.tangent
        largest = np.abs(tangent.pushes).max(axis=(1, 2), initial=0.0)
        told = ROUNDING * largest**2 <= np.median(largest) ** 2
        gram = tangent.normal.gram * told[:, None, None]
        self.unsaid = 0.5 * float(tangent.normal.gram[~told, -1, -1].sum())
        """What the episodes leave of which it says nothing: half their squared residual, as gains are counted."""
        p, numbers = tangent.parameters.shape[2], tangent.own.shape[2]
        own = slice(p, p + numbers)
        inner = gram[:, own, own] + np.eye(numbers)
        pulled = gram[:, own].copy()
        pulled[..., -1] -= tangent.own_away
        reduced = gram - gram[:, :, own] @ np.linalg.solve(inner, pulled)
        self._keep = np.r_[0:p, p + numbers : gram.shape[1]]
        self._gram = reduced[:, self._keep][:, :, self._keep]
        self._parameters = p
        whole = self._gram.sum(axis=0)
        self._inverse = np.linalg.inv(whole[:p, :p] + np.eye(p))
        self._pull = whole[:p, -1] - tangent.away
        self._weight = robust_weight(tangent.residual, tangent.robust) / tangent.correlation_time * told[:, None]
        self._own = gram[:, own]
        self._taken = np.linalg.inv(inner)

    def of_accelerations(self, weights: Floats, products: Products) -> tuple[Floats, Floats]:
        """(n, n) S and (n,) g of (E, h, n) accelerations at the pushes of some products."""
        gram, cross, pull = products
        moved = gram @ weights
        return self._projected(
            np.tensordot(weights, moved, BOTH),
            np.tensordot(weights, cross, BOTH),
            np.tensordot(weights, pull, BOTH),
        )

    def _products(self, pushes: Ints) -> Products:
        """Of (h,) pushes: (E, h, h) among each other, (E, h, p) with parameters, (E, h) with the residual."""
        p, own, gram = self._parameters, self._parameters + pushes, self._gram
        return (
            np.ascontiguousarray(gram[:, own[:, None], own]),
            np.ascontiguousarray(gram[:, own, :p]),
            np.ascontiguousarray(gram[:, own, -1]),
        )

    def of_columns(self, columns: Floats) -> tuple[Floats, Floats]:
        """The same of (E, D, n) changes of the residual."""
        tangent, p = self.response.tangent, self._parameters
        weighted = columns * self._weight[:, :, None]
        with_own = tangent.own.transpose(0, 2, 1) @ weighted
        taken = self._taken @ with_own
        gram = np.tensordot(weighted, columns, BOTH) - np.tensordot(with_own, taken, BOTH)
        cross = np.tensordot(weighted, tangent.parameters, BOTH) - np.tensordot(taken, self._own[:, :, :p], BOTH)
        pull = np.einsum("edn,ed->n", weighted, tangent.residual)
        pull -= np.einsum("eln,el->n", taken, self._own[:, :, -1] - tangent.own_away)
        return self._projected(gram, cross, pull)

    def _projected(self, gram: Floats, cross: Floats, pull: Floats) -> tuple[Floats, Floats]:
        absorbed = cross @ self._inverse
        return gram - absorbed @ cross.T, pull - absorbed @ self._pull

    def ranked(self, candidate: Candidate) -> list[Ranked]:
        """A law at its best shapes, each in its neighbourhood, the best first."""
        found = self._of_forces(candidate) if candidate.by_force else self._rolled_out(candidate)
        return sorted(found, key=lambda f: -f.gain)

    def together(self, singles: Sequence[Ranked]) -> Ranked | None:
        """One law on those of its sites that have the highest evidence, with a size on each; None: on less than two.

        `singles`: the law on each site. Sites are added in turn while the evidence of the linear model grows by it.
        """
        columns = np.concatenate([r.columns for r in singles], axis=2)
        matrix, pull = self.of_columns(columns)
        first = np.cumsum([0, *(r.columns.shape[2] for r in singles)])
        own = [np.arange(a, b) for a, b in pairwise(first)]
        chosen: list[int] = []
        best = 0.0
        while len(chosen) < len(singles):
            tried = {i: _evidence(matrix, pull, np.concatenate([own[k] for k in (*chosen, i)]))
                     for i in range(len(singles)) if i not in chosen}  # fmt: skip
            found = max(tried, key=lambda i: tried[i])
            if tried[found] <= best:
                break
            best = tried[found]
            chosen.append(found)
        if len(chosen) < 2:
            return None
        parts = [singles[i] for i in sorted(chosen)]
        candidate = Candidate(parts[0].candidate.attached, tuple(r.candidate.attached for r in parts[1:]))
        at = np.concatenate([own[i] for i in sorted(chosen)])
        low, high, scale = _bounds(candidate)
        width = WIDTH * scale
        sizes, gain = best_sizes(matrix[np.ix_(at, at)], pull[at], low / width, high / width, np.ones(len(at)))
        numbers = np.concatenate([r.numbers for r in parts])
        numbers[candidate.amplitudes] = sizes * width + candidate.begins[candidate.amplitudes]
        return Ranked(candidate, numbers, columns[:, :, at], gain, any(r.seen for r in parts))

    # --- laws of forces

    def _of_forces(self, candidate: Candidate) -> list[Ranked]:
        """Shapes are asked by the hundred: what depends on the sites alone is worked out before."""
        law, pushes = self._units(candidate), self._pushes(candidate)
        products = self._products(pushes)
        low, high, scale = _bounds(candidate)

        def amplitudes(units: Floats) -> tuple[Floats, float]:
            return best_sizes(*self.of_accelerations(units / scale, products), low, high, WIDTH * scale)

        quantities, found = candidate.quantities, []
        for shapes in best_shapes(quantities, lambda one: amplitudes(law(one))[1], STARTS, EVALUATIONS):
            units, numbers = law(shapes), shapes.copy()
            numbers[candidate.amplitudes], gain = amplitudes(units)
            columns = self.response.tangent.pushes[:, :, pushes] @ (WIDTH * units)
            found.append(self._judged(candidate, numbers, columns, gain))
        return found

    def _units(self, candidate: Candidate) -> Callable[[Floats], Floats]:
        """At (q,) shapes, (E, h, a) accelerations per modest size of each amplitude, of the pushes of its sites."""
        law, quantities = self.response.law(candidate.attached), candidate.attached.effect.quantities

        def at(shapes: Floats) -> Floats:
            out = []
            for i, q in enumerate(quantities):
                if q.amplitude:
                    numbers = shapes.copy()
                    numbers[i] = q.scale
                    out.append(law(numbers).reshape(len(self._gram), -1))
            return np.stack(out, axis=2)

        return at

    def _pushes(self, candidate: Candidate) -> Ints:
        """(h,) pushes of a law's sites: moments, then directions."""
        response = self.response
        moments, directions = len(response.kicks.moments_s), len(response.unit)
        return np.ravel(np.arange(moments)[:, None] * directions + response.pushed_by(candidate.attached))

    def _judged(self, candidate: Candidate, numbers: Floats, columns: Floats, gain: float) -> Ranked:
        low, high, scale = _bounds(candidate)
        most = np.maximum(np.abs(low), np.abs(high)) / (WIDTH * scale)
        told = np.sqrt(np.maximum(np.diag(self.of_columns(columns)[0]), 0.0))
        return Ranked(candidate, numbers, columns, gain, bool(np.any(most * told > SIGMAS)))

    # --- laws of contacts, commands and signals

    def _rolled_out(self, candidate: Candidate) -> list[Ranked]:
        found = (self._grown(candidate, shapes) for shapes in self._shapes_seen(candidate))
        return [one for one in found if one]

    def _shapes_seen(self, candidate: Candidate) -> list[Floats]:
        """(q,) shapes of a law of a sensor that has to be searched; of another one where its search begins, and each
        shape that has to be looked at elsewhere at its places, the others as they are."""
        quantities, effect = candidate.quantities, candidate.attached.effect
        begins = np.array([0.0 if q.amplitude else q.start for q in quantities])
        elsewhere = [(i, at) for i, q in enumerate(quantities) if q.grid > 1 for at in shape_grid(q) if at != q.start]
        if effect.sensing is None or not elsewhere:
            return [begins, *(np.where(np.arange(len(begins)) == i, at, begins) for i, at in elsewhere)]
        low, high, scale = _bounds(candidate)
        law, steps = self.response.bent(candidate.attached), np.zeros((len(scale), len(quantities)))
        steps[:, candidate.amplitudes] = np.diag(scale)

        def gain(shapes: Floats) -> float:
            per_unit = np.stack([law(shapes + step) for step in steps], axis=2) / scale
            return best_sizes(*self.of_columns(per_unit), low, high, WIDTH * scale)[1]

        return best_shapes(quantities, gain, STARTS, EVALUATIONS, smooth=True)

    def _grown(self, candidate: Candidate, shapes: Floats) -> Ranked | None:
        """With steps that are doubled until they do twice as much: limits do nothing, then a lot.

        They are taken downwards where there is no room above zero.
        """
        low, high, scale = _bounds(candidate)
        amplitudes = candidate.attached.amplitudes
        begins = candidate.begins[amplitudes]
        found: list[Ranked] = []
        up = high >= scale
        steps, most, before = np.where(up, scale, -scale), np.where(up, high, -low), 0.0
        while np.all(np.abs(steps) <= most):
            settings = np.tile(shapes, (len(steps), 1))
            settings[:, amplitudes] = np.diag(begins + steps)
            change = self.response.changes(candidate.attached, settings)
            per_unit = change / steps
            sizes, gain = best_sizes(*self.of_columns(per_unit), low, high, WIDTH * scale)
            numbers = settings[0].copy()
            numbers[amplitudes] = begins + sizes
            found.append(self._judged(candidate, numbers, per_unit * WIDTH * scale, gain))
            done = float(np.linalg.norm(change))
            if _FELT < done < _TWICE * before:
                break
            steps, before = 2.0 * steps, done
        return max(found, key=lambda f: f.gain, default=None)


def _bounds(candidate: Candidate) -> tuple[Floats, Floats, Floats]:
    """(a,) lowest, highest and modest size of each amplitude, beyond where it begins to do something."""
    quantities = [q for q in candidate.quantities if q.amplitude]
    low, high, scale = np.array([(0.0 if q.begins else q.low, q.high - q.begins, q.scale) for q in quantities]).T
    return low, high, scale


def _evidence(matrix: Floats, pull: Floats, at: Ints) -> float:
    """Log evidence of some amplitudes of unit prior over their absence."""
    size, _, white = _posterior(matrix[np.ix_(at, at)], pull[at], np.ones(len(at)))
    return 0.5 * float(np.sum(white**2 - np.log(size)))


def best_sizes(matrix: Floats, pull: Floats, low: Floats, high: Floats, prior: Floats) -> tuple[Floats, float]:
    """(n,) amplitudes within bounds that lower the cost most, and by how much, with a Gaussian prior."""
    size, axes, white = _posterior(matrix, pull, prior)
    root = np.sqrt(size)[:, None] * axes.T / prior  # its square is the precision
    sizes = -prior * (axes @ (white / np.sqrt(size)))
    if np.any((sizes < low) | (sizes > high)):
        if len(pull) == 1:
            sizes = np.clip(sizes, low, high)
        else:
            sizes = lsq_linear(root, -white, (low, high), method="bvls").x
    return sizes, -float(white @ (root @ sizes) + 0.5 * np.sum((root @ sizes) ** 2))


def _posterior(matrix: Floats, pull: Floats, prior: Floats) -> tuple[Floats, Floats, Floats]:
    """(n,) eigenvalues, 1 at least, and (n, n) axes of the posterior's precision in the prior's standard deviations,
    and (n,) the pull along them in the posterior's.

    Recordings that tell of two amplitudes by 10^16 the same leave a matrix that is singular in double precision: 1 is
    where it tells nothing, and what pulls there is rounding.
    """
    told, axes = np.linalg.eigh(prior[:, None] * matrix * prior)
    size = np.asarray(1 + np.where(told > UNTOLD * told[-1], told, 0.0))
    return size, np.asarray(axes), np.where(size > 1, axes.T @ (prior * pull), 0.0) / np.sqrt(size)
