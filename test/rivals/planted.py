"""Shots on the air-hockey table with a known effect and known parameters, as the rivals get them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from compass_ros.calibration.noise import Noise
from compass_ros.cells import load
from compass_ros.rivals.calibrated import Calibrated, beside
from compass_ros.simulation import Simulator
from compass_ros.simulation.effects import Attached
from compass_ros.simulation.effects.registry import EFFECTS
from compass_ros.simulation.replay import Recordings
from compass_ros.types import Floats

INPUTS = np.array(
    [
        [-0.225, 0.075, 0.05, 0.5],
        [-0.21, 0.06, -0.2, 0.7],
        [-0.15, -0.118, 0.059, 0.75],
        [-0.22, 0.10, 0.1, 0.6],
        [-0.25, -0.05, -0.1, 0.8],
        [-0.20, 0.02, 0.15, 0.65],
        [-0.23, 0.085, -0.1, 0.55],
        [-0.18, -0.09, 0.1, 0.7],
    ]
)
HELD_OUT = 2


def played(
    effects: Sequence[tuple[str, tuple[str, ...], Sequence[float]]] = (), sigma: float = 1e-3, seed: int = 0
) -> Calibrated:
    """Recordings of the effects (name, bodies, quantities), beside the simulator without them."""
    simulator = Simulator(load("air_hockey"), threads=1)
    attached = [Attached(EFFECTS[name], objects) for name, objects, _ in effects]
    truth = simulator.with_effects(attached)
    values = np.concatenate([simulator.defaults, *(np.asarray(numbers, float) for *_, numbers in effects)])
    time_s = np.tile(np.arange(-10, 150) / 60, (len(INPUTS), 1))
    measured = truth.observe(np.tile(values, (len(INPUTS), 1)), INPUTS, time_s)
    measured = measured + sigma * np.random.default_rng(seed).standard_normal(measured.shape)
    first = len(INPUTS) - HELD_OUT
    data, judge = (_recordings(time_s[s], INPUTS[s], measured[s]) for s in (slice(first), slice(first, None)))
    nothing = np.zeros((len(simulator.defaults), 1))
    return beside(simulator, simulator.defaults, nothing, data, judge, Noise(np.full(4, sigma), 0.0))


def _recordings(time_s: Floats, inputs: Floats, measured: Floats) -> Recordings:
    names = tuple(f"shot {i}" for i in range(len(inputs)))
    steps, said, std = np.zeros((len(inputs), 0, 4)), np.full(4, -np.inf), np.zeros(inputs.shape[1])
    return Recordings(names, inputs, time_s, measured, np.zeros(0), steps, said, std)
