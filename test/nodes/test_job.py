"""A calibration as a process: real processes, small ones, that behave well and badly."""

from __future__ import annotations

import json
import math
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest

from compass_ros.errors import ConfigError
from compass_ros.nodes.job import Job, Outcome, Request, command, prepare, read_step

LINE = {"stage": "calibrate", "iteration": 2, "done": 0.25, "gap": 0.5, "sparsity": None}


def run(tmp_path: Path, script: str) -> Job:
    """A job whose process is a Python script; `folder`, `result` and `say` are defined in it."""
    output = tmp_path / "out"
    folder = prepare(output)
    head = f"""
import json, pathlib, sys, time
folder, line = pathlib.Path({str(folder)!r}), {LINE!r}
result = folder / "result"
def say(**changes): print(json.dumps(line | changes), flush=True)
"""
    return Job([sys.executable, "-c", head + script], folder, folder / "result", output)


WRITE = "result.mkdir(); (result / 'result.json').write_text(sys.argv[0]);"


def test_success_takes_the_name_of_the_output_and_leaves_nothing_else(tmp_path: Path) -> None:
    job = run(tmp_path, f"say(); say(done=1.0); {WRITE}")
    assert job.finished.wait(60)
    assert (job.outcome, job.message) == (Outcome.SUCCEEDED, f"result in {tmp_path / 'out'}")
    assert [step.progress.done for step in job.steps()] == [0.25, 1.0]
    assert job.steps() == []
    assert [path.relative_to(tmp_path).as_posix() for path in tmp_path.rglob("*")] == ["out", "out/result.json"]


def test_an_earlier_result_is_replaced_whole(tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    for name in ("result.json", "old.html"):
        (tmp_path / "out" / name).write_text("old")
    assert run(tmp_path, WRITE).finished.wait(60)
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["result.json"]
    assert (tmp_path / "out" / "result.json").read_text() == "-c"


@pytest.mark.parametrize(
    ("script", "message"),
    [
        ("print('half a warning\\ncompass: bag.mcap: truncated', file=sys.stderr); sys.exit(1)", "bag.mcap: truncated"),
        ("sys.exit(1)", "it said nothing"),
        ("1 / 0", "ZeroDivisionError: division by zero"),
        ("sys.exit(2)", "the calibration process ended with status 2: it said nothing"),
        ("import os; os.kill(os.getpid(), 9)", "the calibration process ended with status -9: it said nothing"),
        ("print('hello'); sys.stdout.flush(); time.sleep(600)", "expected progress as JSON, found b'hello\\n'"),
        ("print('{}'); sys.stdout.flush(); time.sleep(600)", "expected progress as JSON, found b'{}\\n'"),
    ],
)
def test_failure_is_one_line_and_keeps_the_earlier_result(tmp_path: Path, script: str, message: str) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "result.json").write_text("old")
    job = run(tmp_path, WRITE + script)
    assert job.finished.wait(60)
    assert job.outcome is Outcome.FAILED
    assert message in job.message
    assert "\n" not in job.message
    assert not job.message.startswith("compass:")
    assert [path.relative_to(tmp_path).as_posix() for path in tmp_path.rglob("*")] == ["out", "out/result.json"]
    assert (tmp_path / "out" / "result.json").read_text() == "old"


def test_cancel_ends_a_deaf_process_and_its_children_and_leaves_nothing(tmp_path: Path) -> None:
    job = run(
        tmp_path,
        "import signal, subprocess; signal.signal(signal.SIGTERM, signal.SIG_IGN);"
        "child = subprocess.Popen([sys.executable, '-c', 'import time; time.sleep(600)']);"
        f"{WRITE} say(iteration=child.pid); time.sleep(600)",
    )
    deadline = time.monotonic() + 300
    while not (steps := job.steps()):
        assert time.monotonic() < deadline
        time.sleep(0.01)
    child = Path("/proc", str(steps[0].progress.iteration))
    assert child.exists()
    job.cancel()
    assert job.finished.wait(300), "before the deaf process would have ended by itself"
    assert (job.outcome, job.message) == (Outcome.CANCELLED, "cancelled; nothing was written")
    assert list(tmp_path.iterdir()) == []
    while child.exists() and "\nState:\tZ" not in (child / "status").read_text():
        assert time.monotonic() < deadline
        time.sleep(0.01)


def test_cancel_after_the_end_changes_nothing(tmp_path: Path) -> None:
    job = run(tmp_path, WRITE)
    assert job.finished.wait(60)
    job.cancel()
    assert job.outcome is Outcome.SUCCEEDED
    assert (tmp_path / "out" / "result.json").exists()


def test_a_foreign_folder_is_not_overwritten(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("years of work")
    with pytest.raises(ConfigError, match="holds no earlier calibration; it is not overwritten"):
        prepare(tmp_path)
    with pytest.raises(ConfigError, match="cannot be written: File exists"):
        prepare(tmp_path / "thesis.tex" / "out")


def test_progress_has_the_time_that_is_left() -> None:
    step = read_step(json.dumps(LINE).encode(), 30.0)
    assert step.seconds_left == 90.0
    assert (step.progress.stage, step.progress.iteration, step.progress.gap) == ("calibrate", 2, 0.5)
    assert math.isnan(step.progress.sparsity)
    assert math.isnan(read_step(json.dumps(LINE | {"done": 0}).encode(), 30.0).seconds_left)


def test_command_hands_on_everything_and_the_report_gives_what_a_user_types() -> None:
    request = Request(bags=("a", "b c"), cell="air_hockey", seed=3, rollouts=0, output=Path("out"), method="compass")
    words = ["--cell", "air_hockey", "--method", "compass", "--seed", "3", "--out"]
    typed = "compass calibrate --cell air_hockey --method compass --seed 3 --out out -- a 'b c'"
    start = ["calibrate", "--progress", "json", "--repeat", typed]
    assert command(request, Path("tmp"))[3:] == [*start, *words, "tmp", "--", "a", "b c"]
    budget = Request(bags=("a",), cell="x.yaml", seed=0, rollouts=500, output=Path("out"))
    assert command(budget, Path("tmp"))[-6:] == ["--rollouts", "500", "--out", "tmp", "--", "a"]
    seldom = replace(budget, rollouts=0, false_alarm=0.001)
    assert command(seldom, Path("tmp"))[-6:] == ["--false-alarm", "0.001", "--out", "tmp", "--", "a"]
