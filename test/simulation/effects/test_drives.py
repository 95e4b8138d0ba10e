"""Laws of single drives: what they make of a command, and of what MuJoCo lets them exert."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from compass_ros.errors import ConfigError
from compass_ros.simulation.effects import Attached, Exported, FittedEffect, effect
from compass_ros.simulation.effects.effect import Context
from compass_ros.simulation.sizes import DriveSize
from compass_ros.types import Floats
from test.simulation.effects.scenes import INERTIA, axis, flown, laws, swung


@pytest.mark.parametrize(
    ("actuator", "told"),
    [
        ('<motor name="a" joint="axis" gear="1"/>', 2.0),
        ('<motor name="a" joint="axis" gear="1"/>', -2.0),
        ('<motor name="a" joint="axis" gear="1" forcerange="-.2 .3"/>', 2.0),
        ('<position name="a" joint="axis" kp="50"/>', 1.0),
        ('<velocity name="a" joint="axis" kv="9"/>', 9.0),
    ],
)
def test_a_drive_pushes_no_harder_than_its_limit(actuator: str, told: float) -> None:
    """The tighter of the law's and of the scene's own."""
    limit = 0.3 if "forcerange" in actuator else 0.4
    rate = swung(axis(actuator), laws(("torque_saturation", (1 / 0.4, 0.0), "a")), (0.0, 0.0), 0.1, told)[1]
    assert rate == pytest.approx(np.sign(told) * 0.1 * limit / INERTIA, rel=1e-3)


@pytest.mark.parametrize("actuator", ['<motor name="a" joint="axis"/>', '<velocity name="a" joint="axis" kv="9"/>'])
@pytest.mark.parametrize("told", [9.0, -9.0])
def test_a_motor_nears_its_speed_without_a_load_as_an_exponential(actuator: str, told: float) -> None:
    """inertia v' = limit (1 - v / most); against its motion it pushes as hard as it can."""
    limit, most, seconds = 0.4, 2.0, 0.3
    law = laws(("torque_saturation", (1 / limit, 1 / most), "a"))
    rate = swung(axis(actuator), law, (0.0, 0.0), seconds, told)[1]
    expected = most * -np.expm1(-limit * seconds / (INERTIA * most))
    assert rate == pytest.approx(np.sign(told) * expected, rel=5e-3)
    braked = swung(axis(actuator), law, (0.0, -1.5 * np.sign(told)), 0.01, told)[1]
    assert braked == pytest.approx(np.sign(told) * (0.01 * limit / INERTIA - 1.5), rel=1e-3)


def servo(*numbers: float) -> Exported:
    """A dead band of a position servo."""
    law = effect("dead_band").at(DriveSize("position_drive", 1.0, "rad"))
    return Exported((FittedEffect(Attached(law, ("a",)), numbers, ()),), {})


@pytest.mark.parametrize("punch", [0.0, 0.6])
@pytest.mark.parametrize("extra", ["", 'ctrlrange="-.5 .5"', 'forcerange="-.3 .3"', 'timeconst=".02"', 'gear="2"'])
def test_a_servo_with_a_dead_band_is_what_its_formula_says(extra: str, punch: float) -> None:
    """Against the formula integrated, with every option that a servo has in MuJoCo."""
    told, band = 0.8, 0.15
    gear, told_most, limit = (
        2.0 if "gear" in extra else 1.0,
        0.5 if "ctrl" in extra else 9.0,
        0.3 if "force" in extra else 99.0,
    )

    def formula(t: float, q: Floats, v: Floats) -> Floats:
        command = told * (1 - np.exp(-t / 0.02)) if "time" in extra else min(told, told_most)
        error = command - gear * q
        kept = 1 - punch if abs(error) > band else 1
        force = 4 * (error - kept * np.clip(error, -band, band)) - 0.3 * gear * v
        return np.asarray(gear * np.clip(force, -limit, limit) / INERTIA)

    model = axis(f'<position name="a" joint="axis" kp="4" kv=".3" {extra}/>')
    found = swung(model, servo(band, punch), (0.1, 0.0), 0.4, told)
    np.testing.assert_allclose(found, flown(formula, np.array([0.1]), np.zeros(1), 0.4, 600), rtol=3e-3, atol=1e-3)


def test_within_its_dead_band_a_servo_does_nothing() -> None:
    model = axis('<position name="a" joint="axis" kp="4"/>')
    for punch in (0.0, 1.0):
        assert swung(model, servo(0.2, punch), (0.1, 0.0), 0.5, 0.25)[1] == pytest.approx(0, abs=1e-12)
    assert abs(swung(model, servo(0.2, 0.0), (0.1, 0.0), 0.5, 0.35)[1]) > 0.1


