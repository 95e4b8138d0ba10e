"""What a demonstration conceals: drawn with a seed, strong enough to be seen, the same in the cell that reads it."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from compass_ros.concealed.law import Ingredient
from compass_ros.concealed.laws import LAWS
from compass_ros.concealed.stage import POOL, Secret, Stage, draw, read_secret
from compass_ros.errors import ConfigError
from compass_ros.simulation import Simulator
from test.concealed.scene import INPUTS, cell

TIMES = np.linspace(0.0, 2.4, 60)
FINE = np.linspace(0.0, 1.0, 500)
NAMES = ("pusher", "puck1", "puck2")


def test_nothing_that_acts_inside_a_camera_or_by_chance_is_drawn() -> None:
    assert {LAWS[name].channel for name in POOL} == {"dynamics", "contact", "actuation"}
    assert "stroke_jitter" not in POOL


def test_a_stage_without_laws_is_the_simulator() -> None:
    own = cell()
    plain = Simulator(own, threads=1).bodies(own.defaults, INPUTS[0], TIMES)
    absent = Ingredient(LAWS["heading_bias"], shape={"hand": 1.0, "with_speed": 0.0}, size=0.0)
    for ingredients in ((), (absent,)):
        played = Stage(own, Secret(own.defaults, ingredients)).bodies(INPUTS[0], TIMES)
        for name in NAMES:
            np.testing.assert_allclose(played[name][:, :2], plain[name][:, :2], atol=1e-6)


def test_the_pusher_and_the_bias_of_the_camera_are_drawn_too() -> None:
    """A heading bias of 0.04 rad turns the pusher's whole path about its start."""
    own = cell()
    values = own.values({"env@camera@bias_x": 0.03})
    bent = Ingredient(LAWS["heading_bias"], shape={"hand": 1.0, "with_speed": 0.0}, size=20.0)
    straight = Stage(own, Secret(values)).bodies(INPUTS[0], FINE)["pusher"][:, :2]
    turned = Stage(own, Secret(values, (bent,))).bodies(INPUTS[0], FINE)["pusher"][:, :2]
    np.testing.assert_allclose(turned[0], INPUTS[0, :2] + [0.03, 0.0], atol=1e-6)
    before = int(np.argmax(np.linalg.norm(straight - straight[0], axis=1) > 0.01))  # not yet at the puck
    one, other = straight[before] - straight[0], turned[before] - turned[0]
    angle = np.arctan2(one[0] * other[1] - one[1] * other[0], one @ other)
    assert angle == pytest.approx(0.04, abs=0.002)


@pytest.mark.nightly
def test_what_is_drawn_repeats_is_strong_enough_and_reads_back(tmp_path: Path) -> None:
    own = cell()
    answer: Any = draw(own, INPUTS, 3, own.defaults, "table_tilt")
    assert answer == draw(own, INPUTS, 3, own.defaults, "table_tilt")
    (effect,) = answer["effects"]
    assert 2.5e-3 < effect["rms_m"] < 9e-3
    assert {"tilt_x", "tilt_y"} == set(effect["library"])
    file = tmp_path / "answer.json"
    file.write_text(json.dumps(answer))
    secret = read_secret(file, own)
    np.testing.assert_array_equal(secret.values, own.defaults)
    played = Stage(own, secret).bodies(INPUTS[0], TIMES)["puck1"]
    plain = Stage(own, Secret(own.defaults)).bodies(INPUTS[0], TIMES)["puck1"]
    assert np.abs(played - plain).max() > 2e-3


def test_no_effect_is_an_answer_too() -> None:
    own = cell()
    answer: Any = draw(own, INPUTS, 1, effect="none")
    assert answer["kind"] == "none"
    assert answer["effects"] == []
    half = {p.name: p.half_width for p in own.parameters}
    assert all(abs(answer["parameters"][p.name] - p.default) <= half[p.name] + 1e-12 for p in own.parameters)


@pytest.mark.parametrize(
    ("name", "message"), [("camera_scale", "may conceal none, "), ("swril", "did you mean 'swirl'")]
)
def test_an_effect_that_cannot_be_concealed_is_refused(name: str, message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        draw(cell(), INPUTS, 0, effect=name)


@pytest.mark.parametrize("text", ["{}", "[", '{"parameters": {}}'])
def test_a_file_that_is_no_answer_is_refused(text: str, tmp_path: Path) -> None:
    file = tmp_path / "answer.json"
    file.write_text(text)
    with pytest.raises(ConfigError, match="not the answer of a cell like 'air_hockey'"):
        read_secret(file, cell())


def test_the_stage_loads_no_torch() -> None:
    code = "import sys, compass_ros.concealed.stage; print('torch' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert done.stdout.strip() == "False"
