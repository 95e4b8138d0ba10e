"""A cell's YAML that extends another one: what it has itself counts, the rest is the other's."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from compass_ros.cells import load
from compass_ros.cells.loading import cells_folder
from compass_ros.errors import ConfigError
from compass_ros.simulation import Simulator
from test.simulation.table import WIDE


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name in ("air_hockey.yaml", "air_hockey.xml"):
        shutil.copy(cells_folder() / name, tmp_path)
    return tmp_path


def write(path: Path, text: str) -> Path:
    path.parent.mkdir(exist_ok=True)
    path.write_text(text)
    return path


def test_what_stands_in_neither_place_and_what_stands_in_both(folder: Path) -> None:
    base = load(folder / "air_hockey.yaml")
    path = write(folder / "near.yaml", "extends: air_hockey.yaml\nnoise_m: 0.004\nfactors: [puck2]\n")
    cell = load(path)
    assert (cell.spec.noise_m, [f.name for f in cell.factors]) == (0.004, ["puck2"])
    assert (cell.name, cell.parameters, cell.path) == (base.name, base.parameters, path)
    assert cell.hash != base.hash


def test_the_scene_is_found_from_another_folder_and_over_several_steps(folder: Path) -> None:
    write(folder / "near.yaml", "extends: air_hockey.yaml\nnoise_m: 0.004\n")
    far = load(write(folder / "below" / "far.yaml", "extends: ../near.yaml\nhorizon: 20\n"))
    assert (far.spec.noise_m, far.horizon) == (0.004, 20)
    assert far.model_path.samefile(folder / "air_hockey.xml")


@pytest.mark.parametrize("changed", ["air_hockey.yaml", "air_hockey.xml", "near.yaml", "last.yaml"])
def test_the_hash_is_of_all_files(folder: Path, changed: str) -> None:
    write(folder / "near.yaml", "extends: air_hockey.yaml\n")
    last = write(folder / "last.yaml", "extends: near.yaml\n")
    before = load(last).hash
    comment = "<!-- same -->\n" if changed.endswith("xml") else "# same\n"
    (folder / changed).write_text((folder / changed).read_text() + comment)
    assert load(last).hash != before


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("extends: absent.yaml\n", r"absent\.yaml: cannot be read"),
        ("extends: 3\n", "extends: expected the path of a cell's YAML, found 3"),
        ("extends: near.yaml\n", "extends this one itself"),
        ("extends: round.yaml\n", "extends this one itself"),
        ("extends: air_hockey.yaml\nnoise: 1\n", "noise"),
        ("extends: air_hockey.yaml\nmodel: absent.xml\n", r"no file .*absent\.xml"),
    ],
)
def test_mistakes_are_one_line(folder: Path, text: str, says: str) -> None:
    write(folder / "round.yaml", "extends: near.yaml\n")
    path = write(folder / "near.yaml", text)
    with pytest.raises(ConfigError, match=says) as refused:
        load(path)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("name", ["air_hockey_tool", "air_hockey_encoders"])
def test_the_shipped_variants_are_the_same_table(name: str) -> None:
    """Without recordings they play a command as the table does, to the last bit or, stiff, almost."""
    base, cell = load("air_hockey"), load(name)
    assert (cell.name, cell.parameters) == (base.name, base.parameters)
    time = np.tile(np.arange(0, 0.5, 1 / 60), (len(WIDE), 1))
    values = np.tile(base.defaults, (len(WIDE), 1))
    inputs = np.pad(WIDE, ((0, 0), (0, len(cell.input_names) - WIDE.shape[1])))
    seen = Simulator(cell, threads=1).observe(values, inputs, time)
    expected = Simulator(base, threads=1).observe(values, WIDE, time)
    if cell.spec.signals:
        assert np.array_equal(seen[:, :, :4], expected)
        bodies = Simulator(cell, threads=1).bodies(values[0], inputs[0], time[0])["pusher"]
        np.testing.assert_allclose(seen[0, :, 4:], bodies[:, :2], atol=1e-12)
    else:
        assert np.abs(seen - expected).max() < 0.02


@pytest.mark.parametrize(
    ("more", "says"),
    [
        ("objects: [{name: puck1, quantity: xy}]\nfactors: [puck1]\n", "objects: expected puck1 and puck2, each xy"),
        ("signals: [{name: tool, quantity: position, at: [pusher]}]\n", "positions and velocities of joints"),
        ("signals: [{name: tool, quantity: joint_position, of: [pusher_z]}]\n", "pusher_z"),
    ],
)
def test_the_table_says_what_it_can_be_asked(folder: Path, more: str, says: str) -> None:
    with pytest.raises(ConfigError, match=says):
        load(write(folder / "near.yaml", f"extends: air_hockey.yaml\n{more}"))
