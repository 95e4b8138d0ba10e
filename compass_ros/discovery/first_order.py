"""What a law could explain, to first order about a fit: its columns beside those of the parameters, its best shapes.

A law of forces with accelerations a(shape) along the fitted motion changes the residual by R a, with R the responses
to pushes: so its shapes (a centre, a radius, a frequency) are searched without a rollout. Any other law is rolled out.
With the columns T of its amplitudes, what is left after parameters, own numbers and amplitudes have taken their best
values falls by 1/2 g' S^-1 g, where S = T'T and g = T'r after the projection off all the others.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.optimize import lsq_linear, minimize

from compass_ros.calibration.least_squares import robust_weight
from compass_ros.discovery.candidates import Candidate
from compass_ros.discovery.response import Response
from compass_ros.simulation.effects import Quantity
from compass_ros.types import Floats

SIGMAS = 5.0
"""Standard deviations from which something is seen."""
STARTS = 4
"""Places from which the shapes of a law are searched."""
WIDTH = 20.0
"""Standard deviation of an amplitude's prior, in its modest sizes."""
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


class FirstOrder:
    """All laws about one response."""

    def __init__(self, response: Response) -> None:
        self.response = response
        tangent, gram = response.tangent, response.tangent.normal.gram
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
        weight = np.sqrt(np.maximum(_weights(response), 0.0) / tangent.correlation_time)
        self._weight = weight

    def of_accelerations(self, weights: Floats) -> tuple[Floats, Floats]:
        """(n, n) S and (n,) g of (E, K S, n) accelerations."""
        p, pushes = self._parameters, slice(self._parameters, -1)
        moved = self._gram[:, pushes, pushes] @ weights
        gram = np.einsum("ehn,ehm->nm", weights, moved)
        cross = np.einsum("ehn,ehp->np", weights, self._gram[:, pushes, :p])
        pull = np.einsum("ehn,eh->n", weights, self._gram[:, pushes, -1])
        return self._projected(gram, cross, pull)

    def of_columns(self, columns: Floats) -> tuple[Floats, Floats]:
        """The same of (E, D, n) changes of the residual."""
        tangent = self.response.tangent
        weighted = columns * self._weight[:, :, None]
        own, rest = tangent.own * self._weight[:, :, None], tangent.residual * self._weight
        parameters = tangent.parameters * self._weight[:, :, None]
        inner = np.einsum("edl,edm->elm", own, own) + np.eye(own.shape[2])
        with_own = np.einsum("edl,edn->eln", own, weighted)
        taken = np.linalg.solve(inner, with_own)
        gram = np.einsum("edn,edm->nm", weighted, weighted) - np.einsum("eln,elm->nm", with_own, taken)
        cross = np.einsum("edn,edp->np", weighted, parameters)
        cross -= np.einsum("eln,elp->np", taken, np.einsum("edl,edp->elp", own, parameters))
        pull = np.einsum("edn,ed->n", weighted, rest)
        pull -= np.einsum("eln,el->n", taken, np.einsum("edl,ed->el", own, rest) - tangent.own_away)
        return self._projected(gram, cross, pull)

    def _projected(self, gram: Floats, cross: Floats, pull: Floats) -> tuple[Floats, Floats]:
        absorbed = cross @ self._inverse
        return gram - absorbed @ cross.T, pull - absorbed @ self._pull

    def ranked(self, candidate: Candidate) -> list[Ranked]:
        """A law at its best shapes, each in its neighbourhood, the best first."""
        found = self._of_forces(candidate) if candidate.by_force else self._rolled_out(candidate)
        return sorted(found, key=lambda f: -f.gain)

    # --- laws of forces

    def _of_forces(self, candidate: Candidate) -> list[Ranked]:
        return [self._at(candidate, shapes) for shapes in self._best_shapes(candidate)]

    def _accelerations(self, candidate: Candidate, numbers: Floats) -> Floats:
        """(E, K S)"""
        return self.response.accelerations(candidate.attached, numbers).reshape(len(self._gram), -1)

    def _amplitudes(self, candidate: Candidate, shapes: Floats) -> tuple[Floats, float]:
        """(q,) numbers with the best amplitudes at a shape, and the gain."""
        quantities = candidate.attached.effect.quantities
        which = [i for i, q in enumerate(quantities) if q.amplitude]
        scale = np.array([quantities[i].scale for i in which])
        low, high = (np.array([getattr(quantities[i], side) for i in which]) for side in ("low", "high"))
        if candidate.attached.effect.superposes:
            units = [shapes + q * np.eye(len(quantities))[i] for i, q in zip(which, scale, strict=True)]
            weights = np.stack([self._accelerations(candidate, u) for u in units], axis=2) / scale
            sizes, gain = best_sizes(*self.of_accelerations(weights), low, high, WIDTH * scale)
            numbers = shapes.copy()
            numbers[which] = sizes
            return numbers, gain
        best = (shapes, 0.0)  # directions of two amplitudes that do not add up, one by one
        for angle in np.linspace(0, 2 * np.pi, 12, endpoint=False):
            ray = np.zeros(len(quantities))
            ray[which[:2]] = scale[:2] * np.array([np.cos(angle), np.sin(angle)])
            weights = self._accelerations(candidate, shapes + ray)[:, :, None]
            most = np.array([high.min() / np.abs(ray).max()])
            size, gain = best_sizes(*self.of_accelerations(weights), np.zeros(1), most, np.array([WIDTH]))
            if gain > best[1]:
                best = (shapes + ray * size[0], gain)
        return best

    def _at(self, candidate: Candidate, shapes: Floats) -> Ranked:
        numbers, gain = self._amplitudes(candidate, shapes)
        quantities = candidate.attached.effect.quantities
        sizes = np.array([WIDTH * q.scale for q in quantities if q.amplitude])
        which = [i for i, q in enumerate(quantities) if q.amplitude]
        columns = []
        for i, size in zip(which, sizes, strict=True):
            one = shapes.copy()
            one[i] = quantities[i].scale
            if not candidate.attached.effect.superposes:
                one = numbers
            moved = self._accelerations(candidate, one) / one[i] if one[i] else np.zeros_like(self._gram[:, 0, :0])
            if not np.size(moved):
                continue
            pushes = self.response.tangent.pushes
            columns.append(np.einsum("edh,eh->ed", pushes, moved) * size)
            if not candidate.attached.effect.superposes:
                break
        return self._judged(candidate, numbers, np.stack(columns, axis=2), gain)

    def _judged(self, candidate: Candidate, numbers: Floats, columns: Floats, gain: float) -> Ranked:
        quantities = [q for q in candidate.attached.effect.quantities if q.amplitude]
        most = np.array([max(abs(q.low), abs(q.high)) / (WIDTH * q.scale) for q in quantities])[: columns.shape[2]]
        told = np.sqrt(np.maximum(np.diag(self.of_columns(columns)[0]), 0.0))
        return Ranked(candidate, numbers, columns, gain, bool(np.any(most * told > SIGMAS)))

    def _best_shapes(self, candidate: Candidate) -> list[Floats]:
        """(q,) shapes that gain most, each in its neighbourhood: a grid, then simplexes from its best places."""
        quantities = candidate.attached.effect.quantities
        shape_of = [i for i, q in enumerate(quantities) if not q.amplitude]
        if not shape_of:
            return [np.zeros(len(quantities))]

        def at(point: Floats) -> Floats:
            shapes = np.zeros(len(quantities))
            shapes[shape_of] = point
            return shapes

        def fall(point: Floats) -> float:
            return -self._amplitudes(candidate, at(point))[1]

        grids = [shape_grid(quantities[i]) for i in shape_of]
        nodes = np.array(list(product(*(range(len(grid)) for grid in grids))))
        points = np.array(list(product(*grids)))
        falls = np.array([fall(point) for point in points])
        starts: list[int] = []
        for i in np.argsort(falls, kind="stable"):
            if len(starts) < STARTS and all(np.abs(nodes[i] - nodes[k]).max() > 1 for k in starts):
                starts.append(int(i))
        bounds = [(quantities[i].low, quantities[i].high) for i in shape_of]
        options = {"maxfev": 40 * len(shape_of), "xatol": 1e-4, "fatol": 1e-2}
        found = [minimize(fall, points[i], method="Nelder-Mead", bounds=bounds, options=options) for i in starts]
        apart = 0.1 * np.ptp(bounds, axis=1)
        best: list[Floats] = []
        for one in sorted(found, key=lambda one: float(one.fun)):
            if all(np.any(np.abs(one.x - other) > apart) for other in best):
                best.append(one.x)
        return [at(point) for point in best]

    # --- laws of contacts, commands and signals

    def _rolled_out(self, candidate: Candidate) -> list[Ranked]:
        """With steps that are doubled until they do twice as much: limits do nothing, then a lot."""
        quantities = candidate.attached.effect.quantities
        which = [i for i, q in enumerate(quantities) if q.amplitude]
        low, high, scale = (np.array([getattr(quantities[i], w) for i in which]) for w in ("low", "high", "scale"))
        found: list[Ranked] = []
        steps, before = scale, 0.0
        while np.all(steps <= high):
            settings = np.tile([0.0 if q.amplitude else q.start for q in quantities], (len(which), 1))
            settings[:, which] = np.diag(steps)
            change = self.response.changes(candidate.attached, settings)
            per_unit = change / steps
            sizes, gain = best_sizes(*self.of_columns(per_unit), low, high, WIDTH * scale)
            numbers = settings[0].copy()
            numbers[which] = sizes
            found.append(self._judged(candidate, numbers, per_unit * WIDTH * scale, gain))
            done = float(np.linalg.norm(change))
            if _FELT < done < _TWICE * before:
                break
            steps, before = 2.0 * steps, done
        return [max(found, key=lambda f: f.gain)] if found else []


