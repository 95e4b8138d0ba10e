"""The examples run as they stand, and say what the documentation says."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
EXAMPLES = sorted((ROOT / "examples").glob("*.py"))


def run(path: Path, folder: Path) -> str:
    done = subprocess.run([sys.executable, str(path)], cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.name)
def test_an_example_runs_from_any_folder(path: Path, tmp_path: Path) -> None:
    assert run(path, tmp_path).strip()


def test_an_attached_effect_moves_as_in_the_simulator(tmp_path: Path) -> None:
    said = run(ROOT / "examples" / "attach_effect.py", tmp_path)
    assert "differ by 0 mm at most" in said
