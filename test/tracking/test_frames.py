"""Where the camera hangs in the tree of frames: six trees as drivers make them."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from compass_ros.tracking.frames import Place, hang

RNG = np.random.default_rng(3)


def some_place() -> Place:
    return Place(Rotation.random(random_state=RNG).as_matrix(), RNG.normal(size=3))


CAMERA = some_place()
"""Of the optical frame in the table."""
LINK, COLOUR, STAND, TABLE = (some_place() for _ in range(4))
REALSENSE = {"optical": ("colour", COLOUR), "colour": ("link", LINK)}
WORLD = {"table": ("world", TABLE)}


@pytest.mark.parametrize(
    ("tree", "child"),
    [
        ({}, "optical"),
        (WORLD, "optical"),
        (REALSENSE, "link"),
        (REALSENSE | WORLD, "link"),
        (REALSENSE | {"link": ("stand", STAND)}, "stand"),
        ({"optical": ("optical", COLOUR)}, "optical"),  # a frame that is its own parent
    ],
)
def test_the_root_of_its_tree_is_hung_so_that_the_camera_is_where_it_was_seen(
    tree: dict[str, tuple[str, Place]], child: str
) -> None:
    found = hang("optical", CAMERA, "table", tree)
    assert found is not None
    assert found.child == child
    place = found.place
    for frame in {"link": ("colour", "optical"), "stand": ("link", "colour", "optical")}.get(child, ()):
        place = place @ tree[frame][1]
    assert place.near(CAMERA, 1e-12, 1e-12)


@pytest.mark.parametrize(
    "tree",
    [
        {"optical": ("table", CAMERA)},
        REALSENSE | {"link": ("table", LINK)},
        REALSENSE | {"link": ("world", LINK)} | WORLD,
    ],
)
def test_a_camera_that_hangs_already_is_left_alone(tree: dict[str, tuple[str, Place]]) -> None:
    assert hang("optical", CAMERA, "table", tree) is None


def test_an_inverse_leads_back_and_near_is_a_distance_and_an_angle() -> None:
    here = some_place()
    assert (here @ here.inverse).near(Place(np.eye(3), np.zeros(3)), 1e-12, 1e-12)
    turned = Place(here.rotation @ Rotation.from_rotvec([0.01, 0, 0]).as_matrix(), here.translation)
    assert here.near(turned, 0, 0.0101)
    assert not here.near(turned, 0, 0.0099)
    assert not here.near(Place(here.rotation, here.translation + 0.01), 0.017, 1)
