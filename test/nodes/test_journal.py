"""Calibrations that are cut off: a real process is killed, and the next one finds out."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from compass_ros.errors import ConfigError
from compass_ros.nodes.job import Job, Outcome, Request
from compass_ros.nodes.journal import Journal, cut_off, journal_path

REQUEST = {"bags": ["/a", "/b"], "cell": "air_hockey", "seed": 3, "rollouts": 100, "method": "default"}
HOLDER = """
import json, pathlib, sys, time
from compass_ros.nodes.journal import Journal
output = pathlib.Path(sys.argv[1])
journal = Journal(output, json.loads(sys.argv[2]))
folder = output.parent / ".result-abc"
folder.mkdir()
import subprocess
words = [sys.executable, "-c", "import time; time.sleep(600)", str(folder)]
child = subprocess.Popen(words, stdout=subprocess.DEVNULL, start_new_session=True)
journal.begun(child.pid, folder)
journal.note("calibrate", 7)
print(child.pid, flush=True)
time.sleep(600)
"""


def holder(output: Path) -> tuple[subprocess.Popen[str], int]:
    """A process that calibrates, and its child's id."""
    words = [sys.executable, "-c", HOLDER, str(output), json.dumps(REQUEST)]
    process = subprocess.Popen(words, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    return process, int(process.stdout.readline())


def alive(pid: int) -> bool:
    try:
        return "\nState:\tZ" not in Path(f"/proc/{pid}/status").read_text()
    except FileNotFoundError:
        return False


def end(process: subprocess.Popen[str]) -> None:
    process.kill()
    process.communicate()


def test_a_second_one_on_the_same_output_is_refused_by_name_of_the_first(tmp_path: Path) -> None:
    output = tmp_path / "result"
    process, child = holder(output)
    try:
        with pytest.raises(ConfigError, match=rf"another calibration \(process {process.pid}\) already writes to"):
            Journal(output, REQUEST)
        with pytest.raises(ConfigError, match="already writes to"):
            Job.start(Request(bags=("/a",), cell="air_hockey", seed=0, rollouts=0, output=output))
        assert cut_off(output) is None, "it still runs"
        assert alive(child)
    finally:
        end(process)
        os.killpg(child, signal.SIGKILL)


def test_what_was_cut_off_is_known_and_tidied_away(tmp_path: Path) -> None:
    output = tmp_path / "result"
    process, child = holder(output)
    end(process)
    assert alive(child), "an orphan"
    found = cut_off(output)
    assert found is not None
    assert str(found) == "the calibration from 2 paths was cut off in 'calibrate', iteration 7"
    assert (found.bags, found.seed, found.rollouts, found.output) == (("/a", "/b"), 3, 100, str(output))
    assert list(tmp_path.iterdir()) == []
    deadline = time.monotonic() + 300
    while alive(child):
        assert time.monotonic() < deadline
        time.sleep(0.01)
    assert cut_off(output) is None, "it is told once"


def test_a_new_calibration_tidies_up_after_a_killed_one(tmp_path: Path) -> None:
    output = tmp_path / "result"
    process, child = holder(output)
    end(process)
    Journal(output, REQUEST).close()
    assert list(tmp_path.iterdir()) == []
    while alive(child):
        time.sleep(0.01)


@pytest.mark.parametrize(
    "text", ["", "{", "[1]", '{"bags": 3}', '{"process": 1, "folder": "/etc", "output": "/etc/x"}']
)
def test_a_journal_that_is_damaged_or_forged_does_no_harm(tmp_path: Path, text: str) -> None:
    output = tmp_path / "result"
    (tmp_path / "precious").mkdir()
    journal_path(output).write_text(text)
    assert cut_off(output) is None
    assert [path.name for path in tmp_path.iterdir()] == ["precious"]
    assert Path("/etc").is_dir()


def test_a_result_says_what_it_came_from(tmp_path: Path) -> None:
    output, folder = tmp_path / "result", tmp_path / ".result-x"
    folder.mkdir()
    request = Request(bags=("/a",), cell="air_hockey", seed=4, rollouts=0, output=output)
    code = (
        f"import pathlib; p = pathlib.Path({str(folder / 'result')!r}); p.mkdir(); (p / 'result.json').write_text('')"
    )
    journal = Journal(output, request.described())
    job = Job([sys.executable, "-c", code], folder, folder / "result", output, request, journal)
    assert job.finished.wait(60)
    assert job.outcome is Outcome.SUCCEEDED
    assert (output / "origin.yaml").read_text().startswith("bags:\n- /a\ncell: air_hockey\nseed: 4\n")
    assert [path.name for path in tmp_path.iterdir()] == ["result"], "the journal is gone"
