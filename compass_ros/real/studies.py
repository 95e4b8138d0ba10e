"""All studies by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path

from compass_ros.errors import ConfigError, nearest
from compass_ros.real import ball_drops, cube_tosses, pendulums
from compass_ros.real.table import Study

Say = Callable[[str], None]
Run = Callable[[Path, Path | None, Say], Study]
"""(folder for bags and results, folder of the data, progress in words) -> the study."""

STUDIES: Mapping[str, Run] = {
    "ball_drops": ball_drops.study,
    "pendulum_single": pendulums.single,
    "pendulum_double": pendulums.double,
    "cube_tosses": cube_tosses.study,
}


def chosen(names: list[str], evaluations: int = 0) -> dict[str, Run]:
    """The studies of these names, all where there is none. Raises ConfigError with the nearest known name.

    `evaluations`: of a new search for the cube; 0: its recorded numbers.
    """
    for name in names:
        if name not in STUDIES:
            raise ConfigError(f"unknown study '{name}'; known: {', '.join(STUDIES)}{nearest(name, STUDIES)}")
    searched = {"cube_tosses": partial(cube_tosses.study, evaluations=evaluations)} if evaluations else {}
    return {name: searched.get(name, STUDIES[name]) for name in names or STUDIES}
