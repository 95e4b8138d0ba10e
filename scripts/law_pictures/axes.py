"""A picture of a law, and how its two lines look: grey and dashed without the law, green with it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from compass_ros.cells.dynamics import Sliding
from compass_ros.reporting.palette import LIGHT
from compass_ros.simulation.effects import Effect
from compass_ros.types import Floats

WITHOUT: Mapping[str, Any] = {"color": LIGHT["faint"], "ls": "--", "lw": 1.1}
WITH: Mapping[str, Any] = {"color": LIGHT["with_effects"], "lw": 1.5}
SLIDING = Sliding("puck", np.array([0.05]), np.array([0.002]), np.ones(1))
GRAVITY = 9.81
Draw = Callable[[Axes, Effect], None]


@dataclass(frozen=True)
class Picture:
    """One law: what to draw, and what one sees in it."""

    draw: Draw
    seen: str


def labelled(axes: Axes, x: str, y: str) -> None:
    axes.set_xlabel(x)
    axes.set_ylabel(y)


def both(axes: Axes, x: Floats, without: Floats, given: Floats) -> None:
    axes.plot(x, without, **WITHOUT)
    axes.plot(x, given, **WITH)
