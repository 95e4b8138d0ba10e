"""What each candidate could explain, to first order: its tangent, projected off those of the parameters.

Everything happens in the space of the calibrated residual r [sigma]. A candidate with tangent T (one column for each
amplitude) lowers the cost by 1/2 g' S^-1 g with g = T'r and S = T'T, both after the parameters have taken what they
can: S = T'T - T'J (J'J + 1)^-1 J'T. For forces, T = R a with R the impulse responses and a the accelerations along the
paths, so that shapes (a centre, a radius, a frequency) are searched without a rollout.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from compass_ros.calibration.least_squares import Fit, robust_weight
from compass_ros.calibration.likelihood import Likelihood
from compass_ros.discovery.candidates import Candidate
from compass_ros.discovery.impulses import Impulses
from compass_ros.discovery.shapes import best_shapes
from compass_ros.simulation import Simulator
from compass_ros.types import Floats

STARTS = 5
"""Places from which the shapes of a force are searched."""
EVALUATIONS = 60
"""Of each of these searches, for each shape."""
ELSEWHERE = 0.5
"""Share of the best gain from which another shape is worth a sketch."""


@dataclass(frozen=True)
class Score:
    """A candidate at its best shape."""

    candidate: Candidate
    numbers: Floats
    """(q,) all quantities: amplitudes of the first-order solution, best shapes."""
    gain: float
    """Fall of the cost [log likelihood]."""
    tangent: Floats
    """(D,) change of the weighted residual by the whole effect, not projected; D residuals of all episodes."""
    elsewhere: tuple[Score, ...] = ()
    """The same candidate at other shapes that gain almost as much: first order may take the wrong one for the best."""

    @property
    def name(self) -> str:
        return self.candidate.name


class Space:
    """Weighted residuals and tangents at a fit, with the parameters' part taken out on demand. D = E * F * C."""

    def __init__(self, simulator: Simulator, likelihood: Likelihood, fit: Fit, pushes: Impulses) -> None:
        self.simulator = simulator
        self.likelihood = likelihood
        self.fit = fit
        self.pushes = pushes
        episodes = len(likelihood.inputs)
        weight = np.sqrt(robust_weight(fit.linear.residual, fit.robust))
        self.weight = weight.reshape(episodes, -1)
        base = fit.linear.jacobian.reshape(episodes, self.weight.shape[1], -1) * self.weight[:, :, None]
        own = fit.linear.launch_jacobian.reshape(episodes, self.weight.shape[1], -1) * self.weight[:, :, None]
        launches = np.zeros((episodes, self.weight.shape[1], episodes, own.shape[2]))
        launches[np.arange(episodes), :, np.arange(episodes)] = own
        parameters = np.concatenate([base, launches.reshape(*self.weight.shape, -1)], axis=2)
        self.residual = (fit.linear.residual.reshape(episodes, -1) * self.weight).ravel()
        self.parameters = parameters.reshape(self.residual.size, -1)
        self.inverse = np.linalg.inv(self.parameters.T @ self.parameters + np.eye(self.parameters.shape[1]))
        self._parameter_pull = self.parameters.T @ self.residual
        response = pushes.response * self.weight[:, :, None]
        self._response = response
        self._gram = np.einsum("edh,edi->ehi", response, response)
        by_episode = self.parameters.reshape(*self.weight.shape, -1)
        self._cross = np.einsum("edh,edp->ehp", response, by_episode)
        self._pull = np.einsum("edh,ed->eh", response, self.residual.reshape(self.weight.shape))
        self._states = np.concatenate(
            [
                pushes.paths,
                np.broadcast_to(pushes.mass[:, None], (*pushes.paths.shape[:3], 1)),
                np.broadcast_to(pushes.moments[:, None, None], (*pushes.paths.shape[:3], 1)),
            ],
            axis=3,
        )

    @property
    def told(self) -> tuple[Floats, Floats, Floats]:
        """(P,) values, (E, A) inputs and (E, F) times of the recordings, from which sizes of laws follow."""
        cell = len(self.simulator.cell.parameters)
        return self.fit.point.values[:cell], self.likelihood.inputs, self.likelihood.time_s

    def weights(self, candidate: Candidate, shapes: Floats, direction: Floats) -> Floats:
        """(E, H, n) accelerations at all moments per unit of each of n amplitudes, for forces.

        (q,) `shapes` with the shape quantities filled in; `direction` (n, q) amplitude vectors of the n columns.
        """
        objects = candidate.attached.objects
        chosen = [self.pushes.movers.index(name) for name in objects]
        episodes, moments, movers = self._states.shape[:3]
        out = np.zeros((episodes, moments, movers, 2, len(direction)))
        states = np.ascontiguousarray(self._states[:, :, chosen])
        cell = self.fit.point.values[: len(self.simulator.cell.parameters)]
        for i, amplitudes in enumerate(direction):
            numbers = np.tile(shapes + amplitudes, (episodes, 1))
            size = float(np.max(np.abs(amplitudes))) or 1.0
            forces = self.simulator.forces(candidate.attached, numbers, cell, states)
            for name, n in zip(objects, chosen, strict=True):
                out[:, :, n, :, i] = forces[name] / self.pushes.mass[n] / size
        return out.reshape(episodes, moments * movers * 2, len(direction))

    def tangent_of_weights(self, weights: Floats) -> Floats:
        """(D, n) tangents of (E, H, n) accelerations."""
        return np.asarray((self._response @ weights).reshape(self.residual.size, -1))

    def reduced(self, weights: Floats) -> tuple[Floats, Floats]:
        """(n, n) S and (n,) g of accelerations, with the parameters taken out."""
        columns = weights.reshape(-1, weights.shape[2])
        gram = columns.T @ (self._gram @ weights).reshape(columns.shape)
        cross = columns.T @ self._cross.reshape(len(columns), -1)
        return self._project(gram, cross, columns.T @ self._pull.ravel())

    def reduced_tangent(self, tangent: Floats) -> tuple[Floats, Floats]:
        """The same for (D, n) tangents."""
        return self._project(tangent.T @ tangent, tangent.T @ self.parameters, tangent.T @ self.residual)

    def _project(self, gram: Floats, cross: Floats, pull: Floats) -> tuple[Floats, Floats]:
        absorbed = cross @ self.inverse
        return gram - absorbed @ cross.T, pull - absorbed @ self._parameter_pull

    def off_parameters(self, tangent: Floats) -> Floats:
        """(D, n) the part of tangents that the parameters cannot take."""
        return np.asarray(tangent - self.parameters @ (self.inverse @ (self.parameters.T @ tangent)))


