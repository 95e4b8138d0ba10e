"""The one configuration: defaults after the paper, one line for whatever is wrong, and a line that stays short."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

import pytest

from compass_ros.config import CalibrationConfig, calibration_config, read_yaml
from compass_ros.errors import ConfigError

BOMB = "a: &a [x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"{name}: &{name} [{', '.join(9 * [f'*{before}'])}]\n" for before, name in zip("abcdefgh", "bcdefghi", strict=True)
)
"""A YAML of 400 characters whose last entry, written out, has 9^9 words."""


def test_the_whole_configuration_can_be_written_down_and_read_again() -> None:
    config = CalibrationConfig(method="compass", seed=3, rollouts=100, held_out_share=0.5)
    assert calibration_config(asdict(config)) == config
    assert calibration_config({}) == CalibrationConfig()


def test_the_papers_hyperparameters_are_the_defaults() -> None:
    compass = CalibrationConfig().compass
    assert (compass.n_round, compass.n_cmd_action, compass.n_sim) == (10, 10, 64)
    assert (compass.sparse_weight, compass.sw_discount, compass.hidden_dim) == (0.003, 0.5, (256, 256))


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ({"seed": -1}, ["seed", "greater than or equal to 0", "found -1"]),
        ({"methods": "random"}, ["methods", "did you mean 'method'?"]),
        ({"compass": {"n_rounds": 3}}, ["compass.n_rounds", "did you mean 'n_round'?"]),
        ({"compass": {"hidden_dim": ["wide"]}}, ["compass.hidden_dim", "found"]),
        ({"discover": None}, ["discover", "found None"]),
    ],
)
def test_what_is_wrong_is_named(content: dict[str, object], words: list[str]) -> None:
    with pytest.raises(ConfigError) as caught:
        calibration_config(content, "here.yaml")
    said = str(caught.value)
    assert said.startswith("here.yaml: ")
    assert all(word in said for word in words), said


def test_a_value_that_would_fill_the_screen_is_shown_short(tmp_path: Path) -> None:
    (tmp_path / "bomb.yaml").write_text(BOMB)
    bomb = read_yaml(tmp_path / "bomb.yaml")["i"]
    with pytest.raises(ConfigError, match="seed") as caught:
        calibration_config({"seed": bomb})
    assert len(str(caught.value)) < 400
    assert "\n" not in str(caught.value)
