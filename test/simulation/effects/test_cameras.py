"""Laws of cameras in any position, against OpenCV's model of a camera, and against geometry."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
import yaml
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from compass_ros.simulation import Simulator
from compass_ros.simulation.effects import EFFECTS, Attached, read_effects
from compass_ros.simulation.effects.effect import Context, Sample
from compass_ros.types import Floats
from test.discovery.asked import balls, passing

FOCUS = np.array([[800.0, 0.0, 320.0], [0.0, 800.0, 240.0], [0.0, 0.0, 1.0]])
"""[pixels]"""
AHEAD = [(0.0, 0.0), (np.pi / 2, 0.0), (0.0, np.pi / 2), (0.4, -0.9), (-1.2, 0.5), (-0.3, 1.4)]
"""Axes along z, y and x of the scene, and askew: tilts about x and y [rad]."""


class Camera:
    """A pinhole whose axis is z turned by tilts, at a distance from the point of the axis that it looks at."""

    def __init__(self, tilts: tuple[float, float], middle: Floats, distance: float) -> None:
        self.axis = Rotation.from_rotvec([*tilts, 0.0]).apply([0.0, 0.0, 1.0])
        roll = Rotation.from_rotvec(0.7 * np.array([0.0, 0.0, 1.0]))
        self.turn = (Rotation.from_rotvec([*tilts, 0.0]) * roll).inv()  # from the scene into the camera's frame
        self.place, self.distance = middle - distance * self.axis, distance

    def seen(self, points: Floats, k1: float = 0.0, focus: Floats = FOCUS, roll: float = 0.0) -> Floats:
        """(N, 3) where a tracker puts (N, 3) points that knows their depth, and takes the lens for a pinhole."""
        turn = Rotation.from_rotvec([0.0, 0.0, roll]) * self.turn
        shift = -turn.apply(self.place)
        pixels = cv2.projectPoints(points, turn.as_rotvec(), shift, focus, np.array([k1, 0.0, 0.0, 0.0]))[0][:, 0]
        depth = self.turn.apply(points - self.place)[:, 2:]
        rays = np.hstack([(pixels - FOCUS[:2, 2]) / FOCUS[0, 0], np.ones((len(points), 1))])
        return np.asarray(self.turn.inv().apply(depth * rays) + self.place)


def law(name: str, numbers: tuple[float, ...], sample: Sample, time: Floats, columns: int = 3) -> Floats:
    """(F, C) what a law makes of one body."""
    hook = EFFECTS[name].sensing
    assert hook is not None
    places, turns = (tuple(range(min(columns, 3))),), (tuple(range(3, columns)),)
    return np.asarray(hook(sample, np.array([numbers]), Context((), {}, places, turns, 0.001))(time[None])[0])


def still(name: str, numbers: tuple[float, ...], points: Floats) -> Floats:
    return law(name, numbers, lambda _: points[None], np.zeros(len(points)), points.shape[1])


def around(middle: Floats, camera: Camera, deep: float, seed: int) -> Floats:
    """(40, 3) points within 0.6 m of the axis, in a plane across it or with some depth."""
    points = np.random.default_rng(seed).uniform(-0.6, 0.6, (40, 3))
    along = points @ camera.axis
    return np.asarray(middle + points - (1 - deep) * along[:, None] * camera.axis)


@pytest.mark.parametrize("k1", [-0.2, 0.15])
@pytest.mark.parametrize("deep", [0.0, 0.2])
@pytest.mark.parametrize("tilts", AHEAD)
def test_a_lens_bends_as_opencv_has_it(tilts: tuple[float, float], deep: float, k1: float) -> None:
    """In a plane across the axis to rounding; in space but for the part by which the distance differs."""
    middle, distance = np.array([0.3, -0.2, 0.5]), 3.0
    camera = Camera(tilts, middle, distance)
    points = around(middle, camera, deep, seed=1)
    moved = camera.seen(points, k1) - points
    found = still("lens_distortion", (k1 / distance**2, *middle, *tilts), points) - points
    allowed = 1e-12 if not deep else 2.5 * 0.6 * deep / distance * np.linalg.norm(moved, axis=1).max()
    assert np.abs(found - moved).max() < allowed
    assert np.linalg.norm(moved, axis=1).max() > 2e-3


@pytest.mark.parametrize("along", [-0.7, 0.0, 1.3])
def test_where_on_its_axis_a_lens_is_said_to_be_means_nothing(along: float) -> None:
    tilts = (0.4, -0.9)
    camera = Camera(tilts, np.zeros(3), 2.0)
    points = around(np.zeros(3), camera, 1.0, seed=2)
    moved = still("lens_distortion", (0.05, *(along * camera.axis), *tilts), points)
    np.testing.assert_allclose(moved, still("lens_distortion", (0.05, 0.0, 0.0, 0.0, *tilts), points), atol=1e-14)


@pytest.mark.parametrize("angle", [-0.1, -0.02, 0.004, 0.03, 0.1])
def test_a_turned_camera_turns_places_and_orientations(angle: float) -> None:
    """A camera that looks along z at a bar on a table: places as OpenCV has them, orientations so that any point of the
    bar is where the camera sees it."""
    middle, rng = np.array([0.1, -0.05, 0.0]), np.random.default_rng(3)
    camera = Camera((0.0, 0.0), middle, 1.5)
    where = np.hstack([middle[:2] + rng.uniform(-0.3, 0.3, (20, 2)), np.zeros((20, 1))])
    how = Rotation.from_rotvec(np.outer(rng.uniform(-3, 3, 20), [0.0, 0.0, 1.0]))
    poses = np.hstack([where, np.roll(how.as_quat(), 1, axis=1)])
    found = still("camera_rotation", (angle, *middle[:2]), poses)
    np.testing.assert_allclose(found[:, :3], camera.seen(where, roll=angle), atol=1e-12)
    corner = np.array([0.04, 0.2, 0.0])
    seen = found[:, :3] + Rotation.from_quat(np.roll(found[:, 3:], -1, axis=1)).apply(corner)
    np.testing.assert_allclose(seen, camera.seen(where + how.apply(corner), roll=angle), atol=1e-12)


@pytest.mark.parametrize("tilts", AHEAD)
def test_a_wrong_focal_length_scales_what_is_across_the_axis(tilts: tuple[float, float]) -> None:
    middle = np.array([0.3, -0.2, 0.5])
    camera = Camera(tilts, middle, 3.0)
    points = around(middle, camera, 0.0, seed=4)
    longer = FOCUS * np.array([[1.03, 1, 1], [1, 1.03, 1], [1, 1, 1]])
    np.testing.assert_allclose(still("camera_scale", (0.03, *middle), points), camera.seen(points, focus=longer))


@pytest.mark.parametrize("seed", range(6))
def test_a_rolling_shutter_reads_each_row_when_its_turn_comes(seed: int) -> None:
    """A body that flies; the moment of its row solved for, to the order of its speed over that of the read-out."""
    rng = np.random.default_rng(seed)
    start, speed, fall = rng.uniform(-1, 1, 3), rng.uniform(-2, 2, 3), np.array([0.0, 0.0, -4.9])
    per_metre, row_zero = rng.uniform(-0.01, 0.01, 3), rng.uniform(-0.5, 0.5, 3)
    time = np.linspace(0.2, 0.8, 25)

    def at(t: Floats) -> Floats:
        return np.asarray(start + speed * t[..., None] + fall * t[..., None] ** 2)

    def late(t: float) -> float:
        return float(brentq(lambda d: per_metre @ (at(np.array(t + d)) - row_zero) - d, -0.1, 0.1))

    numbers = (per_metre[0], per_metre[1], row_zero[0], row_zero[1], per_metre[2], row_zero[2])
    found = law("rolling_shutter", numbers, at, time)
    exact = at(time + np.array([late(t) for t in time]))
    moved = np.abs(exact - at(time)).max()
    assert moved > 5e-3
    assert np.abs(found - exact).max() < 0.12 * moved  # (10 m/s) (0.01 s/m)


@pytest.mark.parametrize(
    ("name", "numbers"),
    [
        ("lens_distortion", (0.03, 1.0, -0.4, 0.2, 1.57, 0.0)),
        ("lens_distortion", (-0.04, 0.0, 0.9, 0.2, 0.3, -0.8)),
        ("camera_rotation", (0.1, 1.0, -1.0)),
        ("camera_scale", (-0.08, 1.0, 2.0, -1.0)),
        ("rotation", (0.1, 0.05, -0.1)),
    ],
)
def test_what_begins_where_a_camera_saw_it_begins_where_it_is(
    tmp_path: Path, name: str, numbers: tuple[float, ...]
) -> None:
    """A first place that was read from the track is read through the same lens: the first frame is as it was read."""
    cell, told, time = balls(tmp_path), passing(5), np.tile(np.linspace(0, 0.4, 6), (5, 1))
    objects = ("red", "blue") if EFFECTS[name].by_name else ()
    simulator = Simulator(cell, [Attached(EFFECTS[name], objects)], threads=1)
    values = np.tile(np.array(numbers), (5, 1))
    first = simulator.observe(values, told, time)[:, 0]
    read = told[:, [0, 1, 2, 6, 7, 8]]
    begins = simulator.physics.truly(values, told)[:, [0, 1, 2, 6, 7, 8]]
    assert np.abs(begins - read).max() > 0.02
    assert np.abs(first - read).max() < 0.1 * np.abs(begins - read).max()
    assert (simulator.physics.truly(0.0 * values, told) == told).all()


@pytest.mark.parametrize(
    ("name", "old", "now"),
    [
        ("lens_distortion", {"k1": (0.03, "1/m^2")}, (0.03, 0, 0, 0, 0, 0)),
        ("camera_rotation", {"angle": (0.02, "rad")}, (0.02, 0, 0)),
        ("camera_scale", {"scale": (0.01, "1")}, (0.01, 0, 0, 0)),
        ("rolling_shutter", {"time": (0.009, "s")}, (0, 0.04, 0, 0, 0, 0)),
        ("rolling_shutter", {"time": (-0.0225, "s")}, (0, -0.1, 0, 0, 0, 0)),
    ],
)
def test_files_from_before_cameras_had_places_read_as_they_were_meant(
    tmp_path: Path, name: str, old: dict[str, tuple[float, str]], now: tuple[float, ...]
) -> None:
    values = {key: {"value": value, "unit": unit, "std": 0.1 * abs(value)} for key, (value, unit) in old.items()}
    path = tmp_path / "effects.yaml"
    path.write_text(yaml.safe_dump({"effects": [{"name": name, "objects": [], "values": values}], "sliding": {}}))
    (read,) = read_effects(path).effects
    np.testing.assert_allclose(read.values, now)
    assert np.nanmax(read.std) == pytest.approx(0.1 * max(map(abs, now)))
