"""Parameters without a hand-made list: none twice, none that changes the scene by itself, each writes what it says."""

from __future__ import annotations

import copy
from pathlib import Path

import mujoco
import numpy as np
import pytest

from compass_ros.cells import Cell, load
from compass_ros.cells.auto import at_defaults, automatic, changed, claimed, with_auto
from compass_ros.cells.fields import PLAIN, Fields
from compass_ros.cells.registry import dynamics_of
from compass_ros.simulation import Simulator
from test.cells.written import PENDULUM, content, parameter, written

MANY = {"air_hockey": 400, "bouncing_ball": 250, "push_i": 250}
"""At least so many parameters of a scene, the cell's own among them."""
BUILT_IN = ("air_hockey", "bouncing_ball", "push_i")


def written_numbers(cell: Cell, index: int) -> set[tuple[str, int]]:
    """What a parameter changes in the model when it leaves its default."""
    dynamics = dynamics_of(cell)
    base, moved = copy.copy(dynamics.model), copy.copy(dynamics.model)
    values = np.tile(cell.defaults, (2, 1))
    values[1, index] += cell.parameters[index].half_width
    dynamics.apply([base, moved], values)
    places = set()
    for array in PLAIN:
        a, b = np.ravel(getattr(base, array)), np.ravel(getattr(moved, array))
        places |= {(array, int(i)) for i in np.flatnonzero(a != b)}
    return places


@pytest.mark.parametrize("name", BUILT_IN)
def test_no_number_is_tuned_twice(name: str) -> None:
    cell = load(name)
    taken = claimed(cell, dynamics_of(cell), at_defaults(cell, dynamics_of(cell)))
    extended = with_auto(cell)
    added = range(len(cell.parameters), len(extended.parameters), 7)
    assert extended.parameters[: len(cell.parameters)] == cell.parameters
    assert len({p.name for p in extended.parameters}) == len(extended.parameters)
    assert len({(p.field, p.of) for p in extended.spec.parameters if p.field}) == sum(
        bool(p.field) for p in extended.spec.parameters
    )
    for index in added:
        written_here = {place for place in written_numbers(extended, index) if not place[0].startswith("body_inertia")}
        assert not written_here & taken, extended.parameters[index].name


@pytest.mark.parametrize("name", BUILT_IN)
def test_at_their_defaults_they_change_nothing(name: str) -> None:
    cell = load(name)
    extended = with_auto(cell)
    action = np.array([[0.5 * (a.low + a.high) for a in cell.action]])
    time = cell.control_dt * np.arange(cell.horizon + 1)[None]
    seen, again = (Simulator(c, threads=1).observe(c.defaults[None], action, time) for c in (cell, extended))
    assert np.abs(seen - again).max() < 1e-9


@pytest.mark.parametrize("name", BUILT_IN)
def test_bounds_hold_the_default_and_the_half_width_fits(name: str) -> None:
    for p in with_auto(load(name)).parameters:
        assert p.low <= p.default <= p.high
        assert 0 < p.half_width <= p.high - p.low, p.name


def test_what_touches_nothing_and_what_cannot_turn_is_left_out() -> None:
    names = [p.name for p in with_auto(load("air_hockey")).parameters]
    assert not any(name.startswith("table@dyna@imp") for name in names), "no puck touches the table's geom"
    assert not any(name.startswith("pusher@dyna@inertia") for name in names), "it only slides"
    assert "pusher+puck1@dyna@stiffness" in names


def test_a_yaml_asks_for_it(tmp_path: Path) -> None:
    own = parameter("arm1@dyna@weight", "body_mass", "arm1", 0.09, 0.001)
    objects = [{"name": "joint1", "quantity": "joint"}]
    cell = written(tmp_path, PENDULUM, content(objects, [own], auto=True, start=[{"object": "joint1"}]))
    names = [p.name for p in cell.parameters]
    assert names[0] == "arm1@dyna@weight"
    assert "arm1@dyna@mass" not in names
    assert {"arm2@dyna@mass", "joint2@dyna@joint_damping", "arm2@dyna@centre_x", "env@dyna@gravity_z"} <= set(names)
    damping = cell.spec.parameters[names.index("joint2@dyna@joint_damping")]
    assert (damping.field, damping.of, damping.default) == ("dof_damping", "joint2", 0.0001)
    values = np.tile(cell.defaults, (2, 1))
    values[1, names.index("joint2@dyna@joint_damping")] = 0.0005
    seen = Simulator(cell, threads=1).observe(values, np.array([[1.0, 0.0]] * 2), np.array([[0.8]] * 2))
    model = mujoco.MjModel.from_xml_string(PENDULUM.replace('damping="0.0001"', 'damping="0.0005"'))
    data = mujoco.MjData(model)
    data.qpos[0] = 1.0
    for _ in range(800):
        mujoco.mj_step(model, data)
    assert seen[1, 0, 0] == pytest.approx(data.qpos[0], abs=1e-6)
    assert abs(seen[1, 0, 0] - seen[0, 0, 0]) > 1e-3


def test_names_that_exist_get_a_second_part() -> None:
    model = mujoco.MjModel.from_xml_string(PENDULUM)
    names = [p.name for p in automatic(model, set(), {"arm2@dyna@mass"})]
    assert "arm2@dyna@mass" not in names
    assert "arm2@dyna@mass_body_mass" in names


@pytest.mark.parametrize("name", BUILT_IN)
def test_the_replayed_scenes_have_hundreds_of_fields(name: str) -> None:
    cell = load(name, "auto")
    assert len(cell.parameters) >= MANY[name]
    assert cell.hash == load(name).hash, "bags of the cell are its bags"
    assert cell.parameters == with_auto(load(name)).parameters


@pytest.mark.parametrize("name", BUILT_IN)
def test_every_one_changes_the_model(name: str) -> None:
    """Hand-made parameters may act outside of it; what was found in the scene is a number of the scene."""
    own, extended = load(name), load(name, "auto")
    dynamics = dynamics_of(extended)
    written = Fields(dynamics.model, list(enumerate(extended.spec.parameters))[len(own.parameters) :], name)
    moved, base = copy.copy(dynamics.model), copy.copy(dynamics.model)
    written.write([base], extended.defaults[None])
    for i in range(len(own.parameters), len(extended.parameters)):
        values = extended.defaults.copy()
        values[i] += extended.parameters[i].half_width
        written.write([moved], values[None])
        assert any(True for _ in changed(base, moved)), extended.parameters[i].name


def test_air_a_force_that_the_drive_adds_and_drag_with_the_square_of_speed() -> None:
    """Three of the fields that the scene leaves at zero, against what their physics says."""
    cell = load("air_hockey", "auto")
    names = [p.name for p in cell.parameters]
    simulator = Simulator(cell, threads=1)
    action = np.tile([-0.225, 0.075, 0.0, 0.45], (4, 1))
    values = np.tile(cell.defaults, (4, 1))
    for row, name in enumerate(
        ("env@dyna@air_density", "puck1_x@dyna@joint_damping_2", "pusher_vx@actuation@offset"), 1
    ):
        parameter = cell.parameters[names.index(name)]
        assert parameter.default == 0.0
        values[row, names.index(name)] = parameter.high
    seen = simulator.observe(values, action, np.tile([[0.3, 0.9]], (4, 1)))
    travelled = seen[:, 1, 0] - seen[:, 0, 0]
    assert (travelled[1:3] < travelled[0] - 1e-6).all(), "air and drag slow puck 1"
    assert abs(seen[3, 1, 0] - seen[0, 1, 0]) > 1e-4, "a drive that pushes by itself strikes harder"
