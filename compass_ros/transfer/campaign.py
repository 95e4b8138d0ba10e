"""Policies by simulator, condition and seed, trained alike and played in the concealed cell; a line of JSON each."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter, process_time

import numpy as np

from compass_ros.bench.outcome import append
from compass_ros.errors import DataError
from compass_ros.policy import ROLLOUTS, Belief, Shots, pushing, train
from compass_ros.simulation.factors import factor_distance
from compass_ros.transfer.experiment import Experiment
from compass_ros.transfer.simulators import Makers, recorded
from compass_ros.types import Bools, Floats, Report, silent
from compass_ros.worlds.played import Played

SCHEMA = "compass/policy/1"
SHOTS = 110
"""Of each policy: the paper's 10, and 100 for error bars of our own."""
PAPER = 10
KEY = ("task", "condition", "simulator", "recordings", "seed")
Row = Mapping[str, object]


@dataclass(frozen=True)
class Plan:
    """What a campaign shall have."""

    simulators: tuple[str, ...]
    conditions: tuple[str, ...]
    """Base conditions, with recordings, and changed ones, without."""
    seeds: int = 5
    recordings: int = 12
    rollouts: int = ROLLOUTS

    def rows(self, task: str) -> Iterator[tuple[object, ...]]:
        """Keys of all rows; seeds vary slowest, so that what was stopped has all simulators."""
        for seed in range(self.seeds):
            for condition in self.conditions:
                for simulator in self.simulators:
                    yield task, condition, simulator, self.recordings, seed


def run(experiment: Experiment, plan: Plan, file: Path, folder: Path, threads: int = 0, report: Report = silent) -> int:
    """Append what `file` does not have yet; returns how many rows. Simulators are kept in `folder`."""
    known = {key_of(row): row for row in read(file)}
    added = 0
    for key in plan.rows(experiment.name):
        if key in known:
            continue
        _, condition, simulator, _, seed = key
        row = one_policy(
            experiment, str(condition), str(simulator), plan, int(str(seed)), folder, threads, known, report
        )
        append(file, {"schema": SCHEMA} | dict(zip(KEY, key, strict=True)) | row)
        known[key] = row
        added += 1
    return added


def one_policy(
    experiment: Experiment, condition: str, simulator: str, plan: Plan, seed: int, folder: Path, threads: int,
    known: Mapping[tuple[object, ...], Row], report: Report = silent,
) -> dict[str, object]:  # fmt: skip
    """Train and play one. A policy that is replayed in a changed condition is the one of its own condition."""
    base = experiment.changed.get(condition, condition)
    own = folder / f"{experiment.name}-{base}-{plan.recordings}"
    episodes = recorded(experiment, base, plan.recordings, 0)
    belief = Makers(experiment, base, episodes, own, threads=threads, report=report).make(simulator)
    if simulator == "itself":
        belief = experiment.itself(condition)
    elif condition != base:
        belief = experiment.told(belief, condition, own)
    if experiment.over_time is not None:
        return over_time(experiment, belief, condition, simulator, own, seed, report)
    began, worked = perf_counter(), process_time()
    shots = Shots(experiment.cell, belief, experiment.goal, experiment.repeats)
    before = [known[key] for key in earlier(experiment, condition, simulator, plan, seed) if key in known]
    if before:
        action = np.array(before[0]["action"])
    else:
        action = train(shots, plan.rollouts, seed, report).action()
    wall, cpu = perf_counter() - began, process_time() - worked
    command = shots.command(action[None])
    played = experiment.play(condition, np.tile(command, (SHOTS, 1)), 1000 + seed)
    expected = shots.judge(action, 0.0, seed, 64)
    return outcome(experiment, belief, command[0], played, seed) | {
        "action": [round(float(a), 6) for a in action],
        "promised": round(expected.success, 3),
        "trained_s": round(wall, 1),
        "trained_cpu_s": round(cpu, 1),
        "rollouts": plan.rollouts,
    }


def over_time(
    experiment: Experiment, belief: Belief, condition: str, simulator: str, folder: Path, seed: int,
    report: Report = silent, transitions: int = pushing.TRANSITIONS,
) -> dict[str, object]:  # fmt: skip
    """Train and play one policy over time; it is kept in the folder."""
    assert experiment.over_time is not None
    count, repeats = pushing.SIDE_BY_SIDE, float(experiment.repeats[0])
    across = experiment.across.get(condition, 0.0)
    own: pushing.Bars = (
        experiment.over_time(count, seed) if simulator == "itself" else pushing.Simulated(belief, count, seed, repeats)
    )
    began, worked = perf_counter(), process_time()
    policy = pushing.train_pushing(own, seed, transitions, report, across)
    wall, cpu = perf_counter() - began, process_time() - worked
    folder.mkdir(parents=True, exist_ok=True)
    policy.save(folder / f"policy-{simulator}-{condition}-{seed}.npz")
    promised = pushing.near(pushing.played(policy, own, across=across)[-1])
    end = pushing.played(policy, experiment.over_time(SHOTS, 1000 + seed), across=across)[-1]
    hit, distance = pushing.near(end), np.linalg.norm(end[:, :2] - pushing.TARGET[:2], axis=1)
    return _counted(hit, distance, PAPER) | {
        "promised": round(float(promised.mean()), 3),
        "trained_s": round(wall, 1),
        "trained_cpu_s": round(cpu, 1),
        "transitions": transitions,
    }


