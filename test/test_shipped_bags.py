"""What the nodes have recorded is calibrated again: the parameters that the virtual cell had are found."""

from __future__ import annotations

from pathlib import Path

import pytest

from compass_ros.cells import load
from compass_ros.config import calibration_config
from compass_ros.episodes import read_episodes
from compass_ros.pipeline import calibrate
from compass_ros.selection import split
from test.episodes.planted import PUCKS

BAGS = Path(__file__).parents[1] / "bags"
WITHIN = {
    "pusher@actuation@vel_discount": 0.005,
    "puck1@dyna@friction_sliding": 0.001,
    "puck2@dyna@friction_sliding": 0.001,
    "puck1@dyna@damping": 0.5,
    "env@camera@bias_x": 0.0005,
    "env@camera@bias_y": 0.0005,
}
"""How near to the truth four shots bring the parameters that they tell most about."""


@pytest.mark.slow
def test_the_bags_give_the_parameters_of_the_cell_that_played_them() -> None:
    cell = load("air_hockey")
    episodes = read_episodes([BAGS], PUCKS, cell.name, cell.hash)  # refused where of an older cell: `make bags`
    result, _ = calibrate(episodes, cell, calibration_config({"discover": False}))
    assert (len(result.fit), len(result.held_out)) == (3, 1)
    assert result.gap["calibrated"]["held_out"].rmse_m < 0.02 * result.gap["nominal"]["held_out"].rmse_m
    found = {row.name: row for row in result.parameters}
    target = {parameter.name: parameter.target for parameter in cell.spec.parameters}
    for name, within in WITHIN.items():
        assert found[name].active, name
        assert found[name].value == pytest.approx(target[name], abs=within), name


def test_the_order_in_which_bags_are_named_does_not_matter() -> None:
    bags = sorted(BAGS.glob("episode_*"))
    config = calibration_config({})
    one, other = (split(read_episodes(names, PUCKS), config) for names in (bags, bags[::-1]))
    assert [[episode.name for episode in part] for part in one] == [[e.name for e in part] for part in other]
