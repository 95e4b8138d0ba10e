"""Before any recording: what a set of shots could show, what it could not tell apart, and what is wrong with it.

The same table, for the shots that were recorded, says what a verdict cannot speak about.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from compass_ros.discovery.candidates import Candidate
from compass_ros.planning.information import Information
from compass_ros.types import Floats

SIGMAS = 5.0
TWIN = 0.97
"""Cosine of projected tangents from which two effects cannot be told apart."""
ABSORBED = 0.999
"""Share that parameters take from which nothing can be said of an effect."""


@dataclass(frozen=True)
class Seen:
    """How much of one number there has to be to be seen."""

    name: str
    unit: str
    at_five_sigma: float
    """In `unit`."""
    absorbed: float
    """Share of what it does to the recordings that the (other) parameters would take, 0 to 1."""
    bound: float
    """The largest that is physical; parameters: the width of what is known before."""


@dataclass(frozen=True)
class Visible:
    """What the shots could show of one effect on certain objects."""

    name: str
    objects: tuple[str, ...]
    amplitudes: tuple[Seen, ...]
    twins: tuple[str, ...]
    """Labels of the effects that these shots could not tell from this one."""

    @property
    def best(self) -> Seen:
        """The amplitude that is seen first, compared with what is physical."""
        return min(self.amplitudes, key=lambda seen: seen.at_five_sigma / seen.bound)

    @property
    def at_five_sigma(self) -> float:
        return self.best.at_five_sigma

    @property
    def absorbed(self) -> float:
        return self.best.absorbed

    @property
    def detectable(self) -> bool:
        """Whether a physical amplitude would be seen."""
        return any(s.at_five_sigma <= s.bound and s.absorbed <= ABSORBED for s in self.amplitudes)


@dataclass(frozen=True)
class Plan:
    """The table for a set of shots."""

    parameters: tuple[Seen, ...]
    effects: tuple[Visible, ...]

    @property
    def undetectable(self) -> tuple[str, ...]:
        """Names of effects that no choice of objects would make visible."""
        seen = {v.name for v in self.effects if v.detectable}
        return tuple(dict.fromkeys(v.name for v in self.effects if v.name not in seen))


def plan_of(known: Information) -> Plan:
    """The table of all shots of an `Information`."""
    left, whole = known.of_effects()
    five = SIGMAS / np.sqrt(np.maximum(np.diag(left), 1e-300))
    absorbed = 1 - np.diag(left) / np.maximum(whole, 1e-300)
    effects = []
    for i, candidate in enumerate(known.candidates):
        own = [c for c, column in enumerate(known.columns) if column.candidate == i]
        seen = []
        for q in candidate.attached.effect.quantities:
            of_quantity = [c for c in own if known.columns[c].quantity == q]
            if of_quantity:
                middle = float(np.median(five[of_quantity])) * q.scale
                taken = float(np.clip(np.median(absorbed[of_quantity]), 0, 1))
                seen.append(Seen(q.name, q.unit, middle, taken, max(abs(q.low), abs(q.high))))
        effects.append(Visible(candidate.name, candidate.attached.objects, tuple(seen), ()))
    return Plan(_parameters(known), _with_twins(known, effects, left))


def _parameters(known: Information) -> tuple[Seen, ...]:
    left, whole = known.of_parameters()
    five = SIGMAS / np.sqrt(np.maximum(left, 1e-300)) * known.width
    absorbed = np.clip(1 - left / np.maximum(whole, 1e-300), 0, 1)
    return tuple(
        Seen(p.name, p.unit, float(f), float(a), float(w))
        for p, f, a, w in zip(known.parameters, five, absorbed, known.width, strict=True)
    )


def widest(effects: Sequence[tuple[str, tuple[str, ...]]]) -> list[int]:
    """Indices of those (name, objects) that act on as many objects as any of their name: together, not one by one."""
    most: dict[str, int] = {}
    for name, objects in effects:
        most[name] = max(most.get(name, 0), len(objects))
    return [i for i, (name, objects) in enumerate(effects) if len(objects) == most[name]]


def label(candidate: Candidate, candidates: Sequence[Candidate]) -> str:
    """The name, with the objects where it stands for only some of them."""
    size = len(candidate.attached.objects)
    others = [c for c in candidates if c.name == candidate.name and c != candidate]
    if all(len(c.attached.objects) < size for c in others):
        return candidate.name
    return f"{candidate.name} of {'+'.join(candidate.attached.objects)}"


def _with_twins(known: Information, effects: Sequence[Visible], left: Floats) -> tuple[Visible, ...]:
    alike = cosines(known, left)
    labels = [label(c, known.candidates) for c in known.candidates]
    visible = [v.detectable for v in effects]
    out = []
    for i, v in enumerate(effects):
        twins = [labels[j] for j in np.argsort(-alike[i], kind="stable")
                 if j != i and visible[i] and visible[j] and alike[i, j] > TWIN]  # fmt: skip
        out.append(Visible(v.name, v.objects, v.amplitudes, tuple(twins)))
    return tuple(out)


def cosines(known: Information, left: Floats) -> Floats:
    """(N, N) how well one candidate imitates another: 1 where some amplitude of it cannot be told from the other's.

    For each case of a candidate, the amplitude that another candidate's best case imitates best; the median over cases.
    """
    count = len(known.candidates)
    blocks: dict[tuple[int, int], list[int]] = {}
    for c, column in enumerate(known.columns):
        blocks.setdefault((column.candidate, column.case), []).append(c)
    of = list(blocks)
    diagonal = np.maximum(np.diag(left), 1e-300)
    explained = np.zeros((len(known.columns), len(of)))  # share of each column that each block can take
    for b, columns in enumerate(blocks.values()):
        inner = left[np.ix_(columns, columns)]
        inner = inner + 1e-9 * np.diag(np.diag(inner)) + 1e-300 * np.eye(len(columns))
        cross = left[columns]
        explained[:, b] = np.sum(cross * np.linalg.solve(inner, cross), axis=0) / diagonal
    own = [[b for b, (candidate, _) in enumerate(of) if candidate == j] for j in range(count)]
    best_block = np.stack([explained[:, of_j].max(axis=1) for of_j in own], axis=1)  # (n, N)
    out = np.eye(count)
    for i in range(count):
        cases = [best_block[columns].max(axis=0) for (candidate, _), columns in blocks.items() if candidate == i]
        out[i] = np.sqrt(np.clip(np.median(cases, axis=0), 0, 1))
    return np.asarray(np.maximum(out, out.T))
