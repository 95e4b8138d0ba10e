"""A driven robot whose parameters are drawn by chance, its virtual controller, and what would be recorded of both.

The controller moves every joint by a sum of sines (Swevers et al., IEEE Transactions on Robotics and Automation 13(5),
1997), sends a target every so often and reads the encoders, which count. Every quantity is drawn from a seed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from compass_ros.cells import Cell
from compass_ros.errors import ConfigError
from compass_ros.simulation import Simulator
from compass_ros.simulation.driven import driven_joints, virtual_recordings
from compass_ros.types import Episode, Floats


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
    simulator = Simulator(cell, threads=threads)
    driven = driven_joints(simulator)
    if driven.spec.quantity != "joint_position":
        raise ConfigError(f"{cell.path}: inputs: the virtual controller sends joint positions, nothing else")
    limits = simulator.limits(driven.spec.targets)
    tables = [excitation(limits, routine, 1000 * seed + i) for i in range(count)]
    series = np.stack([target for _, target in tables])
    rng = np.random.default_rng([seed, 13])
    return virtual_recordings(simulator, driven, truth, tables[0][0], series, series[:, 0], rng)
