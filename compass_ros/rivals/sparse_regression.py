"""Sparse regression on residual accelerations, as SINDy does it (Brunton, Proctor and Kutz 2016), with pysindy.

The rival gets every help: our library of effects as its terms with the best shapes of a grid, friction taken out first,
two of pysindy's optimisers (STLSQ, and the forward selection FROLS) and each effect alone, and smoothing window,
selection and bodies chosen by the error on the held-out episodes, which is also the error that is told. Among models
that predict nearly as well the one with the fewest effects is taken; none where none gains.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from compass_ros.rivals.accelerations import Samples, accelerations
from compass_ros.rivals.calibrated import Calibrated, rms
from compass_ros.rivals.terms import NUISANCE, Block, best_block, named_effects, nuisance
from compass_ros.simulation.effects import Attached
from compass_ros.simulation.effects.registry import EFFECTS
from compass_ros.types import Floats

with warnings.catch_warnings():
    warnings.simplefilter("ignore")  # it asks for its own version in a way that setuptools takes away one day
    from pysindy.optimizers import FROLS, STLSQ, BaseOptimizer

WINDOWS_S = (0.12, 0.2, 0.3, 0.45, 0.7)
THRESHOLDS = (0.002, 0.005, 0.01, 0.02, 0.05)
"""Least acceleration, rms along the recordings and beyond friction, for which a term is kept [m/s^2]."""
TERMS = (1, 2, 3)
"""Sizes of the models of the forward selection."""
LEAST_GAIN = 0.05
"""Share of the mean squared held-out error by which a model must lower it to be believed."""
NEARLY = 0.02
"""Share of the mean squared held-out error within which fewer effects are preferred."""
LEAST_SAMPLES = 20


@dataclass(frozen=True)
class Model:
    """One regression, put into the simulator."""

    window_s: float
    optimiser: str
    effects: tuple[tuple[Attached, Floats], ...]
    """Named effects with their quantities, then dry friction by body."""
    held_out_m: float

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(sorted(a.effect.name for a, _ in self.effects if a.effect.name != NUISANCE))


def sparse_regression(given: Calibrated, windows_s: Sequence[float] = WINDOWS_S) -> Model | None:
    """The chosen model; None where no model predicts the held-out episodes better than the calibrated simulator."""
    models = [model for window in windows_s for model in _of_window(given, window)]
    plain = rms(given.held_out.predicted, given.held_out.data.measured)
    models = [m for m in models if m.held_out_m**2 < (1 - LEAST_GAIN) * plain**2]
    if not models:
        return None
    limit = min(m.held_out_m**2 for m in models) * (1 + NEARLY)
    return min((m for m in models if m.held_out_m**2 <= limit), key=lambda m: (len(m.names), m.held_out_m))


def optimisers() -> Mapping[str, BaseOptimizer]:
    """By their names in the note; columns have size one, so a threshold is an acceleration."""
    return {f"STLSQ {t:g} m/s^2": STLSQ(threshold=t) for t in THRESHOLDS} | {
        f"FROLS {n}": FROLS(max_iter=n, alpha=1e-6) for n in TERMS
    }


def regress(columns: Floats, target: Floats, optimiser: BaseOptimizer) -> Floats:
    """(k,) coefficients of (r, k) columns for (r,) targets, most of them zero."""
    size = np.sqrt(np.mean(columns**2, axis=0))
    used = size > 1e-9
    out = np.zeros(len(size))
    if used.any():
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", message="Sparsity parameter is too big")
            warnings.filterwarnings("ignore", message="STLSQ._reduce did not converge")
            fitted = optimiser.fit(columns[:, used] / size[used], target[:, None])
        out[used] = fitted.coef_[0] / size[used]
    return out


def residual_accelerations(given: Calibrated, recorded: Samples, simulated: Samples) -> Samples:
    """What the recorded accelerations have beyond the calibrated simulator's.

    The simulated track runs a little apart from the recorded one, so its friction is turned into the recorded
    direction: taken from where the simulated body is, put where the recorded one is.
    """
    there, here = (nuisance(given.simulator, given.values, given.movers, s) for s in (simulated, recorded))
    size, *_ = np.linalg.lstsq(there, simulated.acceleration.ravel(), rcond=None)
    moved = ((here - there) @ size).reshape(-1, 2)
    return replace(recorded, acceleration=recorded.acceleration - simulated.acceleration - moved)


def _of_window(given: Calibrated, window_s: float) -> list[Model]:
    """The models of one window: effects on all bodies, or on one."""
    everything = residual_accelerations(given, *accelerations(given, given.fit, window_s))
    sets = [tuple(range(len(given.movers)))]
    sets += [(i,) for i in sets[0]] if len(given.movers) > 1 else []
    out: dict[tuple[object, ...], Model] = {}
    for chosen in sets:
        samples = everything.of(np.isin(everything.mover, chosen))
        if len(samples.time) < LEAST_SAMPLES:
            continue
        objects = tuple(given.movers[i] for i in chosen)
        slid, off, blocks = _library(given, samples)
        for name, coefficients in _selections(off, blocks, samples.acceleration.ravel()):
            joined = np.hstack([b.columns for b in blocks])
            friction, *_ = np.linalg.lstsq(off, samples.acceleration.ravel() - joined @ coefficients, rcond=None)
            effects = _effects(objects, blocks, coefficients, dict(zip(slid, friction, strict=True)))
            key = (chosen, tuple(np.round(coefficients, 9)))
            if key not in out and any(a.effect.name != NUISANCE for a, _ in effects):
                out[key] = Model(window_s, name, effects, _held_out(given, effects))
    return list(out.values())


def _selections(off: Floats, blocks: Sequence[Block], target: Floats) -> Iterator[tuple[str, Floats]]:
    """(k,) coefficients of all blocks' columns: by each optimiser from all terms, and with each effect alone."""
    base, _ = np.linalg.qr(off)
    joined = np.hstack([b.columns for b in blocks])
    inner, left = joined - base @ (base.T @ joined), target - base @ (base.T @ target)
    for name, optimiser in optimisers().items():
        yield name, regress(inner, left, optimiser)
    at = 0
    for block in blocks:
        own = slice(at, at + len(block.units))
        coefficients = np.zeros(joined.shape[1])
        coefficients[own] = np.linalg.lstsq(inner[:, own], left, rcond=None)[0]
        yield "one effect", coefficients
        at = own.stop


