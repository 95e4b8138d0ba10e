"""What each shot tells of parameters and effects: matrices that add up over shots, so that sets compare cheaply.

A candidate is asked about at one or more cases: a field at several places, a wind from several sides. Each amplitude of
each case is a column; its tangent, scaled by the quantity's modest size, stands beside those of the parameters.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from compass_ros.calibration.cost import robust_weight
from compass_ros.calibration.identifiability import information as information_of
from compass_ros.discovery.candidates import Candidate
from compass_ros.discovery.response import Response
from compass_ros.simulation.effects import Quantity
from compass_ros.types import Floats, Ints, Parameter

PLACES = (-0.5, 0.5)
"""Where a local field is tried beside its usual place, in parts of the way to the bounds."""
FELT = 5.0
"""Movement of all recordings together [sigma] from which a step says what an effect does."""
STRETCH, LONGER = 4.0, 2
"""By how much a step is lengthened that is not felt, and how often."""
_LEAST = 1e-9
"""Share of a tangent that is called left over at least: rounding hides less."""


@dataclass(frozen=True)
class Column:
    """One amplitude of a candidate in one case."""

    candidate: int
    """Index of the candidate."""
    case: int
    """Number of the case among the candidate's."""
    quantity: Quantity


@dataclass(frozen=True)
class Information:
    """E shots, p parameters that are fitted, n columns of effects."""

    candidates: tuple[Candidate, ...]
    columns: tuple[Column, ...]
    parameters: tuple[Parameter, ...]
    width: Floats
    """(p,) prior standard deviation of each parameter."""
    gram: Floats
    """(E, p + n, p + n) products of tangents, of one prior width and of one scale; launches are taken out."""
    correlation_time: float
    """Frames that one independent measurement is worth."""

    def total(self, shots: Ints | None = None) -> Floats:
        """(p + n, p + n) of some shots together, or of all."""
        return np.asarray((self.gram if shots is None else self.gram[shots]).sum(axis=0) / self.correlation_time)

    def of_effects(self, shots: Ints | None = None) -> tuple[Floats, Floats]:
        """(n, n) information of the columns with the parameters taken out, and (n,) of each with nothing taken out."""
        total, p = self.total(shots), len(self.parameters)
        cross = total[:p, p:]
        left = total[p:, p:] - cross.T @ np.linalg.solve(total[:p, :p] + np.eye(p), cross)
        whole = np.diag(total)[p:].copy()
        diagonal = np.arange(len(whole))
        left[diagonal, diagonal] = np.maximum(left[diagonal, diagonal], _LEAST * whole)
        return left, whole

    def of_parameters(self) -> tuple[Floats, Floats]:
        """(p,) information of each parameter with the other parameters taken out, and (p,) with nothing taken out."""
        p = len(self.parameters)
        total = self.total()[:p, :p]
        left = 1 / np.diag(np.linalg.inv(total + np.eye(p))) - 1
        whole = np.diag(total).copy()
        return np.maximum(left, _LEAST * whole), whole

    def of_shots(self, shots: Ints) -> Information:
        """The same for some of the shots."""
        return replace(self, gram=self.gram[shots])

    def only(self, keep: Sequence[int]) -> Information:
        """The same for some of the candidates."""
        new = {old: i for i, old in enumerate(keep)}
        chosen = [i for i, column in enumerate(self.columns) if column.candidate in new]
        columns = tuple(replace(c, candidate=new[c.candidate]) for c in self.columns if c.candidate in new)
        rows = np.concatenate([np.arange(len(self.parameters)), len(self.parameters) + np.array(chosen, int)])
        candidates = tuple(self.candidates[i] for i in keep)
        return replace(self, candidates=candidates, columns=columns, gram=self.gram[:, rows[:, None], rows])


