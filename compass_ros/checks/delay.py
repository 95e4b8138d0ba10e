"""How long after a command the motion follows that is most like it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from compass_ros.cells import Cell
from compass_ros.simulation import Simulator
from compass_ros.types import Episode, Floats, Track

_NS = 1e-9
LATEST_S = 1.0
"""Longest delay that is looked for."""
ALIKE = 0.8
"""Least correlation of command and motion for which there is a delay."""


@dataclass(frozen=True)
class Command:
    """What a robot was told in one recording."""

    time_s: Floats
    """(n,) since its start, increasing."""
    value: Floats
    """(n, U) in force from then on."""

    def at(self, time_s: Floats) -> Floats:
        """(S, U) what is in force at (S,) times; before the first one, that."""
        index = np.searchsorted(self.time_s, time_s + 1e-9, side="right") - 1
        return np.asarray(self.value[np.maximum(index, 0)])


def given(cell: Cell, recordings: Mapping[str, Episode]) -> Mapping[str, Command]:
    """By recording: its recorded inputs, or what its action makes of the actuators; empty where nothing is told."""
    if cell.spec.inputs:
        series = {name: [_recorded(t, e) for t in e.inputs if len(t.stamp_ns)] for name, e in recordings.items()}
        return {name: _together(own) for name, own in series.items() if own}
    if not cell.action:
        return {}
    simulator = Simulator(cell, threads=1)
    steps = round(cell.duration / simulator.time_step)
    inputs = simulator.inputs(np.stack([cell.inputs(e) for e in recordings.values()]))
    told = simulator.physics.controls(np.tile(simulator.defaults, (len(recordings), 1)), inputs, steps)
    time = simulator.time_step * np.arange(steps)
    return {} if told is None else {name: Command(time, told[i]) for i, name in enumerate(recordings)}


def _recorded(track: Track, episode: Episode) -> Command:
    seen = ~np.isnan(track.value).any(axis=1)
    return Command((track.stamp_ns[seen] - episode.start_ns) * _NS, track.value[seen])


def _together(commands: Sequence[Command]) -> Command:
    """All inputs of one recording at the times of the first."""
    time = commands[0].time_s
    return Command(time, np.concatenate([one.at(time) for one in commands if len(one.time_s)], axis=1))


def delay(command: Floats, measured: Floats, step_s: float) -> float:
    """By how much (S, C) positions follow (S, U) commands [s]: where they are most alike.

    Positions are compared with commands (a position servo), and changes of positions with commands (a velocity drive).
    NaN where no pair has a correlation of ALIKE at any delay from 0 to LATEST_S, or where the commands do not change.
    """
    moves = np.diff(measured, axis=0, append=measured[-1:])
    best, at = ALIKE, float("nan")
    for lag in range(min(round(LATEST_S / step_s), len(measured) - 3) + 1):
        told = command[: len(command) - lag]
        for followed in (measured[lag:], moves[lag:]):
            alike = _correlation(told, followed)
            if alike > best:
                best, at = alike, lag * step_s
    return at


def _correlation(one: Floats, other: Floats) -> float:
    """The largest of any column of (S, U) with any of (S, C), by its size."""
    one, other = one - one.mean(axis=0), other - other.mean(axis=0)
    size = np.outer(np.linalg.norm(one, axis=0), np.linalg.norm(other, axis=0))
    return float(np.max(np.abs(one.T @ other) / np.where(size > 1e-12, size, np.inf)))