def _library(given: Calibrated, samples: Samples) -> tuple[tuple[str, ...], Floats, list[Block]]:
    """The bodies that there are samples of, a column of friction for each, and a block for each named effect."""
    slid = np.unique(samples.mover)
    friction = nuisance(given.simulator, given.values, given.movers, samples)[:, slid]
    base, _ = np.linalg.qr(friction)
    effects = named_effects(given.simulator, given.movers)
    blocks = [best_block(given.simulator, given.values, given.movers, samples, e, base) for e in effects]
    return tuple(given.movers[i] for i in slid), friction, blocks


def _effects(
    objects: tuple[str, ...], blocks: Sequence[Block], coefficients: Floats, friction: Mapping[str, float]
) -> tuple[tuple[Attached, Floats], ...]:
    """What survived, within the bounds of its quantities: a drag that drives is no drag."""
    out, at = [], 0
    for block in blocks:
        own = coefficients[at : at + len(block.units)]
        at += len(block.units)
        attached, numbers = Attached(block.effect, objects), block.numbers(own)
        if own.any() and attached.present(numbers[None]):
            out.append((attached, numbers))
    out += [(Attached(EFFECTS[NUISANCE], (name,)), np.array([extra])) for name, extra in friction.items()]
    return tuple(out)


def _held_out(given: Calibrated, effects: Sequence[tuple[Attached, Floats]]) -> float:
    """rms on the held-out episodes with the effects inside the simulator [m]."""
    simulator = given.simulator.with_effects([a for a, _ in effects])
    values = np.concatenate([given.values, *(numbers for _, numbers in effects)])
    data = given.held_out.data
    return rms(given.predict(simulator, values, data), data.measured)
