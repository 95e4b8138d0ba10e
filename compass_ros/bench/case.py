"""One run of the benchmark, described so that it can be repeated and recognised."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from itertools import product
from typing import Literal

from compass_ros.calibration.problem import Allowance
from compass_ros.config import Parameters

Start = Literal["default", "random"]


@dataclass(frozen=True)
class Case:
    """Task, method and everything that its result depends on."""

    task: str
    """Name or path of a cell."""
    method: str
    seed: int
    iterations: int = 10
    real: int = 10
    """N: recorded episodes."""
    sim: int = 64
    """M: simulated rollouts for each of them and iteration."""
    noise_m: float = 0.0
    """Standard deviation of the white noise on each measured coordinate."""
    missing: float = 0.0
    """Share of the frames in which an object is not seen."""
    start: Start = "default"
    """First guess: the cell's defaults, or drawn uniformly within the bounds."""
    sparse_weight: float | None = None
    """lambda of loss (2), for the method `compass` only; None: the paper's."""
    parameters: Parameters = "cell"
    """What is tuned: the cell's list, or `auto`: every other tunable field of its scene too."""

    @property
    def allowance(self) -> Allowance:
        return Allowance(self.iterations, self.real, self.sim)

    @property
    def key(self) -> str:
        """Two cases are the same where their keys are."""
        return " ".join(f"{name}={value}" for name, value in asdict(self).items())

    def setting(self) -> str:
        """What sets it apart from the paper's main experiment, besides task, method and seed; empty: nothing."""
        usual = Case(self.task, self.method, self.seed)
        parts = [f"{n}={v}" for n, v in asdict(self).items() if v != getattr(usual, n)]
        return ", ".join(parts)


def grid(
    tasks: Sequence[str], methods: Sequence[str], seeds: Sequence[int], noises: Sequence[float], base: Case
) -> tuple[Case, ...]:
    """Each method on each task, noise and seed; numbers of rollouts and the rest from `base`. Seeds vary slowest."""
    return tuple(
        Case(
            task,
            method,
            seed,
            base.iterations,
            base.real,
            base.sim,
            noise,
            base.missing,
            base.start,
            base.sparse_weight if method == "compass" else None,
            base.parameters,
        )
        for seed, task, noise, method in product(seeds, tasks, noises, methods)
    )


def ablations(task: str, methods: Sequence[str], seeds: Sequence[int], iterations: int = 10) -> tuple[Case, ...]:
    """The paper's supplementary studies: N, M, sparsity weight, random first guesses."""
    cases: list[Case] = []
    for seed, method in product(seeds, methods):
        cases += [Case(task, method, seed, iterations, real=n) for n in (5, 10, 20)]
        cases += [Case(task, method, seed, iterations, sim=m) for m in (32, 64, 128)]
        cases += [Case(task, method, seed, iterations, start="random")]
        if method == "compass":
            cases += [Case(task, method, seed, iterations, sparse_weight=w) for w in (0.001, 0.005, 0.01)]
    return tuple(dict.fromkeys(cases))
