"""Many worlds, several at a time, into one results file; stopped at any moment, it goes on from there."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from compass_ros.executors import Executor
from compass_ros.proof import lines
from compass_ros.proof.lines import Key, Line
from compass_ros.proof.one_world import SUITES, run

RunWorld = Callable[[Key], dict[str, object]]
Tell = Callable[[Key, Line, int, int], None]
"""A finished world, its line, how many are done and how many there were to do."""


@dataclass(frozen=True)
class Plan:
    """Which worlds."""

    suites: tuple[str, ...]
    worlds: int
    """Of each suite."""
    method: str = "default"
    first_seed: int | None = None
    """None: the suite's own."""
    parts: tuple[str, ...] | None = None
    """Of the package: whose change makes a line stale. None: those of our own method."""

    def worlds_to_prove(self) -> list[Key]:
        """In an order in which a run that is stopped has some of each suite."""
        starts = {s: SUITES[s].first_seed if self.first_seed is None else self.first_seed for s in self.suites}
        return [Key(s, starts[s] + i, self.method) for i in range(self.worlds) for s in self.suites]


def in_processes(threads: int) -> RunWorld:
    """A world by the real command line."""
    return partial(_in_process, threads)


def _in_process(threads: int, key: Key) -> dict[str, object]:
    return run(SUITES[key.suite], key.seed, key.method, threads) | {"threads": threads}


def prove(plan: Plan, path: Path, executor: Executor, tell: Tell, run_world: RunWorld) -> None:
    """Run what is missing or by an older method; the file is whole after each world."""
    known = lines.read(path)
    made_by = {
        "method_sources": lines.sources(lines.METHOD if plan.parts is None else plan.parts),
        "world_sources": lines.sources(lines.WORLDS),
        "commit": commit(),
    }
    todo = [
        key
        for key in plan.worlds_to_prove()
        if lines.stale(known.get(key), str(made_by["method_sources"]), str(made_by["world_sources"]))
    ]
    for done, (i, said) in enumerate(executor.each(run_world, todo), 1):
        key = todo[i]
        about = {"suite": key.suite, "seed": key.seed, "method": key.method, "jobs": executor.jobs}
        known[key] = about | made_by | said
        lines.write(path, known.values())
        tell(key, known[key], done, len(todo))


def commit() -> str:
    """The commit of the sources, with a + where files differ from it; 'unknown' outside of a repository."""
    asked = ["git", "-C", str(lines.PACKAGE), "describe", "--always", "--abbrev=12", "--dirty=+", "--exclude=*"]
    try:
        done = subprocess.run(asked, capture_output=True, text=True, check=False)
    except FileNotFoundError:
        return "unknown"
    return done.stdout.strip() if done.returncode == 0 else "unknown"
