"""One virtual camera for all tests of the tracker: drawing its background takes most of a second."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from compass_ros.tracking.camera import TableView
from compass_ros.tracking.config import TrackerConfig
from compass_ros.tracking.scene_config import SceneConfig
from compass_ros.tracking.virtual_camera import VirtualCamera, make_camera
from compass_ros.types import Floats


def held(x: float, y: float, vx: float = 0.0, vy: float = 0.0, exposure_s: float = 0.004) -> Floats:
    """(5, 3) poses of a disc at (x, y) in mid-exposure that moves at (vx, vy)."""
    share = (np.arange(5) + 0.5) / 5 - 0.5
    return np.column_stack([x + vx * share * exposure_s, y + vy * share * exposure_s, np.full(5, 0.3)])


@pytest.fixture(scope="session")
def camera() -> VirtualCamera:
    """With noise, uneven light and an arm."""
    return make_camera(SceneConfig())


@pytest.fixture(scope="session")
def quiet(camera: VirtualCamera) -> VirtualCamera:
    """The same without noise and arm."""
    config = replace(camera.config, arm=None, camera=replace(camera.config.camera, noise=0.0))
    return replace(camera, config=config)


@pytest.fixture(scope="session")
def view(camera: VirtualCamera) -> TableView:
    return camera.scene.view


@pytest.fixture(scope="session")
def config() -> TrackerConfig:
    return TrackerConfig()
