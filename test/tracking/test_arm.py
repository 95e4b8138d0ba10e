"""The arm's kinematics, forwards against backwards."""

from __future__ import annotations

import numpy as np

from compass_ros.tracking.arm import arm_pose
from compass_ros.tracking.scene_config import ArmConfig
from compass_ros.types import Floats

ARM = ArmConfig()


def forwards(joints: Floats) -> Floats:
    upper, fore = ARM.links_m
    angles = np.cumsum(joints)
    links = np.array([upper, fore]) * np.stack([np.cos(angles), np.sin(angles)])
    return np.asarray(ARM.base_m + links.sum(axis=1))


def test_the_hand_reaches_where_it_is_sent() -> None:
    for hand in np.random.default_rng(0).uniform([-0.36, -0.1], [0.0, 0.09], (100, 2)):
        pose = arm_pose(ARM, hand)
        np.testing.assert_allclose(forwards(pose.joints), hand, atol=1e-9)
        np.testing.assert_allclose(pose.points[2], hand, atol=1e-9)
        np.testing.assert_allclose(np.linalg.norm(np.diff(pose.points, axis=0), axis=1), ARM.links_m)


def test_joints_move_steadily_with_the_hand() -> None:
    path = np.linspace([-0.24, 0.08], [-0.1, -0.05], 200)
    joints = np.array([arm_pose(ARM, hand).joints for hand in path])
    assert np.abs(np.diff(joints, axis=0)).max() < 0.02


def test_out_of_reach_it_stretches_towards_the_hand() -> None:
    pose = arm_pose(ARM, np.array([2.0, 2.0]))
    assert abs(pose.joints[1]) < 0.01
    direction = pose.points[2] - pose.points[0]
    towards = np.array([2.0, 2.0]) - pose.points[0]
    assert abs(np.arctan2(*direction) - np.arctan2(*towards)) < 1e-6
