"""When no known effect explains what is left: a formula in position and velocity, proposed by sparse regression.

The regression is in the space of the recordings, not of differentiated data: each term's acceleration along the
calibrated paths is carried by the impulse responses into the residual, and the parameters take their part first. What
is left is a linear problem in the coefficients. Its best sets of terms (all up to EXHAUSTIVE, then grown one by one)
are weighed against each other by the extended BIC (Chen and Chen 2008), which counts how many sets were tried. The idea
of a library of terms is SINDy's (Brunton, Proctor and Kutz 2016). A term more than the full simulator and held-out
episodes ask for is not taken.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import combinations
from math import comb, log

import numpy as np

from compass_ros.calibration.likelihood import Likelihood
from compass_ros.calibration.refine import with_launches
from compass_ros.calibration.residuals import residual_at
from compass_ros.discovery.candidates import Candidate
from compass_ros.discovery.joint import Joint, fit_jointly
from compass_ros.discovery.screen import Score, Space
from compass_ros.simulation.effects import Attached, Effect, Quantity
from compass_ros.simulation.effects.effect import Context
from compass_ros.simulation.native.program import Kind, Term
from compass_ros.types import Floats, Ints

NAME = "formula"
EXHAUSTIVE = 3
"""Number of terms up to which every set is tried."""
MOST_TERMS = 6
KEPT = 0.1
"""Share of the excess held-out error that a formula has to remove to be kept."""
_LARGEST = 3.0
"""Acceleration that one term may reach anywhere on the table at 0.5 m/s [m/s^2]."""
_SIZE = {"x": 0.45, "y": 0.225, "vx": 0.5, "vy": 0.5, "speed": 0.5}
_VARIABLES = tuple(_SIZE)
_ALONG_X, _ALONG_Y, _AGAINST = 0, 1, 2


@dataclass(frozen=True)
class Monomial:
    """One term: a component of the acceleration, and powers of x, y, vx, vy and speed."""

    component: int
    """0 along x, 1 along y, 2 against the velocity."""
    powers: tuple[int, int, int, int, int]

    @property
    def size(self) -> float:
        """Its value at the edge of the table and 0.5 m/s."""
        return float(np.prod([_SIZE[v] ** p for v, p in zip(_VARIABLES, self.powers, strict=True)]))

    @property
    def unit(self) -> str:
        """Of its coefficient."""
        metres, seconds = 1 - sum(self.powers), sum(self.powers[2:]) - 2
        parts = [f"{base}^{power}" if power != 1 else base
                 for base, power in (("m", metres), ("s", seconds)) if power]  # fmt: skip
        return " ".join(parts) or "1"

    @property
    def text(self) -> str:
        parts = [f"{v}^{p}" if p > 1 else v for v, p in zip(_VARIABLES, self.powers, strict=True) if p]
        return " ".join(parts)

    @property
    def name(self) -> str:
        """As a name of a quantity."""
        head = ("ax", "ay", "slowing")[self.component]
        return "_".join([head, *(f"{v}{p}" if p > 1 else v for v, p in zip(_VARIABLES, self.powers, strict=True) if p)])


@dataclass(frozen=True)
class Formula:
    """A proposal; never a name."""

    terms: tuple[Monomial, ...]
    coefficients: Floats
    """(n,)"""
    gain: float
    """Fall of the cost to first order [log likelihood]."""
    score: Score

    @property
    def text(self) -> str:
        """As in 'ax = +0.21 x, slowing = +0.4 speed^2' (SI)."""
        parts = []
        for component, head in enumerate(("ax", "ay", "slowing")):
            own = [
                f"{c:+.3g} {t.text}".strip()
                for t, c in zip(self.terms, self.coefficients, strict=True) if t.component == component
            ]  # fmt: skip
            if own:
                parts.append(f"{head} = {' '.join(own)}")
        return ", ".join(parts)


@dataclass(frozen=True)
class Proposal:
    """A formula inside the simulator, fitted together with the parameters."""

    formula: Formula
    joint: Joint
    held_out_gain: float
    """Share of the excess held-out error that it removes."""
    sentence: str


@cache
def basis() -> tuple[Monomial, ...]:
    """Fields up to the third degree in place, couplings to velocity, and slowing that depends on speed and place."""
    out = []
    for component in (_ALONG_X, _ALONG_Y):
        out += [Monomial(component, (i, j, 0, 0, 0)) for i in range(4) for j in range(4 - i)]
        out += [Monomial(component, (0, 0, *v, s)) for v in ((1, 0), (0, 1)) for s in (0, 1)]
    places = [(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2)]
    out += [Monomial(_AGAINST, (*place, 0, 0, s)) for place in places for s in (0, 1)]
    out += [Monomial(_AGAINST, (0, 0, 0, 0, s)) for s in (2, 3)]
    return tuple(out)


def effect_of(terms: Sequence[Monomial]) -> Effect:
    """Terms as physics inside the simulator; one coefficient each."""

    def forces(numbers: Floats, context: Context) -> tuple[Term, ...]:
        out = []
        for name in context.objects:
            for i, term in enumerate(terms):
                rest = np.tile([*term.powers, term.component], (len(numbers), 1))
                out.append(Term(Kind.LIBRARY, name, np.hstack([numbers[:, i : i + 1], rest])))
        return tuple(out)

    return Effect(
        name=NAME,
        channel="dynamics",
        quantities=tuple(Quantity(t.name, t.unit, -_LARGEST / t.size, _LARGEST / t.size, 0.02 / t.size) for t in terms),
        sentence="a force as proposed by regression",
        forces=forces,
    )


def regress(space: Space, objects: tuple[str, ...]) -> tuple[Formula, ...]:
    """The best formula on some movers with 1, 2, ... terms, up to what the residual asks for; none of noise."""
    terms = basis()
    candidate = Candidate(Attached(effect_of(terms), objects))
    units = np.diag([q.scale for q in candidate.attached.effect.quantities])
    weights = space.weights(candidate, np.zeros(len(terms)), units)
    information, pull = space.reduced(weights)
    c = space.likelihood.correlation_time
    size = np.sqrt(np.maximum(np.diag(information), 1e-12))
    scaled, pulled = information / np.outer(size, size) / c, pull / size / c
    out = []
    for chosen in _sparse(scaled, pulled, log(space.likelihood.measurements / c)):
        solved = -np.linalg.solve(scaled[np.ix_(chosen, chosen)], pulled[chosen]) / size[chosen]
        kept = tuple(terms[i] for i in chosen)
        attached = Attached(effect_of(kept), objects)
        low, high = (np.array([getattr(q, side) for q in attached.effect.quantities]) for side in ("low", "high"))
        numbers = np.clip(solved, low, high)
        gain = float(_gains(scaled, pulled, chosen[None])[0])
        tangent = space.tangent_of_weights(weights[:, :, chosen]) @ numbers
        out.append(Formula(kept, numbers, gain, Score(Candidate(attached), numbers, gain, tangent)))
    return tuple(out)


def _sparse(information: Floats, pull: Floats, price: float) -> list[Ints]:
    """Terms of the best sets of 1, 2, ..., up to the best size; columns have size one.

    `price` is the log of the number of measurements.
    """
    count = len(pull)
    best, kept = 0.0, 0
    found: list[Ints] = []
    for size in range(1, min(MOST_TERMS, count) + 1):
        if size <= EXHAUSTIVE:
            sets = np.array(list(combinations(range(count), size)))
        else:
            others = np.setdiff1d(np.arange(count), found[-1])
            sets = np.column_stack([np.tile(found[-1], (len(others), 1)), others])
        gains = _gains(information, pull, sets)
        found.append(sets[int(np.argmax(gains))])
        worth = float(gains.max()) - 0.5 * size * price - log(comb(count, size))
        if worth > best:
            best, kept = worth, size
    return found[:kept]


def _gains(information: Floats, pull: Floats, sets: Ints) -> Floats:
    """(S,) fall of the cost with each of (S, k) sets of terms."""
    inner = information[sets[:, :, None], sets[:, None, :]] + 1e-9 * np.eye(sets.shape[1])
    return np.asarray(0.5 * np.sum(pull[sets] * np.linalg.solve(inner, pull[sets][:, :, None])[:, :, 0], axis=1))


def propose(space: Space, held_out: Likelihood, iterations: int = 12) -> Proposal | None:
    """The formula, on all movers or on one, that predicts held-out episodes best; None where none of them gains.

    `held_out`: other episodes of the space's simulator, with the same prior. Terms are added while they gain there.
    """
    movers = space.pushes.movers
    sets = [movers] if len(movers) < 2 else [movers, *((m,) for m in movers)]
    by_objects = [formulas for formulas in (regress(space, objects) for objects in sets) if formulas]
    before = _excess(held_out, space.fit.point.values)
    if not by_objects or before <= 0:
        return None
    best, proposal = 0.0, None
    for formula in max(by_objects, key=lambda formulas: formulas[-1].gain - 5.0 * len(formulas)):
        joint = fit_jointly(space, [formula.score], iterations)
        gain = 1 - _excess(joint.likelihood.on(held_out), joint.fit.point.values) / before
        if gain < best + KEPT:
            break
        best, proposal = gain, _proposal(formula, joint, gain)
    return proposal


def _proposal(formula: Formula, joint: Joint, gain: float) -> Proposal:
    fitted = replace(formula, coefficients=joint.fit.point.values[-len(formula.terms) :])
    objects = " and ".join(formula.score.candidate.attached.objects)
    removed = f"removes {100 * gain:.0f} % of the held-out excess"
    sentence = f"a formula is proposed for {objects}, not named: {fitted.text} (SI), which {removed}."
    return Proposal(fitted, joint, gain, sentence)


def _excess(likelihood: Likelihood, values: Floats) -> float:
    """Mean squared residual above one, the noise floor; each episode has the launch that agrees best with it."""
    measured = ~np.isnan(likelihood.measured)
    return float(np.mean(residual_at(likelihood, with_launches(likelihood, values))[measured] ** 2)) - 1.0
