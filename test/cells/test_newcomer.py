"""From an XML, CSV files and two YAMLs to a report, by the command line alone, as docs/my-ball.md says."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from test.conftest import Run
from test.tutorials import DOCS, tutorial

PAGE = tutorial(DOCS / "my-ball.md")


def test_a_scene_with_an_endless_name_is_refused_with_one_line(run: Run, tmp_path: Path) -> None:
    (tmp_path / "lab.yaml").write_text(PAGE.files["lab.yaml"].replace("lab.xml", "x" * 5000))
    status, _, error = run("calibrate", "--cell", tmp_path / "lab.yaml", "--out", tmp_path / "out", tmp_path)
    assert status == 1
    assert "model: String should have at most 200 characters" in error
    assert len(error) < 600


@pytest.mark.slow
def test_a_free_body_from_tables(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every file and every command of the page, in its order; the last one is for next week."""
    PAGE.write(tmp_path)
    subprocess.run([sys.executable, "throws.py"], cwd=tmp_path, check=True)
    monkeypatch.chdir(tmp_path)
    programs = [line.split()[:2] for line in PAGE.commands]
    assert programs == [["python", "throws.py"], *(["compass", name] for name in ("import", "check", "calibrate"))]
    for line in PAGE.commands[1:]:
        status, _, error = run(*line.split()[1:])
        assert status == 0, error
    result = json.loads((tmp_path / "result" / "result.json").read_text())
    found = {row["name"]: row for row in result["parameters"]}
    assert found["floor@contact@damping"]["value"] == pytest.approx(-40, rel=0.1)
    assert (result["mismatch"]["verdict"], len(result["episodes"]["fit"])) == ("none", 4)
    assert (tmp_path / "result" / "report.html").is_file()
