"""Where things are written when nobody says where: eight environments, among them none."""

from __future__ import annotations

import os
import pwd
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from compass_ros.places import data_home, placed

HOME = pwd.getpwuid(os.getuid()).pw_dir


@pytest.mark.parametrize(
    ("environment", "expected"),
    [
        ({"HOME": "/home/ann"}, "/home/ann/.local/share/compass_ros"),
        ({"HOME": "/home/ann", "XDG_DATA_HOME": "/data"}, "/data/compass_ros"),
        ({"HOME": "/home/ann", "XDG_DATA_HOME": "data"}, "/home/ann/.local/share/compass_ros"),  # must be absolute
        ({"HOME": "/home/ann", "XDG_DATA_HOME": "/data", "ROS_HOME": "/ros"}, "/ros/compass_ros"),
        ({"ROS_HOME": "/ros"}, "/ros/compass_ros"),
        ({"XDG_DATA_HOME": "/data"}, "/data/compass_ros"),
        ({}, f"{HOME}/.local/share/compass_ros"),
        ({"HOME": ""}, f"{HOME}/.local/share/compass_ros"),
    ],
)
def test_the_folder_does_not_depend_on_where_one_stands(
    environment: dict[str, str], expected: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    for name in ("HOME", "XDG_DATA_HOME", "ROS_HOME"):
        monkeypatch.delenv(name, raising=False)
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    for place in ("/", tmp_path):
        monkeypatch.chdir(place)
        assert data_home() == Path(expected)


def test_a_user_whom_nobody_knows_has_a_folder_too() -> None:
    """As in a container that is started with a number for a user."""
    code = "import os; from compass_ros.places import data_home; os.setuid(54321); print(data_home())"
    if os.getuid() != 0:
        pytest.skip("only root can become somebody else")
    kept = {k: v for k, v in os.environ.items() if k not in ("HOME", "XDG_DATA_HOME", "ROS_HOME")}
    done = subprocess.run([sys.executable, "-c", code], env=kept, check=True, capture_output=True, text=True)
    assert done.stdout.strip() == f"{tempfile.gettempdir()}/compass_ros-54321"


def test_a_folder_that_is_named_goes_before(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("HOME", "/home/ann")
    default = Path("/data/bags")
    assert placed("", default) == default
    assert placed("/a", default) == Path("/a")
    assert placed("a", default) == tmp_path / "a"
    assert placed("~/a", default) == Path("/home/ann/a")
