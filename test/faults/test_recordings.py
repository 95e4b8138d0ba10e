"""Recordings that end, repeat or stand still, through the command that calibrates."""

from __future__ import annotations

import json
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import suppress
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


def open_files(pid: int) -> Iterator[str]:
    """What a process has open; what it closes meanwhile is left out."""
    for link in Path(f"/proc/{pid}/fd").glob("*"):
        with suppress(FileNotFoundError):
            yield str(link.readlink())


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


@pytest.mark.slow
def test_identical_episodes(sound: list[Episode], tmp_path: Path) -> None:
    result = calibrated([replace(sound[0], name=f"copy{i}") for i in range(4)], tmp_path)
    assert any("3 of 4 episodes are copies of others" in said for said in result["warnings"])
    assert finite(result)


@pytest.mark.slow
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


def test_a_bag_deleted_while_others_are_read(sound: list[Episode], tmp_path: Path) -> None:
    """One of many bags goes away under the reader: the result is that of the others, and names it."""
    bags = tmp_path / "bags"
    for number in range(8):
        write_episode(replace(sound[0], name=f"copy{number:02d}"), bags)
    process = subprocess.Popen(command(bags, tmp_path / "out"), stderr=subprocess.PIPE, text=True)
    opened = threading.Event()

    def watch() -> None:
        """The last bag goes when the first one is open; the reader waits for that."""
        while process.poll() is None and not opened.is_set():
            if any("copy" in name for name in open_files(process.pid)):
                process.send_signal(signal.SIGSTOP)
                opened.set()
            time.sleep(0.0005)

    watcher = threading.Thread(target=watch)
    watcher.start()
    assert opened.wait(300)
    shutil.rmtree(bags / "copy07")
    process.send_signal(signal.SIGCONT)
    _, said = process.communicate(timeout=600)
    watcher.join()
    assert process.returncode == 0, said
    result = json.loads((tmp_path / "out" / "result.json").read_text())
    assert [Path(one["bag"]).name for one in result["episodes"]["left_out"]] == ["copy07"]
    assert "no such bag" in result["episodes"]["left_out"][0]["reason"]
    assert len(result["episodes"]["fit"] + result["episodes"]["held_out"]) == 7
