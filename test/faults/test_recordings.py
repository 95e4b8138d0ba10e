"""Recordings that end, repeat or stand still, through the command that calibrates."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from compass_ros.cells import Cell, load
from compass_ros.episodes import write_episode
from compass_ros.operation.current import read
from compass_ros.types import Episode
from test.nodes.recordings import record

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def cell() -> Cell:
    return load("air_hockey")


@pytest.fixture(scope="module")
def sound(cell: Cell, tmp_path_factory: pytest.TempPathFactory) -> list[Episode]:
    folder = tmp_path_factory.mktemp("sound")
    return [read(cell, bag) for bag in record(folder, {"puck1@dyna@friction_sliding": 0.1}, shots=3, seed=1)]


def command(bags: Path, out: Path) -> list[str]:
    words = [sys.executable, "-m", "compass_ros.cli", "calibrate", "--out", str(out), "--progress", "none"]
    return [*words, "--rollouts", "600", "--no-discover", str(bags)]


def calibrated(episodes: list[Episode], folder: Path) -> dict[str, Any]:
    """result.json of these episodes."""
    for episode in episodes:
        write_episode(episode, folder / "bags")
    done = subprocess.run(command(folder / "bags", folder / "out"), check=False, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    content: dict[str, Any] = json.loads((folder / "out" / "result.json").read_text())
    return content


def finite(result: dict[str, Any]) -> bool:
    """Every parameter has a number within its bounds, but for the last digits."""
    rows = result["parameters"]
    return all(row["bounds"][0] - 1e-9 <= row["value"] <= row["bounds"][1] + 1e-9 for row in rows)


@pytest.mark.slow
def test_one_episode(sound: list[Episode], tmp_path: Path) -> None:
    result = calibrated(sound[:1], tmp_path)
    assert result["warnings"][0].startswith("one episode is few")
    assert result["episodes"]["held_out"] == []
    assert result["gap"]["calibrated"]["fit"]["rmse_m"] < result["gap"]["nominal"]["fit"]["rmse_m"]
    assert finite(result)


@pytest.mark.nightly
def test_identical_episodes(sound: list[Episode], tmp_path: Path) -> None:
    result = calibrated([replace(sound[0], name=f"copy{i}") for i in range(4)], tmp_path)
    assert any("3 of 4 episodes are copies of others" in said for said in result["warnings"])
    assert finite(result)


@pytest.mark.nightly
def test_a_puck_that_never_moves(sound: list[Episode], tmp_path: Path) -> None:
    def still(episode: Episode) -> Episode:
        tracks = [
            replace(t, value=np.repeat(t.value[:1], len(t.value), 0)) if t.object == "puck2" else t
            for t in episode.tracks
        ]
        return replace(episode, tracks=tuple(tracks))

    result = calibrated([still(episode) for episode in sound], tmp_path)
    assert any(said.startswith("puck2 never moves in 3 episodes") for said in result["warnings"])
    assert finite(result)


# The command, in a process in which the last bag is deleted at the moment the first one's messages are opened.
DELETING = """
import shutil, sys
def audit(event, arguments):
    if event == "open" and str(arguments[0]).endswith(".mcap") and "copy00" in str(arguments[0]):
        shutil.rmtree(bag, ignore_errors=True)
bag = sys.argv.pop(1)
sys.addaudithook(audit)
from compass_ros.cli import main
main()
"""


@pytest.mark.nightly
def test_a_bag_deleted_while_others_are_read(sound: list[Episode], tmp_path: Path) -> None:
    """One of many bags goes away under the reader: the result is that of the others, and names it."""
    bags = tmp_path / "bags"
    for number in range(8):
        write_episode(replace(sound[0], name=f"copy{number:02d}"), bags)
    words = [sys.executable, "-c", DELETING, str(bags / "copy07"), *command(bags, tmp_path / "out")[3:]]
    done = subprocess.run(words, check=False, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    result = json.loads((tmp_path / "out" / "result.json").read_text())
    assert [Path(one["bag"]).name for one in result["episodes"]["left_out"]] == ["copy07"]
    assert "no such bag" in result["episodes"]["left_out"][0]["reason"]
    assert len(result["episodes"]["fit"] + result["episodes"]["held_out"]) == 7
