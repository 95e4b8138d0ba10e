"""What is drawn alike in all scenes: how much is missing, which laws, true parameters, sites and sizes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TypeVar

import numpy as np
from numpy.random import Generator

from compass_ros.errors import ConfigError, nearest
from compass_ros.types import Floats, Parameter
from compass_ros.worlds.world import Asked, Kind

ODDS: Mapping[Kind, float] = {"none": 0.22, "one": 0.50, "two": 0.12, "outside": 0.16}
_COUNT: Mapping[Kind, int] = {"none": 0, "one": 1, "two": 2, "outside": 1}
T = TypeVar("T")


def streams(seed: int, scene: str, purposes: Sequence[str]) -> dict[str, Generator]:
    """A generator for each purpose: what is drawn for one does not move what is drawn for another."""
    own = list(scene.encode())
    return {name: np.random.default_rng([seed, i, *own]) for i, name in enumerate(purposes)}


def laws(
    asked: Asked, known: Sequence[str], outside: Sequence[str], rng: Generator, family: Mapping[str, str] | None = None
) -> tuple[Kind, tuple[str, ...]]:
    """How much is missing, and what: names of `known` laws, or of one from `outside` the suite's vocabulary.

    Two laws of one world are of two families, where these are given by the names of the laws. Raises ConfigError where
    more than two laws, or unknown ones, are asked for.
    """
    drawn: Kind = list(ODDS)[int(rng.choice(len(ODDS), p=list(ODDS.values())))]
    if not asked.names:
        kind = asked.kind or drawn
        pool = list(outside if kind == "outside" else known)
        while True:
            found = tuple(str(name) for name in rng.choice(pool, _COUNT[kind], replace=False))
            if len({(family or {}).get(name, name) for name in found}) == len(found):
                return kind, found
    every = [*known, *outside]
    for name in asked.names:
        if name not in every:
            raise ConfigError(f"unknown law '{name}'; known: {', '.join(every)}{nearest(name, every)}")
    if len(asked.names) > 2:
        raise ConfigError(f"a world holds two laws at most, asked for {', '.join(asked.names)}")
    if any(name in outside for name in asked.names):
        return "outside", asked.names
    return ("two" if len(asked.names) == 2 else "one"), asked.names


def true_values(parameters: Sequence[Parameter], rng: Generator) -> dict[str, float]:
    """True value of each parameter: uniform within the half-width around its default, inside its bounds."""
    shares = rng.uniform(-1, 1, len(parameters))
    return {
        p.name: float(np.clip(p.default + p.half_width * share, p.low, p.high))
        for p, share in zip(parameters, shares, strict=True)
    }


def log_uniform(rng: Generator, low: float, high: float, count: int | None = None) -> Floats:
    """Uniform in the logarithm; () or (count,)."""
    return np.asarray(np.exp(rng.uniform(np.log(low), np.log(high), count)))


def sites(rng: Generator, candidates: Sequence[T]) -> tuple[T, ...]:
    """One, several or all of the candidates, each case as often, in their order."""
    n = len(candidates)
    case = int(rng.integers(3)) if n > 2 else int(rng.integers(min(n, 2))) * 2
    count = {0: 1, 1: int(rng.integers(2, n)) if n > 2 else 1, 2: n}[case]
    return tuple(candidates[int(i)] for i in sorted(rng.choice(n, count, replace=False)))
