"""What recordings of a driven cell show before any fit, and motions of the same length that show more."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from compass_ros.cells import Cell
from compass_ros.errors import ConfigError
from compass_ros.planning.excitation import Plan, plan_motions, recorded
from compass_ros.planning.motions import Limits, limits
from compass_ros.simulation import Simulator
from compass_ros.simulation.driven import Driven, driven_joints
from compass_ros.types import Episode, Report, silent

COUNT = 8
"""Motions where nothing was recorded: with windows of 5 s less than a minute of recording."""


@dataclass(frozen=True)
class Wishes:
    """What is asked of a plan."""

    count: int = 0
    """Motions, each as long as a window; 0: as long in all as what was recorded, else COUNT."""
    speed: float = 1.0
    """Largest of each joint [rad/s or m/s]; models do not say it."""
    effort: float = np.inf
    """Largest of each joint [N m or N], beside what the scene says."""
    tries: int = 24
    """Motions that are simulated, each with every parameter moved."""
    propose: bool = True
    seed: int = 0


def plan_driven(simulator: Simulator, episodes: Sequence[Episode], wishes: Wishes, report: Report = silent) -> Plan:
    """Raises ConfigError where the cell's inputs are no series of joints or limits are missing, DataError where
    recordings are unfit or no motion keeps to the limits.
    """
    known = recorded(simulator, episodes) if episodes else None
    if not wishes.propose:
        if known is None:
            raise ConfigError(f"{simulator.cell.name}: neither recordings nor a proposal: nothing to say")
        return Plan(simulator.parameters, (known[0],), None)
    driven = driven_joints(simulator)
    within, warnings = _limits(simulator.cell, driven, episodes, wishes)
    spec = simulator.cell.spec.windows
    length = simulator.cell.duration if spec is None else spec.length_s
    count = wishes.count or (max(round(known[0].seconds / length), 1) if known else COUNT)
    found = plan_motions(simulator, driven, within, count, wishes.tries, wishes.seed, known, report)
    return replace(found, warnings=warnings)


def _limits(cell: Cell, driven: Driven, episodes: Sequence[Episode], wishes: Wishes) -> tuple[Limits, tuple[str, ...]]:
    """Of the scene; where it says none, what the recordings have shown to be possible."""
    bounded, effort = driven, wishes.effort
    if episodes:
        bounded = _within_seen(cell, driven, episodes)
        if driven.spec.quantity == "joint_effort" and np.isinf(np.minimum(driven.effort, effort)).any():
            told = [np.nanmax(np.abs(track.value)) for e in episodes for track in e.inputs]
            effort = float(max(told) * np.abs(driven.force).max())
    within = limits(bounded, wishes.speed, effort)
    free = bounded.without_range
    if not free:
        return within, ()
    return within, (f"{', '.join(free)}: no range in the scene; planned with half a turn to either side of home",)


def _within_seen(cell: Cell, driven: Driven, episodes: Sequence[Episode]) -> Driven:
    """The same with ranges that were measured in the place of what the scene leaves open."""
    seen = {}
    for signal in (s for s in cell.signals if s.quantity == "joint_position"):
        for column, joint in enumerate(signal.at):
            values = np.concatenate([e.track(signal.name).value[:, column] for e in episodes])
            seen[joint] = (float(np.nanmin(values)), float(np.nanmax(values)))
    return driven.between(seen)
