"""The library of terms: the effects that our discovery knows in the channel `dynamics`, as columns of a regression.

The accelerations are those of the simulator's own formulas, so that a term means the same for both methods. A shape (a
centre, a radius, a frequency) is not linear: of a grid, the one whose columns explain most is taken.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from compass_ros.discovery.shapes import shape_grid
from compass_ros.rivals.accelerations import Samples
from compass_ros.simulation import Simulator
from compass_ros.simulation.effects import Attached, Effect
from compass_ros.simulation.effects.registry import EFFECTS
from compass_ros.types import Floats

NUISANCE = "coulomb_friction"
"""A parameter of the cell takes this; each body has a column of it, and it is never a name."""
_DIRECTIONS = 12


@dataclass(frozen=True)
class Block:
    """The columns of one effect at one shape."""

    effect: Effect
    shapes: Floats
    """(q,) quantities of the effect, amplitudes zero."""
    units: Floats
    """(k, q) amplitudes of each column."""
    columns: Floats
    """(2 n, k) accelerations [m/s^2]."""

    def numbers(self, coefficients: Floats) -> Floats:
        """(q,) quantities of the effect with (k,) coefficients, within their bounds."""
        low, high = (np.array([getattr(q, side) for q in self.effect.quantities]) for side in ("low", "high"))
        return np.asarray(np.clip(self.shapes + coefficients @ self.units, low, high))


def named_effects(simulator: Simulator, movers: Sequence[str]) -> list[Effect]:
    """Forces on moving bodies that the cell can have."""
    return [
        effect
        for name, effect in EFFECTS.items()
        if effect.channel == "dynamics" and effect.moves and effect.forces is not None
        and name != NUISANCE and simulator.accepts(effect, movers)
    ]  # fmt: skip


def nuisance(simulator: Simulator, values: Floats, movers: Sequence[str], samples: Samples) -> Floats:
    """(2 n, N) dry friction, a column for each body."""
    columns = []
    for i in range(len(movers)):
        own = samples.of(samples.mover == i)
        part = np.zeros((len(samples.time), 2))
        part[samples.mover == i] = _accelerations(simulator, values, movers, own, EFFECTS[NUISANCE], np.ones((1, 1)))[0]
        columns.append(part.ravel())
    return np.stack(columns, axis=1)


def best_block(
    simulator: Simulator, values: Floats, movers: Sequence[str], samples: Samples, effect: Effect, off: Floats
) -> Block:
    """The shape of an effect whose columns explain most; `off` (2 n, m) orthonormal, is taken out before."""
    left = samples.acceleration.ravel() - off @ (off.T @ samples.acceleration.ravel())
    best, most = None, -1.0
    scale = np.array([q.scale for q in effect.quantities])
    amplitude_of = [i for i, q in enumerate(effect.quantities) if q.amplitude]
    unit = np.diag(scale)[amplitude_of]
    angles = np.linspace(0, 2 * np.pi, _DIRECTIONS, endpoint=False)
    cases = [unit] if effect.superposes else [(np.cos(a) * unit[0] + np.sin(a) * unit[1])[None] for a in angles]
    shapes = _shapes(effect)
    for units in cases:
        numbers = (shapes[:, None] + units[None]).reshape(-1, len(scale))
        columns = _accelerations(simulator, values, movers, samples, effect, numbers)
        columns = columns.reshape(len(shapes), len(units), -1).transpose(0, 2, 1)
        projected = columns - off @ (off.T @ columns)
        for shape, raw, inner in zip(shapes, columns, projected, strict=True):
            basis, size, _ = np.linalg.svd(inner, full_matrices=False)
            explained = float(np.sum((basis[:, size > 1e-6 * max(float(size[0]), 1e-12)].T @ left) ** 2))
            if explained > most:
                best, most = Block(effect, shape, units, raw), explained
    assert best is not None  # every effect has a shape
    return best


def _shapes(effect: Effect) -> Floats:
    """(S, q) a grid over the quantities that are no amplitudes."""
    axes = [np.zeros(1) if q.amplitude else shape_grid(q) for q in effect.quantities]
    return np.array(list(product(*axes)))


def _accelerations(
    simulator: Simulator, values: Floats, movers: Sequence[str], samples: Samples, effect: Effect, numbers: Floats
) -> Floats:
    """(B, n, 2) accelerations of an effect with (B, q) numbers in the measured states [m/s^2]."""
    out = np.zeros((len(numbers), len(samples.time), 2))
    masses = simulator.masses(values, movers)
    for i, name in enumerate(movers):
        own = samples.mover == i
        if own.any():
            mass = np.full((int(own.sum()), 1), masses[i])
            states = np.hstack([samples.state[own], mass, samples.time[own, None]])[:, None, :]
            tiled = np.ascontiguousarray(np.broadcast_to(states, (len(numbers), *states.shape)))
            out[:, own] = simulator.forces(Attached(effect, (name,)), numbers, values, tiled)[name] / masses[i]
    return out
