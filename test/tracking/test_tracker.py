"""The whole tracker on filmed shots with known truth."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest

from compass_ros.errors import TrackingError
from compass_ros.tracking.config import TrackerConfig
from compass_ros.tracking.rehearsal import Shot, film, random_shot
from compass_ros.tracking.scene_config import SceneConfig
from compass_ros.tracking.tracker import Frame, TrackerState, step
from compass_ros.tracking.virtual_camera import VirtualCamera, make_camera, render
from compass_ros.types import Floats
from test.tracking.conftest import held

RESTING = {"puck1": held(-0.1, -0.1), "puck2": held(0.25, 0.1), "pusher": held(-0.2, 0.07)}


def track(
    camera: VirtualCamera, shot: Shot, duration_s: float, config: TrackerConfig
) -> list[tuple[Frame, dict[str, Floats]]]:
    state = TrackerState()
    out: list[tuple[Frame, dict[str, Floats]]] = []
    for image in film(camera, shot, duration_s):
        state, frame = step(state, image.bgr, image.stamp_ns, camera.scene.view.camera, config)
        out.append((frame, dict(image.truth)))
    return out


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_shots_with_bounces_and_an_arm(camera: VirtualCamera, config: TrackerConfig, seed: int) -> None:
    frames = track(camera, random_shot(camera.config, 1.5, seed), 1.5, config)
    errors = []
    for frame, truth in frames:
        assert frame.problem == ""
        for sighting in frame.sightings:
            assert sighting.stamp_ns == frame.stamp_ns
            if sighting.seen:
                distance = {name: np.linalg.norm(sighting.xy - pose[:2]) for name, pose in truth.items()}
                assert min(distance, key=lambda name: distance[name]) == sighting.object
                errors.append(distance[sighting.object])
    assert len(errors) > 0.85 * 3 * len(frames)
    assert np.sqrt(np.mean(np.square(errors))) < 0.0007
    assert np.quantile(errors, 0.99) < 0.002


def head_on(y: float) -> Shot:
    """Two pucks that meet head-on at x = 0.1 and part again, with centres never nearer than two radii."""
    time = np.linspace(0, 1.2, 1201)
    gap = np.maximum(np.abs(time - 0.6) * 0.5, 0.0) + 0.0256
    left, right = 0.15 - gap, 0.15 + gap
    zero = np.zeros_like(time)
    return Shot(time, {"puck1": np.stack([left, zero + y, zero], -1), "puck2": np.stack([right, zero + y, zero], -1)})


def test_pucks_of_one_colour_keep_their_names_through_a_collision(camera: VirtualCamera) -> None:
    discs = camera.config.discs
    painted = replace(camera.config, arm=None, discs={**discs, "puck2": discs["puck1"]})
    looks = TrackerConfig().objects
    config = TrackerConfig(objects={"puck1": looks["puck1"], "puck2": looks["puck1"]})
    frames = track(replace(camera, config=painted), head_on(-0.1), 1.2, config)
    seen = 0
    for frame, truth in frames:
        for sighting in frame.sightings:
            seen += sighting.seen
            assert np.linalg.norm(sighting.xy - truth[sighting.object][:2]) < (0.0012 if sighting.seen else 0.03)
    assert seen > 0.9 * 2 * len(frames)


def test_a_hidden_puck_is_bridged_and_its_covariance_says_so(quiet: VirtualCamera, config: TrackerConfig) -> None:
    time = np.linspace(0, 2, 201)
    shot = Shot(time, {"puck1": np.stack([-0.35 + 0.35 * time, 0 * time - 0.1, 0 * time], axis=-1)})
    state = TrackerState()
    stds: list[float] = []
    hidden_errors: list[float] = []
    for image in film(quiet, shot, 1.9):
        picture = image.bgr.copy()
        x = image.truth["puck1"][0]
        if -0.1 < x < 0.02:  # a board over the middle of the table, about 0.3 s long
            cv2.rectangle(picture, (220, 215), (380, 400), (120, 120, 120), -1)
        state, frame = step(state, picture, image.stamp_ns, quiet.scene.view.camera, config)
        (sighting,) = frame.sightings
        if sighting.seen:
            assert sighting.std < 0.001
            stds.clear()
        else:
            stds.append(sighting.std)
            hidden_errors.append(float(np.linalg.norm(sighting.xy - image.truth["puck1"][:2])))
            assert sighting.std > config.bridged_std_m
            assert stds == sorted(stds)
    assert 15 < len(hidden_errors) < 25
    assert max(hidden_errors) < 0.01


def test_a_puck_that_stays_away_is_given_up(quiet: VirtualCamera, config: TrackerConfig) -> None:
    model = quiet.scene.view.camera
    state, _ = step(TrackerState(), render(quiet, RESTING, 0), 0, model, config)
    rest = {name: pose for name, pose in RESTING.items() if name != "puck2"}
    said = []
    for ms in (100, 400, 600, 700):
        state, frame = step(state, render(quiet, rest, 0), ms * 1_000_000, model, config)
        said.append("puck2" in {sighting.object for sighting in frame.sightings})
    assert said == [True, True, False, False]
    state, frame = step(state, render(quiet, RESTING, 0), 800_000_000, model, config)
    assert {s.object for s in frame.sightings if s.seen} == set(RESTING)


def test_no_fiducials_is_a_problem_of_the_frame_and_not_the_end(quiet: VirtualCamera, config: TrackerConfig) -> None:
    model = quiet.scene.view.camera
    state, frame = step(TrackerState(), np.full((480, 640, 3), 128, np.uint8), 0, model, config)
    assert frame.sightings == ()
    assert frame.problem.startswith("no fiducials in view: ")
    state, frame = step(state, render(quiet, RESTING, 0), 16_000_000, model, config)
    assert frame.problem == ""
    assert len(frame.sightings) == 3


def test_late_images_are_refused_and_a_restarted_clock_is_not(quiet: VirtualCamera, config: TrackerConfig) -> None:
    model, image = quiet.scene.view.camera, render(quiet, RESTING, 0)
    state, _ = step(TrackerState(), image, 5_000_000_000, model, config)
    same, late = step(state, image, 4_990_000_000, model, config)
    assert same is state
    assert late.problem.startswith("image out of order")
    _, again = step(state, image, 1_000_000_000, model, config)
    assert again.problem == ""
    assert len(again.sightings) == 3


def test_an_image_of_another_size_is_an_error(quiet: VirtualCamera, config: TrackerConfig) -> None:
    with pytest.raises(TrackingError, match=r"320x240.*camera_info says 640x480"):
        step(TrackerState(), np.zeros((240, 320, 3), np.uint8), 0, quiet.scene.view.camera, config)


def test_pucks_are_tracked_on_a_table_that_stands_shifted(config: TrackerConfig) -> None:
    scene = make_camera(SceneConfig(), 0, (0.03, -0.02))
    _, frame = step(TrackerState(), render(scene, RESTING, 0), 0, scene.scene.view.camera, config)
    for sighting in frame.sightings:
        assert np.linalg.norm(sighting.xy - RESTING[sighting.object][:, :2].mean(axis=0)) < 0.001
    assert len(frame.sightings) == 3
