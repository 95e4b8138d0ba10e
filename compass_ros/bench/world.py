"""A sim-to-sim world: the cell with the paper's target values plays the "real" one, with a tracker's noise on top."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from compass_ros.bench.case import Case
from compass_ros.calibration.problem import Problem
from compass_ros.cells import Cell, load
from compass_ros.errors import ConfigError
from compass_ros.posing import noise_of, pose
from compass_ros.simulation import Simulator
from compass_ros.simulation.replay import Replay, recordings
from compass_ros.types import QUANTITY_SIZE, Episode, Floats, Track

RATE_HZ = 60.0
STILL_S = 0.25
"""Seconds that a recording begins before the command."""
HELD_OUT = 10
"""Shots that no method sees; their actions depend on the seed alone."""


@dataclass(frozen=True)
class World:
    """What a case is played on."""

    cell: Cell
    problem: Problem
    truth: Floats
    """(P,) the target values."""
    causal: tuple[int, ...]
    """Indices of the parameters that the paper found to be causes; those with a target where it names none."""
    clean: Replay
    """Held-out shots without noise."""
    noisy: Replay
    """The same with the case's noise and missing frames."""
    simulator: Simulator
    """The one that `problem` asks; counts rollouts and simulated seconds."""


def build(case: Case, threads: int = 0) -> World:
    """Play and record the shots of a case. Raises ConfigError where the cell has no target values."""
    cell = load(case.task, case.parameters)
    truth = np.array([s.truth for s in cell.spec.parameters])
    if all(s.target is None for s in cell.spec.parameters):
        raise ConfigError(
            f"{cell.path}: no parameter has a target; a benchmark needs the values of the simulated real cell"
        )
    random = np.random.default_rng([case.seed, 1])
    judge = np.random.default_rng([case.seed, 2])
    simulator, teacher = Simulator(cell, threads=threads), Simulator(cell, threads=threads)
    fit = _shots(teacher, truth, case.real, case.noise_m, case.missing, random)
    actions = _actions(cell, HELD_OUT, judge)
    clean = _record(teacher, truth, actions, 0.0, 0.0, judge)
    noisy = _record(teacher, truth, actions, case.noise_m, case.missing, judge)
    data = recordings(cell, fit)
    problem = pose(simulator, data, noise_of(cell, data))
    if case.start == "random":
        drawn = problem.low + (problem.high - problem.low) * np.random.default_rng([case.seed, 3]).random(len(truth))
        problem = replace(problem, start=drawn, likelihood=replace(problem.likelihood, prior_mean=drawn))
    names = [p.name for p in cell.parameters]
    causal = cell.spec.causal or tuple(s.name for s in cell.spec.parameters if s.target is not None)
    indices = tuple(names.index(name) for name in causal)
    judges = Simulator(cell, threads=threads)
    clean_replay, noisy_replay = (Replay(judges, recordings(cell, shots)) for shots in (clean, noisy))
    return World(cell, problem, truth, indices, clean_replay, noisy_replay, simulator)


def _actions(cell: Cell, count: int, random: np.random.Generator) -> Floats:
    """(count, A) uniform in the action space."""
    low, high = (np.array([getattr(a, end) for a in cell.action]) for end in ("low", "high"))
    return np.asarray(low + (high - low) * random.random((count, len(cell.action))))


def _shots(
    teacher: Simulator, truth: Floats, count: int, noise: float, missing: float, random: np.random.Generator
) -> list[Episode]:
    return _record(teacher, truth, _actions(teacher.cell, count, random), noise, missing, random)


def _record(
    teacher: Simulator, truth: Floats, actions: Floats, noise: float, missing: float, random: np.random.Generator
) -> list[Episode]:
    """Episodes as a tracker would write them."""
    cell = teacher.cell
    start_ns = 1_000_000_000
    offsets = np.arange(-STILL_S, cell.duration + 1e-9, 1 / RATE_HZ)
    stamps = start_ns + np.round(offsets * 1e9).astype(np.int64)
    time = np.tile((stamps - start_ns) * 1e-9, (len(actions), 1))
    seen = teacher.observe(np.tile(truth, (len(actions), 1)), actions, time)
    noisy = seen + noise * random.normal(size=seen.shape)
    episodes = []
    for e, action in enumerate(actions):
        tracks, column = [], 0
        for spec in cell.objects:
            size = QUANTITY_SIZE[spec.quantity]
            keep = random.random(len(stamps)) >= missing
            tracks.append(Track(spec.name, spec.quantity, stamps[keep], noisy[e][keep, column : column + size]))
            column += size
        named = {a.name: float(v) for a, v in zip(cell.action, action, strict=True)}
        episodes.append(Episode(f"shot_{e:03d}", cell.name, cell.hash, named, start_ns, tuple(tracks)))
    return episodes
