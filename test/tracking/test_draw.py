"""The overlay draws where things are, on a copy."""

from __future__ import annotations

import numpy as np

from compass_ros.tracking.config import TrackerConfig
from compass_ros.tracking.draw import annotate
from compass_ros.tracking.tracker import Frame, TrackerState, step
from compass_ros.tracking.virtual_camera import VirtualCamera, render
from test.tracking.conftest import held


def test_rims_and_markers_are_drawn_on_a_copy(quiet: VirtualCamera, config: TrackerConfig) -> None:
    view = quiet.scene.view
    image = render(quiet, {"puck1": held(0.2, 0.1)}, 0)
    before = image.copy()
    state, frame = step(TrackerState(), image, 0, view.camera, config)
    out = annotate(image, state, frame, config)
    np.testing.assert_array_equal(image, before)
    changed = (out != image).any(axis=2)
    for point in ([0.2 + 0.0255, 0.1, 0.006], [-0.44 - 0.03, 0.31, 0.0]):
        u, v = view.pixel_from_table(np.array(point)).round().astype(int)
        assert changed[v - 2 : v + 3, u - 2 : u + 3].any()
    assert not changed[230:250, 100:200].any()


def test_a_problem_is_written(quiet: VirtualCamera, config: TrackerConfig) -> None:
    image = np.zeros((480, 640, 3), np.uint8)
    out = annotate(image, TrackerState(), Frame(0, (), "no fiducials in view"), config)
    assert out[5:25, 5:300].any()
    assert not out[100:].any()
