"""Worlds through the real command line: concealed, calibrated by a process that cannot see the answers, unsealed."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from compass_ros.proof.one_world import Suite, run

BLIND = [sys.executable, "-m", "compass_ros.concealed.blind"]


def compass(*arguments: str | Path, blind_to: Path | None = None) -> subprocess.CompletedProcess[str]:
    start = [*BLIND, str(blind_to)] if blind_to else [sys.executable, "-m", "compass_ros.cli"]
    return subprocess.run([*start, *map(str, arguments)], capture_output=True, text=True, check=False)


def refused(code: str, folder: Path) -> str:
    """What the interpreter says when code runs after the answers were sealed for it."""
    seal = f"from compass_ros.concealed.blind import refuse\nfrom pathlib import Path\nrefuse(Path({str(folder)!r}))"
    done = subprocess.run([sys.executable, "-c", f"{seal}\n{code}"], capture_output=True, text=True, check=False)
    return done.stderr if done.returncode else ""


@pytest.mark.parametrize(
    "code",
    [
        "open('{}/a.json')",
        "Path('{}/a.json').read_text()",
        "import os; os.open('{}/a.json', os.O_RDONLY)",
        "list(Path('{}').iterdir())",
        "import os; os.link('{}/a.json', '{}/../b.json')",
        "import shutil; shutil.copyfile('{}/a.json', '/dev/null')",
        "import compass_ros.concealed.world",
    ],
)
def test_a_blind_process_cannot_look(tmp_path: Path, code: str) -> None:
    answers = tmp_path / "answers"
    answers.mkdir()
    (answers / "a.json").write_text("{}")
    assert "sealed for this process" in refused(code.replace("{}", str(answers)), answers)


def test_a_blind_process_cannot_look_through_a_link(tmp_path: Path) -> None:
    answers = tmp_path / "answers"
    answers.mkdir()
    (answers / "a.json").write_text("{}")
    (tmp_path / "innocent").symlink_to(answers)
    assert "sealed for this process" in refused(f"open('{tmp_path}/innocent/a.json')", answers)


def test_a_blind_process_can_do_everything_else(tmp_path: Path) -> None:
    (tmp_path / "answers").mkdir()
    (tmp_path / "free.txt").write_text("x")
    assert refused(f"open('{tmp_path}/free.txt'); import compass_ros.pipeline", tmp_path / "answers") == ""


@pytest.mark.nightly
def test_a_sealed_world() -> None:
    """The seal holds, the calibrator never opened the answer, and its verdict is right; nothing missing: test_demo."""
    line: Any = run(Suite("tilt", ("--effect", "table_tilt", "--rms", "4e-3"), 2), 2, "default", threads=2)
    assert line["error"] is None, line["error"]
    marks = line["marks"]
    assert marks["right"], marks
    assert marks["held_out_m"]["calibrated"] < 0.4 * marks["held_out_m"]["nominal"]


@pytest.mark.nightly
def test_conceal_and_unseal_as_a_user_types_them(tmp_path: Path) -> None:
    world, answers = tmp_path / "world", tmp_path / "answers"
    asked = ("--seed", "4", "--effect", "off_centre_mass", "--rms", "3e-3", "--noise", "tracker")
    done = compass("conceal", *asked, "--out", world, "--answers", answers)
    assert done.returncode == 0, done.stderr
    assert len(list(world.glob("shot_*/*.mcap"))) == 12
    shown = compass("unseal", world, "--answers", answers)
    strength = re.match(r"true: off_centre_mass on puck1 and puck2, ([\d.]+) mm rms", shown.stdout)
    assert strength, shown.stdout
    assert float(strength[1]) == pytest.approx(3.0, rel=0.16)
    taken = compass("conceal", *asked, "--out", world, "--answers", answers)
    assert (taken.returncode, len(taken.stderr.splitlines())) == (1, 1)
    assert "is not empty" in taken.stderr
    next(answers.glob("*.json")).unlink()
    gone = compass("unseal", world, "--answers", answers)
    assert (gone.returncode, len(gone.stderr.splitlines())) == (1, 1)
