"""A few calm shots on the real table, shared by the tests."""

from __future__ import annotations

import numpy as np

from compass_ros.cells import Cell, load
from compass_ros.concealed.law import Ingredient, Places
from compass_ros.concealed.laws import LAWS
from compass_ros.concealed.table import Played, Table
from compass_ros.types import Floats

INPUTS = np.array([[-0.225, 0.075, 0.05, 0.5], [-0.21, 0.06, -0.2, 0.7], [-0.15, -0.118, 0.059, 0.75]])
"""(3, A): shots that meet both pucks, four walls and the bar between them."""
TIMES = np.tile(np.arange(150) / 60, (len(INPUTS), 1))


def cell() -> Cell:
    return load("air_hockey")


def table(time_step: float = 0.001, **given: float) -> Table:
    """The table with the given parameters, `at` written as `__` and nothing else wrong."""
    own = cell()
    values = own.values({name.replace("__", "@"): value for name, value in given.items()})
    return Table(own, values, INPUTS, time_step)


def places(played: Played) -> Places:
    moving = np.linalg.norm(played.velocity, axis=3) > 0.05
    return Places(played.position[moving], played.touched(), len(INPUTS))


def ingredient(name: str, base: Played, size: float | None = None, other: float = 1.0, seed: int = 0) -> Ingredient:
    law = LAWS[name]
    shape = law.draw(np.random.default_rng(seed), places(base), other)
    objects = ("left_wall",) if law.on == "wall" else ("puck1", "puck2")
    return Ingredient(law, objects, shape, law.first if size is None else size)


def tracks(played: Played, *ingredients: Ingredient) -> Floats:
    """(S, F, 4) what a perfect camera sees [m]."""
    sample = played.sample()
    for i in ingredients:
        if i.law.camera is not None:
            sample = i.law.camera(i.size, i.shape, sample)
    return sample(TIMES)


def distance(one: Floats, other: Floats) -> float:
    """rms distance of both pucks [m]."""
    return float(np.sqrt(np.mean((one - other) ** 2) * 2))
