"""Effects between the command and the motion: on made commands, and in the simulator."""

from __future__ import annotations

import numpy as np
import pytest

from compass_ros.simulation import Simulator
from compass_ros.simulation.effects import Attached, effect
from compass_ros.simulation.effects.effect import Context
from compass_ros.types import Floats
from test.simulation.table import DESCRIBED, cell, simulator, values

STEP = 0.001
TIME = STEP * np.arange(1000)


def followed(name: str, controls: Floats, *numbers: float) -> Floats:
    """(T, 2) what the arm makes of (T, 2) commands."""
    hook = effect(name).controls
    assert hook is not None
    return np.asarray(hook(controls[None], np.array([numbers]), Context((), {}, (), (), STEP))[0])


def ramp() -> Floats:
    return np.stack([TIME, 2 * TIME], axis=1)


@pytest.mark.parametrize("delay", [0.05, 0.0304, 0.0007])
def test_a_delay_shifts_the_command_by_any_time(delay: float) -> None:
    late = followed("actuation_delay", ramp(), delay)
    whole = delay + STEP < TIME
    np.testing.assert_allclose(late[whole], np.stack([TIME - delay, 2 * (TIME - delay)], axis=1)[whole], atol=1e-12)
    assert not late[delay - STEP > TIME].any()


def test_a_lag_answers_a_step_with_an_exponential() -> None:
    answer = followed("first_order_lag", np.ones((1000, 2)), 0.1)
    np.testing.assert_allclose(answer[:, 0], 1 - np.exp(-(TIME + STEP) / 0.1), atol=1e-12)


def test_a_saturation_holds_the_speed_and_keeps_the_direction() -> None:
    limited = followed("velocity_saturation", ramp(), 2.0, 8.0)  # 0.5 m/s
    speed, asked = np.linalg.norm(limited, axis=1), np.linalg.norm(ramp(), axis=1)
    assert speed.max() < 0.5
    assert speed[-1] > 0.499
    np.testing.assert_allclose(speed[asked < 0.2], asked[asked < 0.2], rtol=1e-3)
    assert (speed >= 0.917 * np.minimum(asked, 0.5) - 1e-12).all()
    np.testing.assert_allclose(limited[1:, 1], 2 * limited[1:, 0])
    sharp = np.linalg.norm(followed("velocity_saturation", ramp(), 2.0, 60.0), axis=1)
    np.testing.assert_allclose(sharp, np.minimum(asked, 0.5), rtol=0.012)


def test_a_dead_band_takes_a_fixed_speed() -> None:
    left = followed("dead_band", ramp(), 0.1)
    asked = np.linalg.norm(ramp(), axis=1)
    np.testing.assert_allclose(np.linalg.norm(left, axis=1), np.maximum(asked - 0.1, 0), atol=1e-12)


def test_a_heading_bias_turns_anticlockwise() -> None:
    turned = followed("heading_bias", np.tile([1.0, 0.0], (5, 1)), 0.1)
    np.testing.assert_allclose(turned, np.tile([np.cos(0.1), np.sin(0.1)], (5, 1)))


def test_a_jitter_scales_the_speed() -> None:
    np.testing.assert_array_equal(followed("stroke_jitter", ramp(), -0.25), 0.75 * ramp())


def simulated(name: str, number: float, duration: float = 1.5) -> Floats:
    """(T + 1, 4) what the described shot does with the effect."""
    changed = Simulator(cell(), [Attached(effect(name), ())], threads=1)
    shapes = [q.start for q in effect(name).quantities[1:]]
    motion = changed.motion(np.concatenate([cell().defaults, [number], shapes])[None], DESCRIBED[None], duration)
    return np.asarray(motion.positions[0])


def test_a_delay_shifts_everything_that_follows() -> None:
    plain = simulator().motion(values(), DESCRIBED[None], 1.5).positions[0]
    late = simulated("actuation_delay", 0.2)
    np.testing.assert_allclose(late[200:], plain[:-200], atol=1e-9)
    assert np.ptp(late[:200]) == np.ptp(plain[0])


@pytest.mark.parametrize(
    ("name", "number"),
    [("first_order_lag", 0.05), ("velocity_saturation", 4.0), ("dead_band", 0.05), ("stroke_jitter", -0.1)],
)
def test_a_weaker_push_sends_the_puck_less_far(name: str, number: float) -> None:
    plain = simulator().motion(values(), DESCRIBED[None], 1.0).positions[0]
    first = int(np.argmax(np.abs(plain[:, 2] - plain[0, 2]) > 0.02))  # puck 2 is on its way
    weaker = simulated(name, number, 1.0)
    assert np.abs(weaker[first, 2:] - weaker[0, 2:]).max() < np.abs(plain[first, 2:] - plain[0, 2:]).max()


def test_a_heading_bias_is_a_turned_command() -> None:
    turned = simulated("heading_bias", 0.05)
    command = DESCRIBED + np.array([0, 0, 0.05, 0])
    np.testing.assert_allclose(turned, simulator().motion(values(), command[None], 1.5).positions[0], atol=1e-7)
