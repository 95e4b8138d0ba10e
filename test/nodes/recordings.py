"""Bags of shots that a simulator with known, wrong parameters has played."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from compass_ros.cells import load
from compass_ros.episodes import write_episode
from compass_ros.simulation import Simulator
from compass_ros.types import Episode, Track

START_NS = 1_700_000_000_000_000_000
FRAME_S = 1 / 60
NOISE_M = 3e-4


def record(folder: Path, truth: Mapping[str, float], shots: int, seed: int) -> list[Path]:
    """Write `shots` bags of the air-hockey cell, as a tracker with 0.3 mm of noise at 60 Hz would see them."""
    cell = load("air_hockey")
    simulator = Simulator(cell)
    rng = np.random.default_rng(seed)
    low, high = np.array([(field.low, field.high) for field in cell.action]).T
    inputs = rng.uniform(low, high, (shots, len(low)))
    time_s = np.arange(0, cell.duration, FRAME_S)
    seen = simulator.observe(
        np.tile(cell.values(truth), (shots, 1)), inputs, np.tile(time_s, (shots, 1))
    )  # (shots, frames, channels)
    seen = seen + rng.normal(0, NOISE_M, seen.shape)
    columns = np.array(cell.channels)
    stamps = START_NS + np.round(time_s * 1e9).astype(np.int64)
    std = np.full(len(stamps), NOISE_M)
    return [
        write_episode(
            Episode(
                name=f"shot{shot}",
                cell=cell.name,
                cell_hash=cell.hash,
                action=dict(zip((field.name for field in cell.action), inputs[shot].tolist(), strict=True)),
                start_ns=START_NS,
                tracks=tuple(
                    Track(one.name, one.quantity, stamps, seen[shot][:, columns == one.name], std)
                    for one in cell.objects
                ),
            ),
            folder,
        )
        for shot in range(shots)
    ]