def solve(matrix: Floats, pull: Floats, low: Floats, high: Floats, prior: Floats) -> tuple[Floats, float]:
    """(n,) amplitudes within bounds that lower the cost most, and by how much, with a Gaussian prior of std `prior`."""
    full = matrix + np.diag(1 / prior**2)
    amplitudes = np.zeros(len(pull))
    loose = np.ones(len(pull), bool)
    for _ in range(len(pull) + 1):
        amplitudes[loose] = -np.linalg.solve(
            full[np.ix_(loose, loose)], pull[loose] + full[np.ix_(loose, ~loose)] @ amplitudes[~loose]
        )
        outside = loose & ((amplitudes < low) | (amplitudes > high))
        if not outside.any():
            break
        amplitudes[outside] = np.clip(amplitudes[outside], low[outside], high[outside])
        loose &= ~outside
    return amplitudes, -float(pull @ amplitudes + 0.5 * amplitudes @ full @ amplitudes)


def score_force(space: Space, candidate: Candidate) -> Score:
    """Best shape and amplitudes of a force: a grid over the shapes, then a simplex from its best points."""
    quantities = candidate.attached.effect.quantities
    shapes = best_shapes(quantities, lambda one: _at(space, candidate, one)[1], STARTS, EVALUATIONS)
    best, *others = (_scored(space, candidate, one) for one in shapes)
    return replace(best, elsewhere=tuple(other for other in others if other.gain > ELSEWHERE * best.gain))


def _scored(space: Space, candidate: Candidate, shapes: Floats) -> Score:
    quantities = candidate.attached.effect.quantities
    numbers, gain = _at(space, candidate, shapes)
    directions = np.diag([q.scale for q in quantities])[[i for i, q in enumerate(quantities) if q.amplitude]]
    if not candidate.attached.effect.superposes:
        directions = (numbers - shapes)[None]
    columns = space.tangent_of_weights(space.weights(candidate, shapes, directions))
    sizes = (numbers - shapes)[[i for i, q in enumerate(quantities) if q.amplitude]]
    if not candidate.attached.effect.superposes:
        sizes = np.array([np.max(np.abs(numbers - shapes))])
    return Score(candidate, numbers, gain, columns @ sizes)


def _at(space: Space, candidate: Candidate, shapes: Floats) -> tuple[Floats, float]:
    """(q,) numbers with the best amplitudes at a shape, and the gain."""
    quantities = candidate.attached.effect.quantities
    amplitude_of = [i for i, q in enumerate(quantities) if q.amplitude]
    low, high, prior = (
        np.array([getattr(quantities[i], side) for i in amplitude_of]) for side in ("low", "high", "scale")
    )
    unit = np.diag([q.scale for q in quantities])[amplitude_of]
    if candidate.attached.effect.superposes:
        amplitudes, gain = solve(*space.reduced(space.weights(candidate, shapes, unit)), low, high, 20.0 * prior)
        numbers = shapes.copy()
        numbers[amplitude_of] = amplitudes
        return numbers, gain
    angles = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    rays = np.cos(angles)[:, None] * unit[0] + np.sin(angles)[:, None] * unit[1]
    matrix, pull = space.reduced(space.weights(candidate, shapes, rays))
    best = (shapes, 0.0)
    for i, ray in enumerate(rays):
        one = slice(i, i + 1)
        size, gain = solve(matrix[one, one], pull[one], np.zeros(1), np.array([high.min()]), 20.0 * prior[:1])
        if gain > best[1]:
            best = (shapes + ray / float(np.max(np.abs(ray))) * size[0], gain)
    return best
