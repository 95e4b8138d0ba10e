"""`compass plan`, from a file of shots to the files that it writes."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from rich.console import Console

from compass_ros.cli import main
from compass_ros.commands.plan_output import figure, print_plan, write_plan
from compass_ros.errors import ConfigError, DataError
from compass_ros.planning.shots import Planned, look, read_shots
from test.discovery.planted import CALM, HELD_OUT
from test.simulation.table import cell, simulator

SHOT = {"x": -0.2, "y": 0.05, "angle": 0.1, "velocity": 0.4}


def shots_file(folder: Path, content: object) -> Path:
    path = folder / "shots.yaml"
    path.write_text(yaml.safe_dump(content))
    return path


@pytest.fixture(scope="module")
def found() -> Planned:
    """Three planned shots and three proposed ones, the best of two searches."""
    return look(simulator(), CALM, 3, 30.0, seed=0, propose=True, tries=2)


def test_a_better_set_of_the_same_number_is_proposed(found: Planned) -> None:
    assert found.proposed is not None
    assert found.better is not None
    assert found.proposed.shape == CALM.shape
    low, high = cell().reach.T
    assert ((found.proposed >= low) & (found.proposed <= high)).all()
    parts = [
        np.mean(np.log([min(v.at_five_sigma / v.best.bound, 1.0) for v in plan.effects]))
        for plan in (found.plan, found.better)
    ]
    assert parts[1] < parts[0] - np.log(1.2), "effects are seen that are at least 1.2 times smaller"
    assert any("3 shots are few" in warning for warning in found.warnings)


def test_what_is_written_can_be_read_again(found: Planned, tmp_path: Path) -> None:
    write_plan(found, cell(), tmp_path)
    content: dict[str, Any] = json.loads((tmp_path / "plan.json").read_text())
    assert content["schema"] == "compass/plan/1"
    assert [len(content[which]["shots"]) for which in ("planned", "proposed")] == [3, 3]
    effects = {(e["name"], tuple(e["objects"])): e for e in content["planned"]["effects"]}
    latency = effects["camera_latency", ()]
    assert "actuation_delay" in latency["twins"]
    assert latency["amplitudes"][0]["unit"] == "s"
    assert 0 < latency["amplitudes"][0]["at_five_sigma"] < 0.01
    assert "friction_cone" in content["planned"]["undetectable"]
    assert len(content["planned"]["parameters"]) == len(cell().parameters)
    assert (tmp_path / "plan.png").stat().st_size > 5000
    assert found.proposed is not None
    np.testing.assert_allclose(read_shots(tmp_path / "shots.yaml", cell()), found.proposed, atol=1e-4)


def test_the_table_says_what_is_seen_and_what_is_not(found: Planned) -> None:
    console = Console(width=160, record=True, quiet=False, file=None)
    with console.capture() as captured:
        print_plan(found, console)
    text = captured.get()
    for words in (
        "camera_latency latency [s]",
        "actuation_delay",
        "cannot show: friction_cone",
        "times smaller",
        "never",
    ):
        assert words in text, words


def test_the_figure_has_a_row_for_each_effect_that_is_seen(found: Planned) -> None:
    labels = [t.get_text() for t in figure(found).axes[0].get_yticklabels()]
    assert "camera_latency" in labels
    assert "friction_cone" not in labels


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ({"shot": [SHOT]}, ["expected a list `shots`", "shot"]),
        ({"shots": []}, ["expected a list `shots`"]),
        ({"shots": [SHOT, {**SHOT, "velocity": 3}]}, ["shot 2", "velocity = 3", "[0.2, 0.8]"]),
        ({"shots": [{"x": 0, "y": 0, "angle": 0, "speed": 1}]}, ["shot 1", "speed"]),
        ({"shots": [{**SHOT, "x": "left"}]}, ["x = 'left'", "a number"]),
        ({"shots": [7]}, ["shot 1", "found 7"]),
    ],
)
def test_bad_shots_are_one_line(content: object, words: list[str], tmp_path: Path) -> None:
    with pytest.raises(ConfigError) as error:
        read_shots(shots_file(tmp_path, content), cell())
    line = str(error.value)
    assert "\n" not in line
    assert all(word in line for word in [*words, "shots.yaml"]), line


def test_a_slow_recording_is_refused_before_any_work() -> None:
    before = simulator().rollouts
    with pytest.raises(DataError, match="20 frames a second are too slow"):
        look(simulator(), np.vstack([CALM, HELD_OUT]), 5, 20.0, seed=0, propose=False)
    assert simulator().rollouts == before


def test_the_command_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> None:
    words = ["compass", "plan", "--rate", "20", "--out", str(tmp_path / "out")]
    monkeypatch.setattr(sys, "argv", words)
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == 1
    assert capfd.readouterr().err.startswith("compass: 20 frames a second")
