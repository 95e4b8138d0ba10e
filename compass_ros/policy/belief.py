"""What is held true of a cell: simulators with draws of their parameters, each as probable as it is held to be."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import nan
from pathlib import Path

import numpy as np
from numpy.random import Generator

from compass_ros.simulation import Simulator
from compass_ros.simulation.effects import Attached, FittedEffect, as_entry, from_entry
from compass_ros.types import Floats

Correction = Callable[[Floats, Floats, Floats], Floats]
"""(B, A) commands, (F,) times [s], (B, F, C) what a simulator says -> (B, F, C) what is said instead."""


@dataclass(frozen=True, eq=False)
class Case:
    """One simulator."""

    share: float
    """How probable it is; all cases of a belief sum to one."""
    simulator: Simulator
    values: Floats
    """(N, P) its parameters, and those of its laws: of N rows each rollout takes one at random."""

    def drawn(self, count: int, rng: Generator) -> Floats:
        """(count, P) rows of its parameters."""
        return np.asarray(self.values[rng.integers(len(self.values), size=count)])

    def observe(self, commands: Floats, time_s: Floats, rng: Generator) -> Floats:
        """(B, F, C) for (B, A) commands at (F,) times; what laws of chance do is drawn for each."""
        values = self.drawn(len(commands), rng)
        inputs = self.simulator.inputs(commands)
        if beyond := inputs.shape[1] - commands.shape[1]:
            scatter = self.simulator.launch_std(self.values.mean(axis=0))[-beyond:]
            inputs[:, -beyond:] = scatter * rng.standard_normal((len(inputs), beyond))
        return self.simulator.observe(values, inputs, np.tile(time_s, (len(commands), 1)))


@dataclass(frozen=True, eq=False)
class Belief:
    """One or several simulators, and perhaps a correction of what they say."""

    cases: tuple[Case, ...]
    correction: Correction | None = None

    @property
    def shares(self) -> Floats:
        """Of each case; they sum to one."""
        shares = np.array([case.share for case in self.cases])
        return np.asarray(shares / shares.sum())

    def observe(self, commands: Floats, time_s: Floats, rng: Generator) -> Floats:
        """(B, F, C) what the tracker would say; each row is one draw of what is held true."""
        of = rng.choice(len(self.cases), size=len(commands), p=self.shares)
        parts = [(np.flatnonzero(of == i), case) for i, case in enumerate(self.cases)]
        seen = [(rows, case.observe(commands[rows], time_s, rng)) for rows, case in parts if len(rows)]
        out = np.empty((len(commands), *seen[0][1].shape[1:]))
        for rows, said in seen:
            out[rows] = said
        return out if self.correction is None else self.correction(commands, time_s, out)


def one(simulator: Simulator, values: Floats) -> Belief:
    """One simulator with (P,) values, or with (N, P) draws."""
    return Belief((Case(1.0, simulator, np.atleast_2d(values)),))


def save(belief: Belief, path: Path) -> None:
    """As JSON, without the correction; laws as in `effects.yaml`, with the numbers of the first draw."""
    rows = [{"share": c.share, "laws": _laws(c), "values": c.values.tolist()} for c in belief.cases]
    path.write_text(json.dumps(rows), encoding="utf-8")


def _laws(case: Case) -> list[dict[str, object]]:
    of_first = case.simulator.physics.of_effects(case.values[:1])
    return [as_entry(FittedEffect(law, tuple(own[0].tolist()), (nan,) * own.shape[1])) for law, own in of_first]


def load(path: Path, simulator: Simulator) -> Belief:
    """What `save` has written, for the simulator of the cell without laws."""

    def attached(laws: Sequence[Mapping[str, object]]) -> list[Attached]:
        return [from_entry(law, path).attached for law in laws]

    rows = json.loads(path.read_text(encoding="utf-8"))
    return Belief(
        tuple(Case(r["share"], simulator.with_effects(attached(r["laws"])), np.array(r["values"])) for r in rows)
    )
