"""Which detection is which object, against planted permutations."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from compass_ros.tracking.association import Detection, assign
from compass_ros.tracking.config import ObjectConfig, TrackerConfig
from compass_ros.tracking.motion import Motion, first_motion
from compass_ros.types import Floats

RED, BLUE = ObjectConfig(hue_deg=0), ObjectConfig(hue_deg=220)
ALIKE = TrackerConfig(objects={"a": RED, "b": RED, "c": RED})
DISTINCT = TrackerConfig(objects={"a": RED, "b": BLUE})
PLACES = np.array([[0.0, 0.0], [0.06, 0.0], [0.0, 0.07]])


def at(xy: Floats | list[float], look: ObjectConfig = RED) -> Detection:
    return Detection(look, np.asarray(xy, dtype=float), np.eye(2) * 1e-8, 1.0)


def motions(config: TrackerConfig, places: Floats) -> dict[str, Motion]:
    return {name: first_motion(0, xy, np.eye(2) * 1e-8) for name, xy in zip(config.objects, places, strict=True)}


@pytest.mark.parametrize("order", list(itertools.permutations(range(3))))
def test_objects_alike_keep_their_names_in_any_order_of_detections(order: tuple[int, ...]) -> None:
    moved = PLACES + np.array([[0.012, 0.0], [-0.012, 0.003], [0.0, -0.01]])
    found = assign([at(moved[i]) for i in order], motions(ALIKE, PLACES), ALIKE)
    for name, xy in zip(ALIKE.objects, moved, strict=True):
        np.testing.assert_array_equal(found[name].xy, xy)


def test_the_sum_is_least_not_each_distance() -> None:
    # greedy would give `a` the detection nearest to it and leave `b` a far one
    found = assign([at([0.03, 0]), at([0.09, 0]), at([0, 0.07])], motions(ALIKE, PLACES), ALIKE)
    assert found["a"].xy[0] == 0.03
    assert found["b"].xy[0] == 0.09


def test_colour_decides_however_far_apart() -> None:
    swapped = [at([0.06, 0.0], RED), at([0.0, 0.0], BLUE)]
    found = assign(swapped, motions(DISTINCT, PLACES[:2]), DISTINCT)
    assert found["a"].look == RED
    assert found["b"].look == BLUE


def test_gate_holds_for_objects_alike_only() -> None:
    far = np.array([0.4, 0.2])
    assert assign([at(far)], motions(ALIKE, PLACES), ALIKE) == {}
    assert set(assign([at(far)], motions(DISTINCT, PLACES[:2]), DISTINCT)) == {"a"}


def test_a_missing_object_leaves_its_name_unused() -> None:
    found = assign([at(PLACES[0]), at(PLACES[2])], motions(ALIKE, PLACES), ALIKE)
    assert set(found) == {"a", "c"}


def test_first_sight_of_objects_alike_is_named_by_x() -> None:
    found = assign([at([0.3, 0]), at([-0.2, 0]), at([0.1, 0])], {}, ALIKE)
    assert [found[name].xy[0] for name in "abc"] == [-0.2, 0.1, 0.3]


def test_nothing_detected() -> None:
    assert assign([], motions(ALIKE, PLACES), ALIKE) == {}
