"""The script of docs/many.md with a `compass` that only pretends: what it skips, what it notes, what stops it."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import time
from pathlib import Path

import pytest

from test.tutorials import DOCS, tutorial

SCRIPT = "overnight.sh"
PRETENDED = """\
#!/bin/bash
while [ $# -gt 1 ]; do [ "$1" = --out ] && out=$2; shift; done
week=$(basename "$1")
echo "$week" >> calls.txt
if [ -f waits.txt ]; then
  sleep 60 &
  trap 'kill $!; echo "$week" >> stopped.txt; exit 130' TERM
  touch begun.txt
  wait $!
fi
mkdir -p "$out"
status=$(cat "$week.status" 2>/dev/null || echo 0)
[ "$status" = 0 ] && cp complete.json "$out/result.json"
exit "$status"
"""
"""Ends with what WEEK.status says; with waits.txt it takes a minute, unless it is stopped."""
COMPLETE = '{\n "cancelled": false,\n "mismatch": {"verdict": "not_evaluated", "sentence": "it was switched off."}\n}\n'
UNENDED = COMPLETE.replace("it was switched off", "Missing physics was not looked for: the search has not ended")


@pytest.fixture
def night(tmp_path: Path) -> Path:
    """Three weeks and the script."""
    tutorial(DOCS / "many.md").write(tmp_path)
    for week in ("a", "b week", "c"):
        (tmp_path / "weeks" / week).mkdir(parents=True)
    (tmp_path / "bin").mkdir()
    (tmp_path / "bin" / "compass").write_text(PRETENDED)
    (tmp_path / "bin" / "compass").chmod(0o755)
    (tmp_path / "complete.json").write_text(COMPLETE)
    return tmp_path


def begun(folder: Path) -> subprocess.Popen[bytes]:
    path = f"{folder / 'bin'}:{os.environ['PATH']}"
    return subprocess.Popen(["bash", SCRIPT], cwd=folder, env=os.environ | {"PATH": path}, start_new_session=True)


def lines(path: Path) -> list[str]:
    return path.read_text().splitlines() if path.exists() else []


def left(folder: Path, week: str, content: str) -> None:
    """A result from an earlier night."""
    (folder / "out" / week).mkdir(parents=True)
    (folder / "out" / week / "result.json").write_text(content)


def test_what_is_complete_is_skipped_also_without_the_search(night: Path) -> None:
    left(night, "a", COMPLETE)
    left(night, "b week", UNENDED)
    left(night, "c", COMPLETE.replace("false", "true"))
    assert begun(night).wait(30) == 0
    assert lines(night / "calls.txt") == ["b week", "c"]
    assert begun(night).wait(30) == 0
    assert lines(night / "calls.txt") == ["b week", "c"], "now all are complete"


def test_a_failure_is_noted_with_date_folder_and_status_and_tried_again(night: Path) -> None:
    (night / "b week.status").write_text("1")
    assert begun(night).wait(30) == 0
    (line,) = lines(night / "out" / "failed.txt")
    assert re.fullmatch(r"\d{4}-\d\d-\d\d \d\d:\d\d:\d\d weeks/b week status 1", line)
    (night / "b week.status").unlink()
    assert begun(night).wait(30) == 0
    assert lines(night / "calls.txt") == ["a", "b week", "c", "b week"]
    assert lines(night / "out" / "failed.txt") == []


def test_a_calibration_that_was_stopped_stops_the_night_and_is_no_failure(night: Path) -> None:
    (night / "a.status").write_text("130")
    assert begun(night).wait(30) == 130
    assert lines(night / "calls.txt") == ["a"]
    assert lines(night / "out" / "failed.txt") == []


@pytest.mark.parametrize(("what", "group"), [(signal.SIGTERM, False), (signal.SIGINT, True), (signal.SIGTERM, True)])
def test_a_signal_stops_what_runs_and_the_night(
    night: Path, what: signal.Signals, group: bool, hear_ctrl_c: None
) -> None:
    """`kill` of the script alone; Ctrl-C and a scheduler's end, which all of its processes get."""
    (night / "waits.txt").touch()
    running = begun(night)
    deadline = time.monotonic() + 30
    while not (night / "begun.txt").exists() and time.monotonic() < deadline:
        time.sleep(0.02)
    (os.killpg if group else os.kill)(running.pid, what)
    assert running.wait(30) == 130
    assert lines(night / "calls.txt") == ["a"]
    assert "a" in lines(night / "stopped.txt")
    assert lines(night / "out" / "failed.txt") == []
