"""The tutorials as a reader follows them: what takes seconds is run, all else is what the command line takes."""

from __future__ import annotations

import json
import re
import shlex
import subprocess
import sys
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from typer.main import get_command

from compass_ros.cli import app
from test.tutorials import DOCS, tutorial

ROOT = DOCS.parent
PAGES = [ROOT / "README.md", *sorted(DOCS.glob("*.md"))]
SEARCHES = "compass calibrate --cell arm.yaml --out out bags"
"""Takes minutes."""


@cache
def commands() -> dict[str, Any]:
    """By name."""
    return dict(get_command(app).commands)  # type: ignore[attr-defined]


def follow(line: str, folder: Path) -> str:
    """Runs one command of a page."""
    program, *words = shlex.split(line)
    module = ["-m", "compass_ros.cli"] if program == "compass" else []
    done = subprocess.run([sys.executable, *module, *words], cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{line}: {done.stderr}"
    return done.stdout


@pytest.mark.slow
def test_my_arm_from_urdf_to_its_parameters(tmp_path: Path) -> None:
    """With what was planted in the page's own robot as the truth."""
    page = tutorial(DOCS / "my-arm.md")
    page.write(tmp_path)
    lines = page.commands[: page.commands.index(SEARCHES)]
    assert [line.split()[:2] for line in lines] == [
        ["python", "record.py"],
        *(["compass", name] for name in ("import", "init", "check", "calibrate")),
    ]
    said = [follow(line, tmp_path) for line in lines]
    assert "Usable? Yes, 3 recordings." in said[3]
    result = json.loads((tmp_path / "out" / "result.json").read_text())
    found = {row["name"]: row["value"] for row in result["parameters"]}
    assert found["shoulder@dyna@frictionloss"] == pytest.approx(0.4, rel=0.05)
    assert found["shoulder@actuation@gain"] == pytest.approx(60, rel=0.02)
    assert result["gap"]["calibrated"]["held_out"]["rmse_m"] < 1.1 * result["gap"]["noise_floor_m"]
    assert (tmp_path / "out" / "report.html").is_file()


@pytest.mark.slow
def test_the_shipped_bags_are_as_the_table_says(tmp_path: Path) -> None:
    first = tutorial(DOCS / "the-table.md").commands[0]
    assert "Usable? Yes" in follow(first, ROOT)


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.stem)
def test_every_command_of_a_page_is_one_that_the_command_line_takes(path: Path) -> None:
    """Names, options, their values and the number of arguments, without running anything."""
    page, targets = tutorial(path), set(re.findall(r"^([a-z]+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    for line in page.commands:
        program, *words = shlex.split(line)
        if program == "compass":
            if words != ["--version"]:
                commands()[words[0]].make_context(words[0], words[1:]).close()
        elif program == "make":
            assert words[0] in targets, line
        elif program == "python":
            assert words[0] in page.files or (ROOT / words[0]).is_file(), line
        else:
            assert program == "pip" or path.name not in ("my-arm.md", "my-ball.md", "the-table.md"), line