def information(response: Response, candidates: Sequence[Candidate]) -> Information:
    """Tangents of all candidates around a fit; effects that are no force cost one rollout a quantity and shot."""
    columns: list[Column] = []
    tangents: list[Floats] = [response.tangent.parameters[:, :, : len(response.inside)]]
    for i, candidate in enumerate(candidates):
        for case, (quantities, of_case) in enumerate(_cases(response, candidate)):
            columns.extend(Column(i, case, q) for q in quantities)
            tangents.append(of_case * np.array([q.scale for q in quantities]))
    weight = np.sqrt(robust_weight(response.tangent.residual, response.tangent.robust))[:, :, None]
    free, likelihood = response.fit.free[response.inside], response.likelihood
    return Information(
        candidates=tuple(candidates),
        columns=tuple(columns),
        parameters=tuple(likelihood.parameters[i] for i in free),
        width=likelihood.prior_std[free],
        gram=information_of(np.concatenate(tangents, axis=2) * weight, response.launches * weight),
        correlation_time=likelihood.correlation_time,
    )


def _cases(response: Response, candidate: Candidate) -> Iterator[tuple[list[Quantity], Floats]]:
    """Amplitudes of each case with their (E, D, n) tangents per unit."""
    quantities = candidate.attached.effect.quantities
    if not candidate.by_force:
        yield [q for q in quantities if q.amplitude], _differences(response, candidate)
        return
    amplitudes = [i for i, q in enumerate(quantities) if q.amplitude]
    units = np.diag([q.scale for q in quantities])[amplitudes]
    if candidate.attached.effect.superposes:
        directions = [(units, [quantities[i] for i in amplitudes])]
    else:
        directions = [
            (sign * unit[None], [quantities[i]])
            for unit, i in zip(units, amplitudes, strict=True)
            for sign in (1.0, -1.0)
        ]
    for shapes in _shapes(quantities):
        for sizes, own in directions:
            pushed = [response.accelerations(candidate.attached, shapes + size) for size in sizes]
            weights = np.stack([a.reshape(len(a), -1) for a in pushed], axis=2)
            yield own, response.tangent.pushes @ (weights / [np.abs(size).max() for size in sizes])


def _differences(response: Response, candidate: Candidate) -> Floats:
    """(E, D, a) change of the residual per unit of each amplitude, from a step of its scale.

    The step is longer where that is not felt: a limit or a dead band does nothing until it is reached.
    """
    quantities = [q for q in candidate.attached.effect.quantities if q.amplitude]
    steps = np.array([q.scale for q in quantities])
    begins = np.array([q.begins for q in quantities])
    change = response.changes(candidate.attached, _alone(candidate, begins + steps))
    for _ in range(LONGER):
        unfelt = (np.linalg.norm(change, axis=(0, 1)) < FELT) & (steps * STRETCH < [q.high for q in quantities])
        if not unfelt.any():
            break
        steps = np.where(unfelt, STRETCH * steps, steps)
        change[:, :, unfelt] = response.changes(candidate.attached, _alone(candidate, begins + steps)[unfelt])
    return np.asarray(change / steps)


def _alone(candidate: Candidate, steps: Floats) -> Floats:
    """(a, q) settings: each of the amplitudes alone at its step, shapes as they begin."""
    quantities = candidate.attached.effect.quantities
    settings = np.tile([q.start for q in quantities], (len(steps), 1))
    settings[:, [q.amplitude for q in quantities]] = np.diag(steps)
    return settings


def _shapes(quantities: Sequence[Quantity]) -> list[Floats]:
    """(q,) usual shapes, amplitudes zero; where there is a place, the usual one and one in each quarter."""
    usual = np.array([0.0 if q.amplitude else q.start for q in quantities])
    places = [i for i, q in enumerate(quantities) if not q.amplitude and q.low < 0 < q.high]
    out = [usual]
    for parts in product(PLACES, repeat=len(places)) if places else ():
        shapes = usual.copy()
        shapes[places] = [part * quantities[i].high for part, i in zip(parts, places, strict=True)]
        out.append(shapes)
    return out
