"""What a wrong cell gets: one line that says where, what, and what was probably meant."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from compass_ros.cells import Cell, load
from compass_ros.cells.loading import cells_folder
from compass_ros.errors import ConfigError
from compass_ros.types import Episode

WRONG = [
    ("puck1@dyna@mass, default: 0.03,", "puck1@dyna@mess, default: 0.03,", "did you mean 'puck1@dyna@mass'"),
    ("puck1@dyna@mass, default: 0.03,", "puck1@dyna@mass, default: 0.05,", "puck1@dyna@mass: default 0.05 is outside"),
    ("half_width: 0.03, target: 0.03,", "half_width: 0.03, target: 3,", "env@camera@bias_x: target 3 is outside"),
    ("half_width: 0.03, target: 0.03,", "half_width: -1, target: 0.03,", "greater than 0"),
    ("half_width: 0.03, target: 0.03,", "half_widht: 0.03, target: 0.03,", "did you mean 'half_width'"),
    ("default: 9.81,", "default: .nan,", "finite number"),
    ("factors: [puck1, puck2]", "factors: [puck1, puk2]", "unknown object 'puk2'"),
    ("factors: [puck1, puck2]", "factors: [puck1, puck1]", "factors: puck1 stands twice"),
    ("factors: [puck1, puck2]", "factors: [{name: a, object: puck1, part: yaw}]", "tracked as xy, without yaw"),
    ("quantity: xy, topic: /puck_tracker/puck1/pose", "quantity: xyw", "objects: puck1: quantity: expected"),
    ("{velocity: 0.0, angle: 0.0}", "{speed: 0.0}", "launch_noise: unknown name 'speed'"),
    ("right_wall@dyna@damping, env@camera@bias_x", "right_wal@dyna@damping, env@camera@bias_x", "right_wall@dyna"),
    ("reach: [-0.36, 0.02]", "reach: [-0.36, -0.3]", "reach [-0.36, -0.3] does not hold"),
    ("low: -0.24, high: -0.21", "low: -0.2, high: -0.21", "expected low < high"),
    ("horizon: 50", "horizon: 0", "horizon"),
    ("dynamics: air_hockey", "dynamics: air_hokey", "did you mean 'air_hockey'"),
    ("model: air_hockey.xml", "model: absent.xml", "no file"),
    ("name: air_hockey\n", "name: air_hockey\nextra: 1\n", "extra"),
]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name in ("air_hockey.yaml", "air_hockey.xml"):
        shutil.copy(cells_folder() / name, tmp_path)
    return tmp_path


@pytest.mark.parametrize(("old", "new", "says"), WRONG)
def test_a_wrong_cell_is_refused_in_one_line(folder: Path, old: str, new: str, says: str) -> None:
    path = folder / "air_hockey.yaml"
    text = path.read_text()
    assert text.count(old) == 1
    path.write_text(text.replace(old, new))
    with pytest.raises(ConfigError) as refused:
        load(path)
    line = str(refused.value)
    assert says in line
    assert "\n" not in line
    assert str(folder) in line


def test_a_missing_parameter_is_named(folder: Path) -> None:
    path = folder / "air_hockey.yaml"
    text = path.read_text()
    start = text.index("  - {name: env@dyna@gravity")
    path.write_text(text[:start] + text[text.index("  - {name: table@dyna@lift") :])
    with pytest.raises(ConfigError, match="env@dyna@gravity is missing"):
        load(path)


def test_a_scene_that_mujoco_refuses_is_named(folder: Path) -> None:
    (folder / "air_hockey.xml").write_text("<mujoco><worldbody><geom/></worldbody></mujoco>")
    with pytest.raises(ConfigError, match=r"air_hockey\.xml: MuJoCo refuses it: .+") as refused:
        load(folder / "air_hockey.yaml")
    assert "\n" not in str(refused.value)


def test_an_unknown_cell_gets_the_nearest_name() -> None:
    with pytest.raises(ConfigError, match="did you mean 'air_hockey'"):
        load("air_hocky")
    with pytest.raises(ConfigError, match=r"absent\.yaml: cannot be read"):
        load("absent.yaml")


def test_the_hash_follows_yaml_and_scene(folder: Path) -> None:
    same = load(folder / "air_hockey.yaml")
    assert same.hash == load("air_hockey").hash
    for name in ("air_hockey.yaml", "air_hockey.xml"):
        path = folder / name
        before = path.read_text()
        path.write_text(before + "\n")
        assert load(folder / "air_hockey.yaml").hash != same.hash
        path.write_text(before)


@pytest.fixture(scope="module")
def cell() -> Cell:
    return load("air_hockey")


def test_values_are_the_defaults_with_the_given_ones_in_place(cell: Cell) -> None:
    values = cell.values({"env@dyna@gravity": 9.8, "puck2@dyna@mass": 0.02995})
    changed = {cell.parameters[i].name: values[i] for i in np.flatnonzero(values != cell.defaults)}
    assert changed == {"env@dyna@gravity": 9.8, "puck2@dyna@mass": 0.02995}


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"env@dyna@gravty": 9.8}, "unknown parameter 'env@dyna@gravty'; did you mean 'env@dyna@gravity'"),
        (
            {"env@dyna@gravity": 99.0},
            r"truth\.yaml: env@dyna@gravity = 99 is outside its bounds \[9\.78, 9\.83\] m/s\^2",
        ),
        ({"env@dyna@gravity": float("nan")}, "nan is outside"),
    ],
)
def test_bad_values_are_refused(cell: Cell, given: dict[str, float], says: str) -> None:
    with pytest.raises(ConfigError, match=says):
        cell.values(given, "truth.yaml")


def test_inputs_follow_the_order_of_the_yaml_whatever_the_order_of_the_action(cell: Cell) -> None:
    action = {"velocity": 0.4, "angle": 0.1, "y": 0.07, "x": -0.22}
    episode = Episode("one", "air_hockey", "", action, 0, ())
    np.testing.assert_array_equal(cell.inputs(episode), [-0.22, 0.07, 0.1, 0.4])
    with pytest.raises(ConfigError, match=r"no \['velocity'\]"):
        cell.inputs(Episode("one", "air_hockey", "", {k: action[k] for k in ("x", "y", "angle")}, 0, ()))
