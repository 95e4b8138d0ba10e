"""Distances by factor, against rotations and shifts that are known."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from compass_ros.cells import load
from compass_ros.simulation.factors import factor_distance
from compass_ros.types import Floats

CUBE = load("push_i")


def pose(x: float, yaw: float) -> Floats:
    """(7,) x, y, z and a quaternion, scalar first."""
    quaternion = Rotation.from_euler("z", yaw).as_quat()
    return np.array([x, 0.0, 0.4, quaternion[3], *quaternion[:3]])


def test_position_roll_pitch_and_yaw() -> None:
    found = factor_distance(CUBE, pose(0.1, 0.2), pose(0.4, -0.3))
    assert [f.part for f in CUBE.factors] == ["position", "roll", "pitch", "yaw"]
    assert found == pytest.approx([0.3, 0.0, 0.0, 0.5], abs=1e-9)


def test_angles_are_compared_the_short_way_round() -> None:
    assert factor_distance(CUBE, pose(0.0, 3.1), pose(0.0, -3.1))[3] == pytest.approx(2 * np.pi - 6.2)


def test_many_are_compared_with_one() -> None:
    many = np.array([[pose(0.1, 0.2), pose(0.2, 0.3)], [pose(0.0, 0.0), pose(0.4, 1.0)]])
    found = factor_distance(CUBE, many, many[0, :1])
    assert found.shape == (2, 2, 4)
    assert found[1, 1] == pytest.approx([0.3, 0.0, 0.0, 0.8], abs=1e-9)