def test_a_dead_band_of_what_is_told_a_force_is_outside_of_the_model() -> None:
    model = axis('<motor name="a" joint="axis"/>')
    with pytest.raises(ConfigError, match="'dead_band' belongs to the actuation, outside"):
        swung(model, laws(("dead_band", (0.1,), "a")), (0.0, 0.0), 0.1, 0.5)


Shape = Callable[[Floats], Floats]
STEP = 1e-3
"""Of made commands [s]."""


@pytest.mark.parametrize("rate", [0.5, 2.0, 50.0])
@pytest.mark.parametrize("shape", [np.sin, np.sign, lambda x: x, lambda x: np.abs(np.sin(3 * x)), lambda x: 0 * x + 1])
def test_a_limited_command_is_nearest_to_what_was_told_at_its_rate(rate: float, shape: Shape) -> None:
    told = shape(np.linspace(0.1, 6.0, 3000))
    found = followed("rate_limit", told, 1 / rate)
    steps = np.diff(np.append(0.0, found))
    assert np.abs(steps).max() <= rate * STEP * (1 + 1e-9)
    behind = found != told
    assert (np.abs(steps[behind]) >= rate * STEP * (1 - 1e-9)).all()  # as fast as it may wherever it lags
    np.testing.assert_array_equal(followed("rate_limit", told, 0.0), told)


@pytest.mark.parametrize("fastest", [0.0, 3.0, 0.5])
@pytest.mark.parametrize("acceleration", [5.0, 39.0])
@pytest.mark.parametrize("far", [0.2, -1.0])
def test_a_profile_stands_at_its_command_as_soon_as_it_can(fastest: float, acceleration: float, far: float) -> None:
    """From rest to rest: a triangle of speed, or a trapezoid where it would be faster than it may (Siciliano 2009)."""
    found = profiled(np.full(6000, far), 1 / fastest if fastest else 0.0, 1 / acceleration)
    speed = np.diff(np.append(0.0, found)) / STEP
    assert np.abs(speed).max() <= (fastest or np.inf) * (1 + 1e-9)
    assert np.abs(np.diff(np.append(0.0, speed))).max() <= acceleration * STEP * (1 + 1e-9)
    most = fastest if fastest and fastest**2 < acceleration * abs(far) else np.sqrt(acceleration * abs(far))
    takes = abs(far) / most + most / acceleration
    assert np.flatnonzero(found != far)[-1] * STEP == pytest.approx(takes, abs=3 * STEP)
    assert np.abs(found).max() <= abs(far) + acceleration * STEP**2


def test_a_profile_cannot_follow_what_turns_faster_than_it() -> None:
    """A sine that asks for less acceleration is followed; of one that asks for four times as much, a parabola each way
    is left at most: a / (32 f^2) high."""
    time, most = STEP * np.arange(20000), 20.0
    for share, frequency in ((0.9, 1.0), (4.0, 3.0)):
        height = share * most / (2 * np.pi * frequency) ** 2
        found = profiled(height * np.sin(2 * np.pi * frequency * time), 0.0, 1 / most)[10000:]
        expected = height if share < 1 else most / (32 * frequency**2)
        assert found.max() == pytest.approx(expected, rel=0.02 if share < 1 else 0.15)


@pytest.mark.parametrize("width", [0.05, 0.3, 1.0])
@pytest.mark.parametrize("shape", [np.sin, np.sign, lambda x: x, lambda x: np.abs(np.sin(3 * x)), lambda x: 0 * x + 1])
def test_a_command_with_play_stays_within_it_and_moves_only_at_its_ends(width: float, shape: Shape) -> None:
    told = shape(np.linspace(0.1, 6.0, 3000))
    found = followed("hysteresis", told, width)
    off = told - found
    assert np.abs(off).max() <= width / 2 * (1 + 1e-9)
    moves = np.diff(np.append(0.0, found))
    at_end = np.isclose(np.abs(off), width / 2)
    assert (at_end | (moves == 0)).all()
    assert (moves * np.where(at_end, np.sign(off), 0) >= 0).all()
    np.testing.assert_array_equal(followed("hysteresis", told, 0.0), told)


def test_a_gain_error_scales_the_command() -> None:
    np.testing.assert_allclose(followed("gain_error", np.arange(5.0), 0.1), 1.1 * np.arange(5.0))


def followed(name: str, told: Floats, *numbers: float) -> Floats:
    """(T,) what a drive makes of (T,) commands, the rest of its numbers 0."""
    hook, left = effect(name).controls, len(effect(name).quantities) - len(numbers)
    assert hook is not None
    row = np.array([[*numbers, *left * [0.0]]])
    return np.asarray(hook(told[None, :, None], row, Context((), {}, (), (), STEP))[0, :, 0])


def profiled(told: Floats, inverse_rate: float, inverse_acceleration: float) -> Floats:
    """(T,) what a drive with a profile makes of (T,) commands."""
    return followed("rate_limit", told, inverse_rate, inverse_acceleration)