def earlier(
    experiment: Experiment, condition: str, simulator: str, plan: Plan, seed: int
) -> Iterator[tuple[object, ...]]:
    """Rows whose policy is this one: of what no recording changes, and where nobody is told of a change."""
    if simulator in ("nominal", "uniform") and condition in experiment.conditions:
        for other in experiment.conditions:
            yield experiment.name, other, simulator, plan.recordings, seed
    if condition in experiment.replayed and simulator != "itself":
        yield experiment.name, experiment.changed[condition], simulator, plan.recordings, seed


def outcome(
    experiment: Experiment, belief: Belief, command: Floats, played: Played, seed: int, first: int = PAPER
) -> dict[str, object]:
    """What was measured of one policy: success, last distance, and the trajectory difference of its simulator.

    The `first` shots are counted apart from those that follow, if any do.
    """
    end = played.seen[:, -1, _columns(experiment)]
    distance = np.linalg.norm(end - np.array(experiment.goal.centre), axis=1)
    out = _counted(distance <= experiment.goal.radius, distance, first)
    if belief.cases:
        some = replace(played, seen=played.seen[:first])
        d = differences(experiment, belief, np.tile(command, (first, 1)), some, seed)
        out["difference_own_m"] = [round(float(x), 3) for x in (d.min(), d.max(), d.mean())]
    return out


def _counted(hit: Bools, distance: Floats, first: int) -> dict[str, object]:
    """Success and mean last distance [m] of the first shots, and of those that follow."""

    def of(which: slice, shots: str) -> dict[str, object]:
        return {
            f"success{shots}": round(float(hit[which].mean()), 3),
            f"distance{shots}_m": round(float(distance[which].mean()), 4),
        }

    return of(slice(first), "") | (of(slice(first, None), "_100") if len(hit) > first else {})


def differences(experiment: Experiment, belief: Belief, commands: Floats, played: Played, seed: int) -> Floats:
    """(S,) trajectory difference of a simulator in S shots, the mean over the factors [m]."""
    said = belief.observe(commands, played.time_s, np.random.default_rng([seed, 3]))
    return apart(experiment, said, played.seen)


def apart(experiment: Experiment, one: Floats, other: Floats) -> Floats:
    """(S,) trajectory difference of (S, T, C) recordings, the mean over the factors [m]."""
    return np.asarray(factor_distance(experiment.cell, one, other).sum(axis=1).mean(axis=1))


def compared(experiment: Experiment, condition: str, simulator: str, plan: Plan, folder: Path, threads: int,
             count: int = 50) -> dict[str, object]:  # fmt: skip
    """A row on shots that nobody was given: the difference of one simulator, or of the cell that plays them again."""
    own = folder / f"{experiment.name}-{condition}-{plan.recordings}"
    commands = experiment.commands(count, 99)
    played = experiment.play(condition, commands, 99)
    if simulator == "itself":
        d = apart(experiment, experiment.play(condition, commands, 100).seen, played.seen)
    else:
        episodes = recorded(experiment, condition, plan.recordings, 0)
        belief = Makers(experiment, condition, episodes, own, threads=threads).make(simulator, fine=True)
        d = differences(experiment, belief, commands, played, 0)
    return {"difference_m": [round(float(x), 3) for x in (d.min(), d.max(), d.mean())], "shots": count}


def compare(experiment: Experiment, plan: Plan, file: Path, folder: Path, threads: int = 0) -> int:
    """The same for all simulators and base conditions that `file` does not have yet, as rows of seed -1."""
    known, added = {key_of(row) for row in read(file)}, 0
    for condition in (c for c in plan.conditions if c in experiment.conditions):
        for simulator in plan.simulators:
            key = (experiment.name, condition, simulator, plan.recordings, -1)
            if key not in known:
                row = compared(experiment, condition, simulator, plan, folder, threads)
                append(file, {"schema": SCHEMA} | dict(zip(KEY, key, strict=True)) | row)
                added += 1
    return added


def read(file: Path) -> list[dict[str, object]]:
    """All rows, the last one of each key. Raises DataError on other content."""
    rows: dict[tuple[object, ...], dict[str, object]] = {}
    for number, line in enumerate(file.read_text(encoding="utf-8").splitlines() if file.exists() else (), 1):
        try:
            row = json.loads(line)
        except json.JSONDecodeError:
            continue  # torn, of a run that was killed
        if not isinstance(row, dict) or row.get("schema") != SCHEMA:
            raise DataError(f"{file}:{number}: expected a line of schema {SCHEMA}")
        rows[key_of(row)] = row
    return list(rows.values())


def key_of(row: Row) -> tuple[object, ...]:
    """What tells a row from others."""
    return tuple(row[name] for name in KEY)


def _columns(experiment: Experiment) -> Sequence[int]:
    own = [i for i, name in enumerate(experiment.cell.channels) if name == experiment.goal.object]
    return own[: len(experiment.goal.centre)]
