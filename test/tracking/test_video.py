"""A video file in, tracks out; and the one line for every bad file."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from compass_ros.errors import TrackingError
from compass_ros.tracking.config import TrackerConfig
from compass_ros.tracking.rehearsal import Shot, film, random_shot
from compass_ros.tracking.video import StampedImage, track_images, track_video, video_length
from compass_ros.tracking.virtual_camera import VirtualCamera


@pytest.fixture(scope="module")
def shot(camera: VirtualCamera) -> Shot:
    return random_shot(camera.config, 0.5, 3)


@pytest.fixture(scope="module")
def video(camera: VirtualCamera, shot: Shot, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("video") / "shot.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 60, (640, 480))
    for image in film(camera, shot, 0.5):
        writer.write(image.bgr)
    writer.release()
    return path


def test_a_compressed_video_gives_the_tracks_that_it_shows(
    camera: VirtualCamera, config: TrackerConfig, shot: Shot, video: Path
) -> None:
    counts: list[int] = []
    tracks = track_video(video, camera.scene.view.camera, config, start_ns=7_000_000_000, tick=counts.append)
    assert counts == list(range(1, 31))
    assert video_length(video) == 30
    assert [track.object for track in tracks] == ["puck1", "puck2", "pusher"]
    for track in tracks:
        assert track.quantity == "xy"
        assert np.all(np.diff(track.stamp_ns) > 0)
        assert track.std is not None
        assert len(track.std) == len(track.stamp_ns) > 20
        truth = shot.at((track.stamp_ns - 7_000_000_000) * 1e-9)[track.object][:, :2]
        assert np.sqrt(((track.value - truth) ** 2).sum(axis=1).mean()) < 0.001


def test_bad_files_get_one_line(camera: VirtualCamera, config: TrackerConfig, tmp_path: Path) -> None:
    model = camera.scene.view.camera
    with pytest.raises(TrackingError, match="no such file"):
        track_video(tmp_path / "none.mp4", model, config)
    text = tmp_path / "text.avi"
    text.write_text("not a video")
    with pytest.raises(TrackingError, match="not a video"):
        track_video(text, model, config)


def test_images_without_fiducials_get_one_line(camera: VirtualCamera, config: TrackerConfig) -> None:
    gray = [StampedImage(i, np.full((480, 640, 3), 99, np.uint8)) for i in range(3)]
    with pytest.raises(TrackingError, match="bag: none of 3 images could be used: no fiducials in view: 0 of"):
        track_images(gray, camera.scene.view.camera, config, "bag")
    with pytest.raises(TrackingError, match="bag: none of 0 images could be used: no images"):
        track_images([], camera.scene.view.camera, config, "bag")
    with pytest.raises(TrackingError, match="bag: image 0: image is 64x48"):
        track_images([StampedImage(0, np.zeros((48, 64, 3), np.uint8))], camera.scene.view.camera, config, "bag")
