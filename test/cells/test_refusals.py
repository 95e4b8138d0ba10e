"""A cell that contradicts itself, MuJoCo or its own scene: the line that says so names the parameter."""

from __future__ import annotations

from pathlib import Path

import pytest

from compass_ros.cells import Cell, load
from compass_ros.cells.far import far_from_scene
from compass_ros.cells.units import Unit, read_unit
from compass_ros.errors import ConfigError
from compass_ros.simulation.numerics import unlike_scene
from test.cells.written import DROP, content, parameter, written

YAML = """\
name: drop
dynamics: mjcf
model: scene.xml
horizon: 10
objects: [{name: height, quantity: joint}]
parameters:
  - {name: ball@dyna@mass, field: body_mass, of: ball, unit: kg, default: 0.3, bounds: [0.1, 0.9], half_width: 0.1}
  - {name: height@dyna@damping, field: dof_damping, of: height, unit: N s/m,
     default: 0.1, bounds: [0, 0.417], half_width: 0.1}
"""
PAIR = "parameters: height@dyna@damping: bounds: expected two numbers, the lower and the upper bound, found "
WRONG = [
    ("[0, 0.417]", "[0.417, 0]", "height@dyna@damping: bounds: the lower bound 0.417 is above the upper one 0"),
    ("[0, 0.417]", "[0, 0.2, 0.417]", PAIR + "3, [0, 0.2, 0.417]"),
    ("[0, 0.417]", "[0.417]", PAIR + "1, [0.417]"),
    ("[0, 0.417]", "0.417", PAIR + "0.417"),
    ("[0, 0.417]", "[0, wide]", "height@dyna@damping: bounds: number 2: expected a number, found 'wide'"),
    ("[0, 0.417]", "[-6, 6]", "height@dyna@damping: bounds [-6, 6]: dof_damping cannot be below zero"),
    ("[0.1, 0.9]", "[-0.1, 0.9]", "ball@dyna@mass: bounds [-0.1, 0.9]: body_mass cannot be below zero"),
    ("unit: N s/m,", "", "parameters: height@dyna@damping: unit: missing"),
    ("name: height@dyna@damping, ", "", "parameters: number 2: name: missing"),
    ("half_width: 0.1}\n  -", "half_width: wide}\n  -", "ball@dyna@mass: half_width: expected a number, found 'wide'"),
    ("half_width: 0.1}\n  -", "half_with: 1}\n  -", "ball@dyna@mass: half_with: unknown field, found 1; did you mean"),
    ("unit: kg", "unit: g", "ball@dyna@mass: unit: body_mass is in kg, found 'g'"),
    ("unit: N s/m", "unit: N/m", "unit: dof_damping is in N s/m or N m s/rad, found 'N/m'"),
    ("horizon: 10", "horizon: 10\nname: again", "the key 'name' stands twice, in line 1 and in line 5"),
    ("unit: kg", "unit: kg, unit: kg", "the key 'unit' stands twice, both in line 7"),
    ("horizon: 10", "horizon: 10\n  name: again", "not valid YAML: line 5: mapping values are not allowed here"),
    ("joint}]", "joint}", "line 6: expected ',' or ']', but got '<scalar>', while parsing a flow sequence"),
    ("quantity: joint}", "quantity: joint}, 3", "objects: number 2: expected a mapping of fields, found 3"),
]  # fmt: skip


def refused(folder: Path, text: str) -> str:
    (folder / "scene.xml").write_text(DROP)
    (folder / "cell.yaml").write_text(text)
    with pytest.raises(ConfigError) as caught:
        load(folder / "cell.yaml")
    return str(caught.value)


@pytest.mark.parametrize(("old", "new", "says"), WRONG)
def test_one_line_names_the_parameter_and_what_was_expected(tmp_path: Path, old: str, new: str, says: str) -> None:
    assert YAML.count(old) == 1
    said = refused(tmp_path, YAML.replace(old, new))
    assert says in said
    assert said.startswith(str(tmp_path / "cell.yaml"))
    assert "\n" not in said
    assert "unicode string" not in said


@pytest.mark.parametrize("unit", ["kg", "1", "of the cook", "1000 g"])
def test_units_that_say_the_same_or_nothing_are_taken(tmp_path: Path, unit: str) -> None:
    (tmp_path / "scene.xml").write_text(DROP)
    (tmp_path / "cell.yaml").write_text(YAML.replace("unit: kg", f"unit: '{unit}'"))
    assert load(tmp_path / "cell.yaml").parameters[0].unit == unit


@pytest.mark.parametrize(
    ("text", "factor", "powers"),
    [
        ("kg m^2", 1.0, (2, 1, 0)),
        ("kg*m²", 1.0, (2, 1, 0)),
        ("g cm^2", 1e-7, (2, 1, 0)),
        ("N m s/rad", 1.0, (2, 1, -1)),
        ("Nms/rad", 1.0, (2, 1, -1)),
        ("mN·m", 1e-3, (2, 1, -2)),
        ("1/s^2", 1.0, (0, 0, -2)),
        ("m s^-2", 1.0, (1, 0, -2)),
        ("deg", 0.017453292519943295, (0, 0, 0)),
        ("ms", 1e-3, (0, 0, 1)),
        ("Pa s", 1.0, (-1, 1, -1)),
    ],
)
def test_units_are_read(text: str, factor: float, powers: tuple[int, int, int]) -> None:
    found = read_unit(text)
    assert found is not None
    assert found.same(Unit(factor, powers))


@pytest.mark.parametrize("text", ["", " ", "ticks", "N/(m s)", "kg m^2 ?", "100 g"])
def test_what_is_no_unit_of_ours_says_nothing(text: str) -> None:
    assert read_unit(text) is None


def drop(folder: Path, field: str, of: str, default: float, bounds: tuple[float, float]) -> Cell:
    one = parameter("p@dyna@p", field, of, default) | {"bounds": list(bounds), "half_width": 0.1}
    return written(folder, DROP, content([{"name": "height", "quantity": "joint"}], [one]))


def test_a_mass_in_grams_is_told_beside_the_scene(tmp_path: Path) -> None:
    """300 where the scene has 0.3 kg: within bounds and without a unit nothing else would show it."""
    (said,) = unlike_scene(drop(tmp_path, "body_mass", "ball", 300.0, (0, 900)))
    assert "p@dyna@p begins at 300, and the scene has 0.3 (body_mass of ball)" in said


@pytest.mark.parametrize(
    ("field", "of", "default", "bounds", "far"),
    [
        ("body_mass", "ball", 0.33, (0.1, 0.9), False),
        ("geom_size[0]", "ball", 100.0, (0, 900), True),
        ("opt.gravity[2]", "", -9.81, (-10, -9), False),
        ("geom_friction[1]", "ball", 0.5, (0, 1), False),
        ("geom_friction[1]", "ball", 0.5, (0.1, 1), True),
        ("dof_damping", "height", 0.5, (0.1, 1), False),
    ],
)
def test_only_what_is_far_is_told(
    tmp_path: Path, field: str, of: str, default: float, bounds: tuple[float, float], far: bool
) -> None:
    """Friction of 0.005 that the bounds leave open is a guess of the scene's; damping is not in the scene at all."""
    assert bool([*far_from_scene(drop(tmp_path, field, of, default, bounds))]) is far
