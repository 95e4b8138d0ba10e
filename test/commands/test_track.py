"""`compass track` on bags with images: the poses that were drawn, as a table and as a bag."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from compass_ros.cli import main
from compass_ros.episodes import read_episode
from compass_ros.episodes.notes import Shot
from compass_ros.tracking.rehearsal import Shot as Motion
from compass_ros.tracking.rehearsal import film, random_shot
from compass_ros.tracking.scene_config import SceneConfig
from compass_ros.tracking.virtual_camera import make_camera
from test.commands.image_bags import image_bag
from test.episodes.planted import PUCKS

START_NS = 1_700_000_000_000_000_000
ACTION = {"x": -0.22, "y": 0.07, "angle": 0.0, "velocity": 0.4}


@pytest.fixture(scope="module")
def motion() -> Motion:
    return random_shot(SceneConfig(), 0.3, 3)


@pytest.fixture(scope="module")
def bag(motion: Motion, tmp_path_factory: pytest.TempPathFactory) -> Path:
    camera = make_camera(SceneConfig())
    model = camera.scene.view.camera
    images = [(START_NS + image.stamp_ns, image.bgr) for image in film(camera, motion, 0.3)]
    shot = Shot(START_NS, "air_hockey", ACTION)
    folder = tmp_path_factory.mktemp("bags") / "filmed"
    return image_bag(folder, images, model.matrix.ravel().tolist(), model.distortion.tolist(), shot)


def track(monkeypatch: pytest.MonkeyPatch, bag: Path, out: Path) -> None:
    monkeypatch.setattr(sys, "argv", ["compass", "track", str(bag), "--out", str(out)])
    with pytest.raises(SystemExit) as end:
        main()
    assert not end.value.code


def test_images_of_a_bag_become_a_table(
    bag: Path, motion: Motion, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "tracks.csv"
    track(monkeypatch, bag, out)
    head, *lines = out.read_text().splitlines()
    assert head == "stamp_ns,object,x_m,y_m,std_m"
    assert len(lines) > 40
    for line in lines:
        stamp, name, x, y, std = line.split(",")
        truth = motion.at(np.array((int(stamp) - START_NS) * 1e-9))[name][:2]
        assert np.linalg.norm(truth - [float(x), float(y)]) < 0.003
        assert 0 < float(std) < 0.003


def test_images_of_a_bag_become_a_bag_to_calibrate_with(
    bag: Path, motion: Motion, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    track(monkeypatch, bag, tmp_path / "tracked")
    episode = read_episode(tmp_path / "tracked" / "filmed", PUCKS)
    assert (episode.name, episode.action, episode.start_ns) == ("filmed", ACTION, START_NS)
    for one in episode.tracks:
        truth = motion.at((one.stamp_ns - START_NS) * 1e-9)[one.object][:, :2]
        assert np.linalg.norm(one.value - truth, axis=1).max() < 0.003
