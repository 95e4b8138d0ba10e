"""Balls in flight: known limits of the published curves, and the engine against the suite's at the true parameters."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from compass_ros.types import Floats
from compass_ros.worlds import draw
from compass_ros.worlds.flight import drag, lift, pushes, scene
from compass_ros.worlds.flight.ball import Ball, Throw, fly
from compass_ros.worlds.world import Asked, World
from test.worlds.task import simulated, task_of

TASK = task_of("ball_flight")[1]
BALL = Ball(0.43, 0.11, -9.81, np.zeros(3))


def throw(velocity: tuple[float, ...], spin: tuple[float, ...] = (0.0, 0.0, 0.0)) -> Throw:
    return Throw(np.zeros(3), np.array(velocity), np.array(spin), Rotation.identity())


def first_state(one: Throw, ball: Ball) -> Floats:
    """(16,) the inputs of the cell: place, quaternion, velocity of the tracked centre, rate in the ball's axes."""
    arm = one.orientation.apply(ball.centre_m)
    quaternion = np.roll(one.orientation.as_quat(), 1)
    velocity = one.velocity_ms - np.cross(one.spin_rads, arm)
    spin = one.orientation.inv().apply(one.spin_rads)
    return np.concatenate([one.position_m - arm, quaternion, velocity, spin, np.zeros(3)])


@pytest.mark.parametrize("name", ["ball_flight", "ball_flight_air"])
def test_without_laws_the_flight_is_the_simulators_at_the_true_parameters(name: str) -> None:
    rng, (cell, task) = np.random.default_rng(3), task_of(name)
    values = draw.true_values(task.parameters, rng)
    ball, throws = scene.ball_of(values), [scene.thrown(rng, 20.0) for _ in range(6)]
    time_s = np.tile(np.arange(120) / 120.0, (6, 1))
    seen = simulated(cell, values, np.stack([first_state(one, ball) for one in throws]), time_s)
    made = np.stack([scene.played(ball, one, {}).pose(time_s[0]) for one in throws])
    made[:, :, 3:] *= np.sign(np.sum(made[:, :, 3:] * seen[:, :, 3:], axis=2, keepdims=True))
    assert np.abs(made[:, :, :3] - seen[:, :, :3]).max() < 0.01 * scene.PLACE_M
    assert np.abs(made[:, :, 3:] - seen[:, :, 3:]).max() < 0.02 * scene.ANGLE_RAD


@pytest.mark.parametrize(
    ("curve", "reynolds", "expected", "within"),
    [
        (drag.smooth_sphere, 0.1, 240.0, 0.15),  # Stokes, 24 / Re
        (drag.smooth_sphere, 1e5, 0.47, 0.15),  # Achenbach (1972): 0.5 below the crisis
        (drag.smooth_sphere, 4e5, 0.10, 0.5),  # and 0.07 to 0.1 above it
        (drag.below_crisis, 0.1, 240.0, 0.1),
        (drag.below_crisis, 1e5, 0.45, 0.1),
        (drag.football, 5e4, 0.5, 0.05),
        (drag.football, 4e5, 0.155, 0.02),
        (drag.baseball, 5e4, 0.55, 0.1),
    ],
)
def test_drag_has_its_known_limits(curve: object, reynolds: float, expected: float, within: float) -> None:
    assert callable(curve)
    assert float(curve(np.array(reynolds))) == pytest.approx(expected, rel=within)


def test_terminal_speed_is_where_drag_carries_the_weight() -> None:
    falling = fly(BALL, throw((0.0, 0.0, 0.0)), 40.0, (pushes.drag(BALL, drag.below_crisis),))
    speed = float(-np.diff(falling.centre(np.array([38.0, 39.0]))[2])[0])
    force = 0.5 * drag.DENSITY * BALL.area_m2 * speed**2
    reynolds = np.array(speed * 0.22 / drag.KINEMATIC)
    assert force * float(drag.below_crisis(reynolds)) == pytest.approx(0.43 * 9.81, rel=1e-3)


@pytest.mark.parametrize("name", lift.LIFTS)
def test_lift_rises_with_spin_and_stands_across_velocity_and_spin(name: str) -> None:
    curve = lift.LIFTS[name].coefficient
    spin = np.linspace(0.01, 0.6, 60)
    assert (np.diff(curve(spin)) > 0).all()
    velocity, axis = np.array([20.0, 1.0, 3.0]), np.array([3.0, 30.0, 5.0])
    push = pushes.lift(BALL, curve, axis)(0.0, np.zeros(3), velocity, np.zeros(3))
    assert abs(push @ velocity) < 1e-9
    assert abs(push @ axis) < 1e-9
    assert push @ np.cross(axis, velocity) > 0


def test_lift_does_no_work() -> None:
    spinning = throw((20.0, 0.0, 5.0), (0.0, 40.0, 10.0))
    flight = fly(BALL, spinning, 1.0, (pushes.lift(BALL, lift.saturating, spinning.spin_rads),))
    time_s = np.array([0.0, 1e-4, 0.9, 0.9001])
    place = flight.centre(time_s)
    speeds = np.linalg.norm(np.diff(place)[:, [0, 2]] / 1e-4, axis=0)
    energy = 0.5 * speeds**2 + 9.81 * place[2, [0, 2]]
    assert energy[1] == pytest.approx(energy[0], rel=1e-4)


def test_drag_vanishes_in_air_that_moves_along_and_buoyancy_is_archimedes() -> None:
    velocity = np.array([5.0, -2.0, 1.0])
    carried = pushes.drag(BALL, drag.football, lambda time, place: velocity)
    assert np.abs(carried(0.0, np.zeros(3), velocity, np.zeros(3))).max() < 1e-9
    heavy = Ball(1e4, 0.11, -9.81, np.zeros(3))
    lifted = pushes.buoyancy(heavy)(0.0, np.zeros(3), velocity, np.zeros(3))
    assert lifted[2] == pytest.approx(1.5 * 9.81 * drag.DENSITY * heavy.volume_m3 / 1e4, rel=1e-4)


def test_gusts_have_their_rms() -> None:
    wind = pushes.turbulence(2.0, 5.0, 6.0, np.random.default_rng(0), waves=64)
    blown = np.array([wind(t, np.zeros(3))[0] for t in np.linspace(0, 4000, 4000)])
    assert blown.std() == pytest.approx(2.0, rel=0.1)


@pytest.mark.parametrize("kind", ["none", "one", "two", "outside"])
def test_a_world_is_its_seed_alone(kind: str) -> None:
    asked = Asked(7, kind)  # type: ignore[arg-type]
    one, again, other = (scene.conceal(TASK, a) for a in (asked, asked, Asked(8, asked.kind)))
    assert same(one, again)
    assert not same(one, other)
    strengths = [law["strength"] for law in one.answer["laws"]]  # type: ignore[attr-defined]
    assert all(s > 0 for s in strengths)
    assert (len(strengths) == 0) == (kind == "none")


def same(one: World, other: World) -> bool:
    tracks = [(a.tracks[0], b.tracks[0]) for a, b in zip(one.episodes, other.episodes, strict=True)]
    return one.answer == other.answer and all(
        np.array_equal(a.value, b.value) and np.array_equal(a.stamp_ns, b.stamp_ns) for a, b in tracks
    )
