"""What each shot tells of parameters and effects: matrices that add up over shots, so that sets compare cheaply.

A candidate is asked about at one or more cases: a field at several places, a wind from several sides. Each amplitude of
each case is a column; its tangent, scaled by the quantity's modest size, stands beside those of the parameters.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from compass_ros.calibration.identifiability import information as information_of
from compass_ros.discovery.candidates import Candidate
from compass_ros.discovery.screen import Space
from compass_ros.discovery.tangents import differences
from compass_ros.simulation.effects import Quantity
from compass_ros.types import Floats, Ints, Parameter

PLACES = (-0.5, 0.5)
"""Where a local field is tried beside its usual place, in parts of the way to the bounds."""
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


def information(space: Space, candidates: Sequence[Candidate]) -> Information:
    """Tangents of all candidates around a fit; effects that are no force cost one rollout a quantity and shot."""
    columns: list[Column] = []
    tangents: list[Floats] = []
    for i, candidate in enumerate(candidates):
        for case, (quantities, of_case) in enumerate(_cases(space, candidate)):
            columns.extend(Column(i, case, q) for q in quantities)
            tangents.append(of_case * np.array([q.scale for q in quantities]))
    free = space.fit.free
    return Information(
        candidates=tuple(candidates),
        columns=tuple(columns),
        parameters=tuple(space.likelihood.parameters[i] for i in free),
        width=space.likelihood.prior_std[free],
        gram=_grams(space, np.concatenate([np.empty((space.residual.size, 0)), *tangents], axis=1)),
        correlation_time=space.likelihood.correlation_time,
    )


def _cases(space: Space, candidate: Candidate) -> Iterator[tuple[list[Quantity], Floats]]:
    """Amplitudes of each case with their (D, n) tangents per unit."""
    quantities = candidate.attached.effect.quantities
    if not candidate.by_force:
        yield [q for q in quantities if q.amplitude], differences(space, candidate)
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
        for direction, own in directions:
            yield own, space.tangent_of_weights(space.weights(candidate, shapes, direction))


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


def _grams(space: Space, tangents: Floats) -> Floats:
    """(E, p + n, p + n) products of the tangents of parameters and effects, shot by shot, with its launch taken out."""
    episodes, size = space.weight.shape
    weight = space.weight[:, :, None]
    base = space.fit.linear.jacobian.reshape(episodes, size, -1) * weight
    own = space.fit.linear.launch_jacobian.reshape(episodes, size, -1) * weight
    return information_of(np.concatenate([base, tangents.reshape(episodes, size, -1)], axis=2), own)
