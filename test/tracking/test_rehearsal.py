"""Random shots are shots: discs stay on the table, do not overlap, do not gain energy, and do collide."""

from __future__ import annotations

import numpy as np

from compass_ros.tracking.rehearsal import film, random_shot
from compass_ros.tracking.scene_config import SceneConfig
from compass_ros.tracking.virtual_camera import VirtualCamera

SCENE = SceneConfig()


def test_discs_stay_apart_and_on_the_table_and_are_pushed_about() -> None:
    turns = 0
    for seed in range(4):
        shot = random_shot(SCENE, 2.0, seed)
        for name, pose in shot.poses.items():
            limit = np.array(SCENE.table_m) / 2 - SCENE.discs[name].radius_m
            assert np.all(np.abs(pose[:, :2]) < limit + 0.002)
            steps = np.diff(pose[:, :2], axis=0)
            if name != "pusher":
                turns += int((np.einsum("ij,ij->i", steps[1:], steps[:-1]) < 0).sum())
        gap = np.linalg.norm(shot.poses["puck1"][:, :2] - shot.poses["puck2"][:, :2], axis=1)
        assert gap.min() > 2 * 0.0255 - 0.004
    assert turns > 5


def test_a_shot_repeats_with_its_seed() -> None:
    np.testing.assert_array_equal(random_shot(SCENE, 0.2, 5).poses["puck1"], random_shot(SCENE, 0.2, 5).poses["puck1"])
    assert (random_shot(SCENE, 0.2, 5).poses["puck1"] != random_shot(SCENE, 0.2, 6).poses["puck1"]).any()


def test_images_are_a_period_apart_and_carry_the_truth(camera: VirtualCamera) -> None:
    shot = random_shot(SCENE, 0.1, 1)
    images = list(film(camera, shot, 0.1))
    assert [image.stamp_ns for image in images] == [0, 16666667, 33333333, 50000000, 66666667, 83333333]
    for image in images:
        np.testing.assert_allclose(image.truth["puck1"], shot.at(np.array(image.stamp_ns * 1e-9))["puck1"])
