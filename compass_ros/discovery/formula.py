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
from scipy.optimize import lsq_linear, minimize_scalar

from compass_ros.calibration.likelihood import Likelihood
from compass_ros.calibration.refine import with_launches
from compass_ros.calibration.residuals import residual_at
from compass_ros.discovery.candidates import ALIKE, Candidate, candidates, together_and_alone
from compass_ros.discovery.joint import Joint, fit_jointly
from compass_ros.discovery.screen import Score, Space
from compass_ros.simulation.effects import Attached, Effect, Quantity
from compass_ros.simulation.effects.effect import Context
from compass_ros.simulation.native.program import Kind, Term
from compass_ros.simulation.sites import JOINTS, PLANAR, names_of
from compass_ros.simulation.sizes import LARGEST, MODEST, JointSize, alike
from compass_ros.simulation.visited import Visited
from compass_ros.types import Floats, Ints

NAME = "formula"
EXHAUSTIVE = 3
"""Number of terms up to which every set is tried."""
MOST_TERMS = 6
KEPT = 0.1
"""Share of the excess held-out error that a formula has to remove to be kept."""
IS = 0.05
"""Root mean square difference along the recorded ways, as a share, up to which a formula is a law of the library."""
_ALONG_X, _ALONG_Y, _AGAINST = 0, 1, 2


@dataclass(frozen=True)
class Variables:
    """What a formula is written in, and how large it is. Joints: the position q and the speed; SI."""

    names: tuple[str, str, str, str, str]
    """Of x, y, vx, vy and speed."""
    heads: tuple[str, str, str]
    """Of the components: along x, along y, against the velocity."""
    sizes: tuple[float, float, float, float, float]
    largest: float
    """Acceleration (joints: force) that one term may reach at these sizes."""
    force_unit: str = "m s^-2"
    length_unit: str = "m"


TABLE = Variables(("x", "y", "vx", "vy", "speed"), ("ax", "ay", "slowing"), (0.45, 0.225, 0.5, 0.5, 0.5), 3.0)
"""The edges of an air-hockey table, and the speed of its pucks."""


def of_joint(size: JointSize) -> Variables:
    """The ends of its way, its speed, and the forces that it saw."""
    far, head = abs(size.middle) + 2 * size.spread, "torque" if size.kind == "hinge" else "force"
    sizes = (far, 1.0, size.speed, 1.0, size.speed)
    names, heads = ("q", "", "", "", "speed"), (head, "", f"slowing {head}")
    return Variables(names, heads, sizes, LARGEST * size.force, size.force_unit, size.length_unit)


@dataclass(frozen=True)
class Monomial:
    """One term: a component of the acceleration, and powers of x, y, vx, vy and speed."""

    component: int
    """0 along x, 1 along y, 2 against the velocity."""
    powers: tuple[int, int, int, int, int]
    of: Variables = TABLE

    @property
    def size(self) -> float:
        """Its value at the sizes of its variables."""
        return float(np.prod([v**p for v, p in zip(self.of.sizes, self.powers, strict=True)]))

    @property
    def unit(self) -> str:
        """Of its coefficient."""
        lengths, seconds = sum(self.powers), sum(self.powers[2:])
        parts = [part.partition("^") for part in self.of.force_unit.split()]
        counted = {base: int(power or 1) for base, _, power in parts}
        counted[self.of.length_unit] = counted.get(self.of.length_unit, 0) - lengths
        counted["s"] = counted.get("s", 0) + seconds
        return " ".join(f"{base}^{power}" if power != 1 else base for base, power in counted.items() if power) or "1"

    @property
    def text(self) -> str:
        named = zip(self.of.names, self.powers, strict=True)
        return " ".join(f"{v}^{p}" if p > 1 else v for v, p in named if p)

    @property
    def name(self) -> str:
        """As a name of a quantity."""
        head = self.of.heads[self.component].replace(" ", "_")
        named = zip(self.of.names, self.powers, strict=True)
        return "_".join([head, *(f"{v}{p}" if p > 1 else v for v, p in named if p)])


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
        for component, head in enumerate(self.terms[0].of.heads):
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
def basis(of: Variables = TABLE) -> tuple[Monomial, ...]:
    """Fields up to the third degree in place, couplings to velocity, and slowing that depends on speed and place.

    On a joint there is one direction: a force that couples to its velocity is slowing.
    """
    out: list[Monomial] = []
    flat = bool(of.names[1])
    for component in (_ALONG_X, _ALONG_Y) if flat else ():
        out += [Monomial(component, (i, j, 0, 0, 0), of) for i in range(4) for j in range(4 - i)]
        out += [Monomial(component, (0, 0, *v, s), of) for v in ((1, 0), (0, 1)) for s in (0, 1)]
    out += [Monomial(_ALONG_X, (i, 0, 0, 0, 0), of) for i in range(4)] if not flat else []
    places = [(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2)] if flat else [(0, 0), (1, 0), (2, 0)]
    out += [Monomial(_AGAINST, (*place, 0, 0, s), of) for place in places for s in (0, 1)]
    out += [Monomial(_AGAINST, (0, 0, 0, 0, s), of) for s in (2, 3)]
    return tuple(out)


