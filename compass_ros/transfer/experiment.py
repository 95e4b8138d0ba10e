"""The paper's experiments: a cell as simulators know it, and the concealed one in which policies are played."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.random import Generator

from compass_ros.cells import Cell, load
from compass_ros.errors import ConfigError, nearest
from compass_ros.policy import Belief, Case, Goal, pushing
from compass_ros.policy.pushing import Bars
from compass_ros.simulation import Simulator
from compass_ros.types import Floats
from compass_ros.worlds.bounce import cell as bounce
from compass_ros.worlds.played import Played
from compass_ros.worlds.push import cell as bar
from compass_ros.worlds.table import cell as table
from compass_ros.worlds.world import Task

HEAVY = 1.1
"""Pucks with a tenth more of mass."""
MOVED = ((-0.16, 0.015), (-0.08, -0.06))
"""Other places of the pucks at the start [m]."""
ACROSS = 0.03
"""Where the tool begins across the bar instead of behind its middle [m]: there a push turns it away from the target."""


def _as_it_was(belief: Belief, condition: str, folder: Path) -> Belief:
    return belief


@dataclass(frozen=True)
class Experiment:
    """One task of the paper."""

    name: str
    cell: Cell
    """With the repeatability of the arm."""
    goal: Goal
    conditions: tuple[str, ...]
    """Those in which recordings are made; then those that are changed afterwards."""
    play: Callable[[str, Floats, int], Played]
    """Condition, (S, A) commands, seed -> what happened."""
    told: Callable[[Belief, str, Path], Belief] = _as_it_was
    """What a simulator makes of what everybody knows of a changed condition (a mass on a scale, places at the start);
    the path is a folder for scenes."""
    changed: Mapping[str, str] = field(default_factory=dict)
    """Changed conditions, and the one whose recordings simulators and policies come from."""
    over_time: Callable[[int, int], Bars] | None = None
    """Count, seed -> the concealed cell in steps, where a policy acts over time; None: its action is one command."""
    across: Mapping[str, float] = field(default_factory=dict)
    """Conditions in which the tool of a policy over time begins so far across [m]."""
    replayed: tuple[str, ...] = ()
    """Changed conditions of which nobody is told anything: the old policies play."""

    @property
    def repeats(self) -> Floats:
        """(A,) one standard deviation of what the arm is off."""
        return self.cell.launch_std

    def commands(self, count: int, seed: int) -> Floats:
        """(count, A) uniform in the action space."""
        low, high = (np.array([getattr(a, end) for a in self.cell.action]) for end in ("low", "high"))
        return np.asarray(np.random.default_rng([seed, 5]).uniform(low, high, (count, len(low))))

    def itself(self, condition: str) -> Belief:
        """The concealed cell as if it were a simulator: what no method can do better than."""
        return Itself(experiment=self, condition=condition)


@dataclass(frozen=True, eq=False, kw_only=True)
class Itself(Belief):
    """The concealed cell in the place of a simulator."""

    cases: tuple[Case, ...] = ()
    experiment: Experiment
    condition: str

    def observe(self, commands: Floats, time_s: Floats, rng: Generator) -> Floats:
        played = self.experiment.play(self.condition, commands, int(rng.integers(2**31)))
        return np.asarray(played.seen[:, np.round(time_s / self.experiment.cell.control_dt).astype(int)])


def air_hockey() -> Experiment:
    """Mini-air-hockey over a fan at two speeds."""
    cell = load("air_hockey")
    task = _task(cell)
    speed = float(np.mean([cell.action[3].low, cell.action[3].high]))
    off = dict(zip(("x", "y", "angle"), table.REPEATS, strict=False)) | {"velocity": table.REPEATS_SPEED * speed}
    conditions = {
        "low": table.Condition("low"),
        "high": table.Condition("high"),
        "low-heavy": table.Condition("low", mass=HEAVY),
        "low-moved": table.Condition("low", rest=MOVED),
        "low-faster": table.Condition("high"),
        "high-slower": table.Condition("low"),
    }

    def play(condition: str, commands: Floats, seed: int) -> Played:
        return table.shoot(task, conditions[condition], commands, seed, cell.horizon)

    return Experiment(
        "air_hockey",
        replace(cell, spec=replace(cell.spec, launch_noise={k: float(v) for k, v in off.items()})),
        Goal("puck2", (0.43, 0.0), 0.15),
        ("low", "high"),
        play,
        _told_of_pucks,
        {"low-heavy": "low", "low-moved": "low", "low-faster": "low", "high-slower": "high"},
        replayed=("low-faster", "high-slower"),
    )


def _told_of_pucks(belief: Belief, condition: str, folder: Path) -> Belief:
    if condition.endswith("-heavy"):
        cell = belief.cases[0].simulator.cell
        masses = [cell.index(f"puck{k}@dyna@mass") for k in (1, 2)]
        lift = cell.index("table@dyna@lift")

        def heavier(values: Floats) -> Floats:
            out = values.copy()
            out[:, masses] *= HEAVY
            out[:, lift] /= HEAVY
            return out

        return replace(belief, cases=tuple(replace(c, values=heavier(c.values)) for c in belief.cases))
    if condition.endswith("-moved"):
        return replace(belief, cases=tuple(_moved(case, folder) for case in belief.cases))
    return belief


def _moved(case: Case, folder: Path) -> Case:
    """The same simulator of a scene whose pucks begin elsewhere."""
    cell, text = case.simulator.cell, case.simulator.cell.model_path.read_text(encoding="utf-8")
    for old, new in zip(((-0.15, 0.0), (-0.075, -0.075)), MOVED, strict=True):
        text = text.replace(f'pos="{old[0]:g} {old[1]:g} 0"', f'pos="{new[0]:g} {new[1]:g} 0"')
    path = folder / "moved.xml"
    path.write_text(text, encoding="utf-8")
    elsewhere = replace(cell, spec=replace(cell.spec, model=str(path.resolve())))
    options = {"timestep": case.simulator.time_step}
    return replace(case, simulator=Simulator(elsewhere, case.simulator.effects, case.simulator.threads, options))


def _task(cell: Cell) -> Task:
    return Task(cell.name, cell.hash, cell.model_path, cell.parameters)


def bouncing_ball() -> Experiment:
    """The ball over two plates into the basket."""
    cell = load("bouncing_ball")
    task = _task(cell)

    def play(condition: str, commands: Floats, seed: int) -> Played:
        return bounce.drop(task, commands, seed, cell.horizon)

    return Experiment(
        "bouncing_ball",
        replace(cell, spec=replace(cell.spec, launch_noise={"height": bounce.REPEATS_M})),
        Goal("ball", (0.445, 0.0, 0.085), 0.055),  # what the basket holds: 13 cm wide, the ball lies 7 to 11.5 cm high
        ("real",),
        play,
    )


def push_i() -> Experiment:
    """Push-I: a slender bar on three feet, a policy over 30 steps. Recordings are pushes of two velocities."""
    cell = load("pushed_bar")
    task = _task(cell)

    def play(condition: str, commands: Floats, seed: int) -> Played:
        return bar.push(task, commands, seed, cell.horizon)

    return Experiment(
        "push_i",
        replace(cell, spec=replace(cell.spec, launch_noise={"y": bar.REPEATS_M})),
        Goal("bar", (*pushing.TARGET[:2], 0.0), pushing.NEAR_M),
        ("real",),
        play,
        changed={"real-moved": "real"},
        over_time=lambda count, seed: bar.Pushing(task, count, seed),
        across={"real-moved": ACROSS},
    )


EXPERIMENTS: Mapping[str, Callable[[], Experiment]] = {
    "air_hockey": air_hockey,
    "bouncing_ball": bouncing_ball,
    "push_i": push_i,
}


def experiment(name: str) -> Experiment:
    """The experiment of that name. Raises ConfigError with the nearest known one."""
    if name not in EXPERIMENTS:
        raise ConfigError(f"unknown experiment '{name}'; known: {', '.join(EXPERIMENTS)}{nearest(name, EXPERIMENTS)}")
    return EXPERIMENTS[name]()
