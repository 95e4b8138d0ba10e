"""What a simulator says of itself: what moves, what stands, what can act, and the forces and paths inside a rollout."""

from __future__ import annotations

import numpy as np
import pytest

from compass_ros.simulation.effects import EFFECTS, Attached
from test.simulation.table import DESCRIBED, cell, simulator, values

PUCKS = ("puck1", "puck2")


def test_pucks_move_and_walls_and_bar_stand() -> None:
    assert simulator().movers() == PUCKS
    assert set(simulator().places.walls) == {"front_wall", "back_wall", "left_wall", "right_wall", "obstacle"}
    assert simulator().actuated


@pytest.mark.parametrize(
    ("name", "objects", "can"),
    [
        ("friction_patch", PUCKS, True),
        ("friction_patch", ("pusher",), False),
        ("magnus", ("pusher",), True),
        ("magnus", ("obstacle",), False),
        ("local_wall", ("obstacle",), True),
        ("local_wall", ("puck9",), False),
        ("camera_scale", (), True),
    ],
)
def test_it_knows_what_can_act(name: str, objects: tuple[str, ...], can: bool) -> None:
    assert simulator().accepts(EFFECTS[name], objects) is can


def test_masses_are_those_of_the_values() -> None:
    given = values({"puck2@dyna@mass": 0.0301})[0]
    np.testing.assert_array_equal(simulator().masses(given, PUCKS), [0.03, 0.0301])


def test_paths_are_the_motion_with_its_velocities_and_without_the_camera() -> None:
    time = np.arange(0, 1.0, 0.001)
    paths = simulator().paths(values({"env@camera@bias_x": 0.05}), DESCRIBED[None], time[None], PUCKS)[0]
    motion = simulator().motion(values(), DESCRIBED[None], 1.0).positions[0, : len(time)]
    np.testing.assert_allclose(paths[:, :, :2].reshape(len(time), 4), motion, atol=1e-12)
    moved = np.diff(paths[:, :, :2], axis=0) / 0.001
    np.testing.assert_allclose(paths[1:, :, 2:], moved, atol=1e-9)


def test_a_force_outside_a_rollout_is_the_force_of_its_formula() -> None:
    drag = Attached(EFFECTS["viscous_drag"], PUCKS)
    state = np.array([[0.1, 0.2, 0.3, -0.4, 0.03, 0.0], [0.0, 0.0, 0.0, 0.5, 0.05, 1.0]])
    both = np.stack([state, state], axis=1)[None]
    found = simulator().forces(drag, np.array([[2.0]]), cell().defaults, both)
    expected = -2.0 * state[:, 4:5] * state[:, 2:4]
    np.testing.assert_allclose(found["puck1"][0], expected)
    np.testing.assert_allclose(found["puck2"][0], expected)