def effect_of(terms: Sequence[Monomial]) -> Effect:
    """Terms as physics inside the simulator; one coefficient each."""

    def forces(numbers: Floats, context: Context) -> tuple[Term, ...]:
        out = []
        for site in context.sites:
            for i, term in enumerate(terms):
                rest = np.tile([*term.powers, term.component], (len(numbers), 1))
                out.append(Term(Kind.LIBRARY, site, np.hstack([numbers[:, i : i + 1], rest])))
        return tuple(out)

    def quantity(t: Monomial) -> Quantity:
        most = t.of.largest / t.size
        return Quantity(t.name, t.unit, -most, most, 0.02 / t.size if t.of is TABLE else MODEST / LARGEST * most)

    return Effect(
        name=NAME,
        channel="dynamics",
        quantities=tuple(quantity(t) for t in terms),
        sentence="a force as proposed by regression",
        on=(*PLANAR, *JOINTS),
        forces=forces,
    )


def regress(space: Space, objects: tuple[str, ...], of: Variables = TABLE) -> tuple[Formula, ...]:
    """The best formula on some movers with 1, 2, ... terms, up to what the residual asks for; none of noise."""
    terms = basis(of)
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
    by_objects = [formulas for formulas in (regress(space, *one) for one in _movers(space)) if formulas]
    before = _excess(held_out, space.fit.point.values)
    if not by_objects or before <= 0:
        return None
    best, proposal = 0.0, None
    for formula in max(by_objects, key=lambda formulas: formulas[-1].gain - 5.0 * len(formulas)):
        joint = fit_jointly(space, [formula.score], iterations)
        gain = 1 - _excess(joint.likelihood.on(held_out), joint.fit.point.values) / before
        if gain < best + KEPT:
            break
        best, proposal = gain, _proposal(space, formula, joint, gain)
    return proposal


def _movers(space: Space) -> list[tuple[tuple[str, ...], Variables]]:
    """The movers of a kind together, and each alone, with what a formula on them is written in."""
    sizes = Visited(space.simulator, *space.told).joint_sizes()
    moving = space.simulator.moving.values()
    of_kinds = [[site for site in moving if site.kind in kinds] for kinds in ALIKE]
    sets = [names_of(chosen) for own in of_kinds for chosen in together_and_alone(own)]
    return [(names, of_joint(alike([sizes[n] for n in names])) if names[0] in sizes else TABLE) for names in sets]


def _proposal(space: Space, formula: Formula, joint: Joint, gain: float) -> Proposal:
    fitted = replace(formula, coefficients=joint.fit.point.values[-len(formula.terms) :])
    objects = " and ".join(formula.score.candidate.attached.objects)
    removed = f"removes {100 * gain:.0f} % of the held-out excess"
    known = spelled(space, fitted)
    that = f"; that is {' and '.join(known)} of the library" if known else ""
    sentence = f"a formula is proposed for {objects}, not named: {fitted.text} (SI), which {removed}{that}."
    return Proposal(fitted, joint, gain, sentence)


def spelled(space: Space, formula: Formula) -> list[str]:
    """Laws of the library that a formula is, along the recorded ways: one for the whole of it, or one for a term each.

    Compared are the accelerations, so that it does not matter how either of them is written.
    """
    objects = formula.score.candidate.attached.objects
    laws = [c for c in candidates(space.simulator, *space.told) if c.by_force and c.attached.objects == objects]
    units = np.eye(len(formula.terms)) * [q.scale for q in formula.score.candidate.attached.effect.quantities]
    columns = space.weights(formula.score.candidate, np.zeros(len(formula.terms)), units)
    parts = columns.reshape(-1, len(formula.terms)) * formula.coefficients
    whole = _law_of(space, laws, parts.sum(axis=1))
    return [whole] if whole else [law for part in parts.T if (law := _law_of(space, laws, part))]


def _law_of(space: Space, laws: Sequence[Candidate], wanted: Floats) -> str:
    """The law of at most one shape that comes nearest to (H,) accelerations, if it is the same; else empty."""
    found = [(_apart(space, law, wanted), law.name) for law in laws]
    left, best = min(found, default=(np.inf, ""))
    return best if left < IS else ""


def _apart(space: Space, law: Candidate, wanted: Floats) -> float:
    """Share of (H,) accelerations that a law within its bounds leaves, at its best amplitudes and shape."""
    quantities = law.attached.effect.quantities
    amplitudes = [i for i, q in enumerate(quantities) if q.amplitude]
    shapes = [i for i, q in enumerate(quantities) if not q.amplitude]
    low, high, scale = (np.array([getattr(quantities[i], of) for i in amplitudes]) for of in ("low", "high", "scale"))
    size = float(np.linalg.norm(wanted))
    if size == 0 or len(shapes) > 1 or not law.attached.effect.superposes:
        return np.inf

    def left(shape: float) -> float:
        numbers = np.zeros(len(quantities))
        numbers[shapes] = shape
        units = np.diag([q.scale for q in quantities])[amplitudes]
        columns = space.weights(law, numbers, units).reshape(-1, len(amplitudes)) * scale / size
        solved = lsq_linear(columns, wanted / size, (low / scale, high / scale))
        return float(np.linalg.norm(wanted / size - columns @ solved.x))

    if not shapes:
        return left(0.0)
    bounds = (quantities[shapes[0]].low, quantities[shapes[0]].high)
    return left(float(minimize_scalar(left, bounds=bounds, method="bounded").x))


def _excess(likelihood: Likelihood, values: Floats) -> float:
    """Mean squared residual above one, the noise floor; each episode has the launch that agrees best with it."""
    measured = ~np.isnan(likelihood.measured)
    return float(np.mean(residual_at(likelihood, with_launches(likelihood, values))[measured] ** 2)) - 1.0
