"""`compass demo` from the command line to the last table, and what is left when somebody stops it."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from compass_ros.cells import load
from compass_ros.concealed.seal import unseal
from compass_ros.demo.shared_memory import SHARED_MEMORY, held_locks, locks_in_use
from compass_ros.episodes import find_bags, read_episodes
from test.episodes.planted import PUCKS
from test.nodes.harness import PATIENCE_S, until

pytestmark = [pytest.mark.ros, pytest.mark.slow]


class Demo:
    """A demonstration in a process of its own, and the nodes that it has started so far."""

    def __init__(self, folder: Path, *words: str) -> None:
        self.out = folder / "demo"
        self.log = folder / "log"
        self._nodes: dict[int, list[Path]] = {}
        self._there_before = set(SHARED_MEMORY.iterdir())
        places = ["--out", str(self.out), "--answers", str(folder / "answers")]
        with self.log.open("wb") as log:
            self.process = subprocess.Popen(
                [sys.executable, "-m", "compass_ros.cli", "demo", *places, *words],
                stdout=log,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )

    def look(self) -> bool:
        """Note its child processes and the shared memory that they hold; whether it has ended."""
        for child in Path(f"/proc/{self.process.pid}/task/{self.process.pid}/children").read_text().split():
            try:
                self._nodes[int(child)] = held_locks(int(child)) or self._nodes.get(int(child), [])
            except FileNotFoundError:
                continue  # ended in the meantime
        return self.process.poll() is not None

    def left(self) -> list[str]:
        """Processes and shared memory of its nodes that are still there, and not another program's of this machine.

        Ports of shared memory are handed out across all domains: a free one is taken by whoever comes next.
        """
        processes = [f"process {pid}" for pid in self._nodes if Path("/proc", str(pid)).exists()]
        files = {lock.name.removesuffix(end) for locks in self._nodes.values() for lock in locks for end in ("_el", "")}
        others = {SHARED_MEMORY / lock.name.removesuffix(end) for lock in locks_in_use() for end in ("_el", "")}
        ours = {SHARED_MEMORY / name for name in files} - self._there_before - others
        return processes + [path.name for path in sorted(ours) if path.exists()]

    @property
    def nodes(self) -> int:
        """Nodes seen so far that held shared memory."""
        return sum(bool(locks) for locks in self._nodes.values())


@pytest.fixture
def started(tmp_path: Path, hear_ctrl_c: None) -> Iterator[list[Demo]]:
    demos: list[Demo] = []
    yield demos
    for demo in demos:
        if demo.process.poll() is None:
            os.killpg(demo.process.pid, signal.SIGINT)
            demo.process.wait(PATIENCE_S)
        print(demo.log.read_text())


def test_the_main_job(tmp_path: Path, started: list[Demo]) -> None:
    demo = Demo(tmp_path, "--shots", "6", "--effect", "none")
    started.append(demo)
    until(demo.look, "the end of the demonstration", timeout_s=1800)
    said = demo.log.read_text()
    assert demo.process.returncode == 0, said
    assert demo.nodes >= 6
    assert demo.left() == []

    cell = load("air_hockey")
    episodes = read_episodes([demo.out / "bags"], PUCKS, cell.name, cell.hash)
    assert len(episodes) == 6
    assert all(len(track.stamp_ns) > 60 for episode in episodes for track in episode.tracks)
    result = json.loads((demo.out / "calibration" / "result.json").read_text())
    nominal, found = (sum(result["gap"][model]["held_out"]["d"].values()) for model in ("nominal", "calibrated"))
    assert found <= 0.4 * nominal
    row = next(row for row in result["parameters"] if row["name"] == "pusher@actuation@vel_discount")
    np.testing.assert_allclose(row["value"], 0.85, atol=0.02)
    for words in ("truth", "0.85", "Held-out trajectory difference", "nothing is missing", "report:"):
        assert words in said
    assert said.index("is sealed: SHA-256") < said.index("camera sees them") < said.index("the answer is opened")
    opened = unseal(demo.out, tmp_path / "answers").answer
    assert opened["effects"] == []
    assert json.loads((demo.out / "truth.json").read_text()) == opened
    assert (demo.out / "calibration" / "report.html").stat().st_size > 10**6


@pytest.mark.parametrize("by", [signal.SIGINT, signal.SIGTERM])
def test_what_is_stopped_leaves_nothing_running(by: signal.Signals, tmp_path: Path, started: list[Demo]) -> None:
    demo = Demo(tmp_path, "--effect", "none")
    started.append(demo)
    bags = demo.out / "bags"  # beside the recorder's lock; what is stopped in the middle of a shot is discarded
    until(lambda: demo.look() or len(list(bags.glob("[!.]*"))) > 1, "the first episode")
    demo.look()
    assert demo.nodes == 4
    demo.process.send_signal(by)
    assert demo.process.wait(PATIENCE_S) == 130
    assert demo.left() == []
    assert "Traceback" not in demo.log.read_text()
    assert find_bags([demo.out / "bags"]), "what was recorded is still there"
