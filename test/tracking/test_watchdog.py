"""The watchdog: tables that are pushed by a known distance, objects that vanish."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from compass_ros.tracking.camera import TableView
from compass_ros.tracking.config import FiducialConfig
from compass_ros.tracking.fiducials import Corners, TableFix
from compass_ros.tracking.scene_config import SceneConfig
from compass_ros.tracking.tracker import Frame, Sighting, TrackerState
from compass_ros.tracking.virtual_camera import make_camera
from compass_ros.tracking.watchdog import Watch, accept, complaints, look, unseen_s
from compass_ros.types import Floats

FIDUCIALS = FiducialConfig()
LIMITS = {"moved_m": 0.002, "lost_s": 2.0}
SECOND = 1_000_000_000


@pytest.fixture(scope="module")
def view() -> TableView:
    return make_camera(SceneConfig()).scene.view


def seen(
    view: TableView | None, at_s: float, *objects: str, images: int = 40, predicted: tuple[str, ...] = ()
) -> Watch:
    return after(Watch(), view, at_s, *objects, images=images, predicted=predicted)


def after(
    watch: Watch,
    view: TableView | None,
    at_s: float,
    *objects: str,
    images: int = 40,
    predicted: tuple[str, ...] = (),
) -> Watch:
    """The watch after one more image in which these objects were measured, or only predicted."""
    fix = TableFix({0: Corners(np.zeros((4, 2)), images)}, view, 0.1, "" if view else "no fiducials in view")
    stamp = round(at_s * SECOND)
    sightings = tuple(
        Sighting(name, stamp, np.zeros(2), np.eye(2), np.zeros(2), name in objects, 1.0)
        for name in (*objects, *predicted)
    )
    return look(watch, TrackerState(fix), Frame(stamp, sightings, fix.problem), FIDUCIALS)


def pushed(view: TableView, by: tuple[float, float, float]) -> TableView:
    """The table moved by x, y, z [m] in its own frame."""
    shift: Floats = view.rotation @ np.array(by)
    return replace(view, translation=view.translation + shift)


@pytest.mark.parametrize("by", [(0.005, 0.0, 0.0), (0.0, -0.003, 0.0), (0.003, 0.004, 0.0)])
def test_a_pushed_table_is_said_with_its_distance(view: TableView, by: tuple[float, float, float]) -> None:
    watch = after(seen(view, 1.0), pushed(view, by), 1.1)
    assert watch.moved_m == pytest.approx(np.hypot(*by[:2]), abs=1e-5)
    (said,) = complaints(watch, (), **LIMITS)
    assert said.startswith(f"the table has moved by {1e3 * np.hypot(*by[:2]):.1f} mm")
    back = after(watch, view, 1.2)
    assert complaints(back, (), **LIMITS) == ()
    accepted = after(accept(watch), pushed(view, by), 1.2)
    assert complaints(accepted, (), **LIMITS) == ()
    assert complaints(after(accepted, view, 1.3), (), **LIMITS) != ()


def test_a_place_is_taken_down_when_it_is_certain(view: TableView) -> None:
    rough = seen(pushed(view, (0.01, 0, 0)), 1.0, images=2)
    assert rough.place is None
    assert complaints(after(rough, view, 1.1), (), **LIMITS) == ()


def test_less_than_the_limit_is_no_alarm(view: TableView) -> None:
    assert complaints(after(seen(view, 1.0), pushed(view, (0.0015, 0, 0)), 1.1), (), **LIMITS) == ()


def test_a_lost_object_is_said_and_predictions_do_not_count(view: TableView) -> None:
    watch = seen(view, 10.0, "puck1")
    watch = after(watch, view, 11.9, predicted=("puck1",))
    assert complaints(watch, ("puck1", "puck2"), **LIMITS) == ()
    watch = after(watch, view, 12.5, predicted=("puck1",))
    assert unseen_s(watch, "puck1") == pytest.approx(2.5)
    assert complaints(watch, ("puck1", "puck2"), **LIMITS) == (
        "puck1 is lost: not seen for 2.5 s",
        "puck2 is lost: not seen at all for 2.5 s",
    )
    assert complaints(after(watch, view, 12.6, "puck1", "puck2"), ("puck1", "puck2"), **LIMITS) == ()


def test_images_that_cannot_be_used_teach_nothing(view: TableView) -> None:
    watch = seen(view, 1.0, "puck1")
    assert after(watch, None, 9.0) == watch
    assert complaints(Watch(), ("puck1",), **LIMITS) == ()


def test_a_recording_that_begins_again(view: TableView) -> None:
    watch = after(seen(view, 100.0, "puck1"), view, 1.0, "puck1")
    watch = after(watch, view, 3.5)
    assert complaints(watch, ("puck1",), **LIMITS) == ("puck1 is lost: not seen for 2.5 s",)
