"""A driven robot whose parameters are drawn by chance, its virtual controller, and what would be recorded of both.

The controller moves every joint by a sum of sines (Swevers et al., IEEE Transactions on Robotics and Automation 13(5),
1997), sends a target every so often and reads the encoders, which count. Every quantity is drawn from a seed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from compass_ros.cells import Cell
from compass_ros.cells.drives import Drive
from compass_ros.cells.series import InputSpec
from compass_ros.errors import ConfigError
from compass_ros.simulation import Simulator
from compass_ros.types import Episode, Floats, Track

FIRST_NS = 1_700_000_000_000_000_000
_BETWEEN_NS = 10**11
"""From the start of one recording to that of the next."""
_SETTLED_S = 2.0
"""How long the first target was held before a recording begins."""


@dataclass(frozen=True)
class Routine:
    """What the virtual controller does."""

    seconds: float = 10.0
    rate_hz: float = 100.0
    """Of targets and of joint states."""
    harmonics: int = 4
    base_hz: float = 0.1
    """Sines have whole multiples of this frequency, spread from it to `fastest_hz`."""
    fastest_hz: float = 0.8
    reach: float = 0.6
    """Half-width of the motion of each joint [rad or m], at most, where its limits leave room."""


def drawn_truth(cell: Cell, seed: int) -> Floats:
    """(P,) each parameter uniform within its half-width around the default, inside the bounds."""
    wide = np.array([p.half_width for p in cell.parameters])
    low, high = (np.array([getattr(p, end) for p in cell.parameters]) for end in ("low", "high"))
    drawn = cell.defaults + wide * np.random.default_rng([seed, 11]).uniform(-1, 1, len(wide))
    return np.asarray(np.clip(drawn, low, high))


def excitation(limits: Floats, routine: Routine, seed: int) -> tuple[Floats, Floats]:
    """(n,) times [s] and (n, D) targets for joints with (D, 2) lowest and highest positions, infinite where free."""
    rng = np.random.default_rng([seed, 12])
    time = np.arange(0, routine.seconds, 1 / routine.rate_hz)
    highest = max(int(routine.fastest_hz / routine.base_hz), 1)
    out = np.zeros((len(time), len(limits)))
    for i, (low, high) in enumerate(limits):
        middle = 0.5 * (low + high) if np.isfinite([low, high]).all() else 0.0
        room = min(routine.reach, 0.45 * (high - low))
        orders = rng.choice(np.arange(1, highest + 1), min(routine.harmonics, highest), replace=False)
        phases = rng.uniform(0, 2 * np.pi, len(orders))
        waves = np.sin(2 * np.pi * routine.base_hz * np.outer(time, orders) + phases) / np.sqrt(orders)
        total = waves.sum(axis=1)
        out[:, i] = middle + room * total / np.abs(total).max()
    return time, out


def record(cell: Cell, truth: Floats, count: int, routine: Routine, seed: int, threads: int = 0) -> list[Episode]:
    """Recordings of the cell at (P,) true values; noise and steps are those of its signals.

    Raises ConfigError for a cell that is not driven by joint positions alone.
    """
    spec = _position_input(cell)
    simulator = Simulator(cell, threads=threads)
    limits = simulator.limits(spec.targets)
    tables = [excitation(limits, routine, 1000 * seed + i) for i in range(count)]
    simulator = simulator.driven([Drive((_held(time),), (_first_held(target),)) for time, target in tables])
    inputs = np.zeros((count, len(cell.input_names)))
    first = [name.rpartition(".")[0].rpartition(".")[2] for name in cell.input_names]
    for i, (_, target) in enumerate(tables):
        inputs[i, -1] = i
        for column, name in enumerate(cell.input_names):
            if name.endswith(".angle") and first[column] in spec.of:
                inputs[i, column] = target[0, spec.of.index(first[column])]
    seen_at = np.stack([_SETTLED_S + time for time, _ in tables])
    seen = simulator.observe(np.tile(truth, (count, 1)), simulator.inputs(inputs), seen_at)
    rng = np.random.default_rng([seed, 13])
    return [_episode(cell, i, tables[i], _measured(cell, seen[i], rng)) for i in range(count)]


def _position_input(cell: Cell) -> InputSpec:
    inputs = cell.spec.inputs
    if len(inputs) != 1 or inputs[0].quantity != "joint_position" or inputs[0].to != "ctrl":
        raise ConfigError(
            f"{cell.path}: inputs: the virtual controller sends joint positions to actuators, nothing else"
        )
    return inputs[0]


def _held(time: Floats) -> Floats:
    return np.concatenate([[0.0], _SETTLED_S + time])


def _first_held(target: Floats) -> Floats:
    return np.concatenate([target[:1], target])


def _measured(cell: Cell, seen: Floats, rng: np.random.Generator) -> Floats:
    """(F, C) what the sensors say: white noise, then whole steps."""
    out = seen.copy()
    for signal in cell.signals:
        noisy = out[:, signal.columns] + (signal.noise or 0.0) * rng.normal(size=(len(seen), signal.size))
        out[:, signal.columns] = signal.step * np.round(noisy / signal.step) if signal.step else noisy
    return out


def _episode(cell: Cell, index: int, table: tuple[Floats, Floats], measured: Floats) -> Episode:
    start = FIRST_NS + index * _BETWEEN_NS
    stamps = start + np.round(table[0] * 1e9).astype(np.int64)
    tracks = tuple(Track(s.name, s.quantity, stamps, measured[:, s.columns]) for s in cell.signals)
    target = Track(cell.spec.inputs[0].name, "joint_position", stamps, table[1])
    return Episode(f"motion_{index:02d}", cell.name, cell.hash, {}, start, tracks, inputs=(target,))