def _weights(response: Response) -> Floats:
    return robust_weight(response.tangent.residual, response.tangent.robust)


def best_sizes(matrix: Floats, pull: Floats, low: Floats, high: Floats, prior: Floats) -> tuple[Floats, float]:
    """(n,) amplitudes within bounds that lower the cost most, and by how much, with a Gaussian prior."""
    full = matrix + np.diag(1 / prior**2)
    sizes = -np.linalg.solve(full, pull)
    if np.any((sizes < low) | (sizes > high)):
        if len(pull) == 1:
            sizes = np.clip(sizes, low, high)
        else:
            root = np.linalg.cholesky(full)
            sizes = lsq_linear(root.T, -np.linalg.solve(root, pull), (low, high), method="bvls").x
    return sizes, -float(pull @ sizes + 0.5 * sizes @ full @ sizes)


def shape_grid(shape: Quantity) -> Floats:
    """Where the search for a shape begins: places evenly, sizes and rates in equal ratios, a tail at one."""
    low, high = shape.low, shape.high
    if shape.name == "tail":
        return np.array([shape.start])
    if low < 0 < high:
        return np.linspace(0.85 * low, 0.85 * high, 9 if high - low > 0.6 else 5)
    return np.geomspace(max(low, 0.02 * high), 0.8 * high, 12 if shape.name == "frequency" else 4)
