"""The filter: what a Kalman filter with constant velocity must do."""

from __future__ import annotations

import numpy as np

from compass_ros.tracking.motion import Motion, correct, first_motion, predict
from compass_ros.types import Floats

NOISE = np.eye(2) * 0.0003**2
FRAME_NS = 16_666_667


def follow(path: Floats, seed: int = 0) -> list[Motion]:
    rng = np.random.default_rng(seed)
    measured = path + rng.normal(0, 0.0003, path.shape)
    motions = [first_motion(0, measured[0], NOISE)]
    for i, xy in enumerate(measured[1:], 1):
        motions.append(correct(predict(motions[-1], i * FRAME_NS, 4.0), xy, NOISE))
    return motions


def line(velocity: tuple[float, float], images: int = 40) -> Floats:
    return np.asarray(np.arange(images)[:, None] * FRAME_NS * 1e-9 * np.array(velocity))


def test_velocity_of_a_straight_path_is_found() -> None:
    last = follow(line((0.8, -0.3)))[-1]
    np.testing.assert_allclose(last.mean[2:], [0.8, -0.3], atol=0.05)
    assert np.sqrt(last.covariance[2, 2]) < 0.06


def test_covariance_stays_symmetric_and_positive_and_grows_without_measurements() -> None:
    motion = follow(line((0.5, 0.5)))[-1]
    spread = [motion.covariance[0, 0]]
    for i in range(1, 30):
        later = predict(motion, motion.stamp_ns + i * FRAME_NS, 4.0)
        np.testing.assert_allclose(later.covariance, later.covariance.T)
        assert np.linalg.eigvalsh(later.covariance)[0] > 0
        assert later.seen_ns == motion.stamp_ns
        spread.append(later.covariance[0, 0])
    assert np.all(np.diff(spread) > 0)


def test_prediction_goes_straight_on() -> None:
    motion = Motion(0, 0, np.array([0.1, 0.2, 1.0, -2.0]), np.eye(4) * 1e-6)
    np.testing.assert_allclose(predict(motion, 100_000_000, 4.0).mean, [0.2, 0.0, 1.0, -2.0])


def test_a_bounce_is_learnt_within_three_images() -> None:
    there = line((1.0, 0.0), 20)
    back = there[-1] - line((0.9, 0.0), 20)[1:]
    motions = follow(np.vstack([there, back]))
    before, after = motions[19].mean[2], motions[22].mean[2]
    assert before > 0.95
    assert abs(after + 0.9) < 0.1


def test_normalised_innovations_are_of_unit_size_on_a_path_that_fits_the_model() -> None:
    rng = np.random.default_rng(3)
    dt = FRAME_NS * 1e-9
    xy, velocity = np.zeros(2), np.array([0.4, 0.1])
    motion, squares = first_motion(0, xy, NOISE), []
    for i in range(1, 400):
        push = rng.normal(0, 4.0, 2)
        xy, velocity = xy + velocity * dt + push * dt**2 / 2, velocity + push * dt
        measured = xy + rng.normal(0, 0.0003, 2)
        predicted = predict(motion, i * FRAME_NS, 4.0)
        innovation = measured - predicted.mean[:2]
        squares.append(innovation @ np.linalg.solve(predicted.covariance[:2, :2] + NOISE, innovation))
        motion = correct(predicted, measured, NOISE)
    assert 1.6 < np.mean(squares[5:]) < 2.4
