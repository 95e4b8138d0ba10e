"""Encoders that count: their step is found from what they say, and what they say again is worth nothing more."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from compass_ros.calibration.encoder import ROOT_12, encoder_step, repeats
from compass_ros.calibration.noise import Noise, measure_noise
from compass_ros.types import Floats
from test.real.conftest import REAL, needs_real

TIME = np.arange(0, 3.2, 1 / 60)
FINEST = 1e-5 * ROOT_12


def pendulum(rng: np.random.Generator) -> Floats:
    return np.asarray(rng.uniform(0.4, 1.2) * np.exp(-0.3 * TIME) * np.cos(5 * TIME + rng.uniform(0, 6)))


def sticking(rng: np.random.Generator) -> Floats:
    """Dry friction: it swings a few times and then stands still, somewhere."""
    turns = np.arange(12)[:, None]
    size = np.maximum(rng.uniform(0.6, 1.4) - 0.2 * turns, 0.0)
    swing = np.where((0.25 * turns <= TIME) & (0.25 * (turns + 1) > TIME), size * np.cos(np.pi * TIME / 0.25), 0.0)
    swing = swing.sum(axis=0)
    return np.asarray(np.where(TIME < 1.5, swing, swing[np.searchsorted(TIME, 1.5)]))


def servo(rng: np.random.Generator) -> Floats:
    start, goal = rng.uniform(-1.2, 1.2, 2)
    return np.asarray(goal + (start - goal) * np.exp(-6 * TIME) * (1 + 6 * TIME))


def slide(rng: np.random.Generator) -> Floats:
    """Metres: pushed along a rail, it comes to rest."""
    speed, slowing = rng.uniform(0.2, 0.6), rng.uniform(0.1, 0.3)
    until = np.minimum(TIME, speed / slowing)
    return np.asarray(rng.uniform(-0.3, 0.3) + speed * until - slowing * until**2 / 2)


def spinning(rng: np.random.Generator) -> Floats:
    return np.asarray(rng.uniform(-3, 3) + rng.uniform(3, 9) / 0.6 * (1 - np.exp(-0.6 * TIME)))


MOTIONS = {one.__name__: one for one in (pendulum, sticking, servo, slide, spinning)}


def recorded(motion: str, step: float, noise: float = 0.0, episodes: int = 10, seed: int = 0) -> list[Floats]:
    """What an encoder of this step says; `noise` in steps, before it counts."""
    rng = np.random.default_rng(seed)
    true = [MOTIONS[motion](rng) for _ in range(episodes)]
    return [step * np.round(x / step + noise * rng.normal(size=len(x))) if step else x for x in true]


@pytest.mark.parametrize("motion", MOTIONS)
@pytest.mark.parametrize("step", [2 * np.pi / 4096, 2 * np.pi / 1000, 0.01])
@pytest.mark.parametrize("noise", [0.0, 0.5, 2.0])
def test_the_step_is_found(motion: str, step: float, noise: float) -> None:
    assert encoder_step(recorded(motion, step, noise), FINEST) == pytest.approx(step, rel=1e-3)


@pytest.mark.parametrize("motion", MOTIONS)
@pytest.mark.parametrize("turns", [0, 10])
def test_a_step_in_single_precision_is_found(motion: str, turns: int) -> None:
    """Degrees, computed from radians of 24 bits: their rounding is far coarser than the finest step that is asked."""
    said = [np.degrees(np.float32(x + 2 * np.pi * turns).astype(float)) for x in recorded(motion, 2 * np.pi / 4096)]
    assert encoder_step(said, 1e-6) == pytest.approx(360 / 4096, rel=1e-3)


@pytest.mark.parametrize("motion", MOTIONS)
@pytest.mark.parametrize("noise", [0.0, 1e-5, 1e-3])
def test_there_is_none_where_nothing_counts(motion: str, noise: float) -> None:
    rng = np.random.default_rng(1)
    said = [x + noise * rng.normal(size=len(x)) for x in recorded(motion, 0.0)]
    assert encoder_step(said, FINEST) == 0.0


@pytest.mark.parametrize("fall", [0.5, 1.0])
def test_a_fall_that_was_computed_is_on_a_lattice_and_is_no_encoder(fall: float) -> None:
    frames = np.arange(100)
    assert encoder_step([1.36e-3 * fall * frames * (frames + 1)] * 3, FINEST) == 0.0


def test_a_table_with_few_digits_does_not_conceal_the_step() -> None:
    degrees = [np.round(np.round(np.degrees(x) / 0.087890625) * 0.087890625, 4) for x in recorded("servo", 0.0)]
    assert encoder_step([np.radians(x) for x in degrees], FINEST) == pytest.approx(2 * np.pi / 4096, rel=1e-3)


@pytest.mark.parametrize("decimals", [2, 3, 4, 6])
@pytest.mark.parametrize("motion", MOTIONS)
def test_a_slow_motion_in_a_table_with_few_digits_does_not_either(motion: str, decimals: int) -> None:
    """Of a joint that moves by less than a step a frame most second differences are the table's rounding alone."""
    rng = np.random.default_rng(3)
    slow = [np.interp(np.linspace(0, TIME[-1], 1500), TIME, MOTIONS[motion](rng)) for _ in range(4)]
    step = 360 / 4096
    said = [np.radians(np.round(np.round(np.degrees(x) / step) * step, decimals)) for x in slow]
    assert encoder_step(said, FINEST) == pytest.approx(np.radians(step), rel=2e-3)


@needs_real
@pytest.mark.parametrize("decimals", [3, 4])
def test_a_table_in_degrees_of_a_real_arm(decimals: int) -> None:
    with np.load(REAL / "so101" / "motions.npz") as file:
        said = [np.degrees(file[f"{name}.position"]) for name in ("chirp_sweep", "reaching_points", "static_holding")]
    for joint in range(4):
        printed = [np.radians(np.round(one[:, joint], decimals)) for one in said]
        assert encoder_step(printed, FINEST) == pytest.approx(2 * np.pi / 4096, rel=1e-3)


def test_gaps_and_a_glitch_do_not_matter() -> None:
    said = recorded("sticking", 0.001)
    said[0][50], said[1][::3] = 0.12345, np.nan
    assert encoder_step(said, FINEST) == pytest.approx(0.001, rel=1e-3)


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 10**6), st.floats(1e-4, 0.02))
def test_noise_alone_is_never_a_step(seed: int, sigma: float) -> None:
    rng = np.random.default_rng(seed)
    assert encoder_step([sigma * rng.normal(size=190) for _ in range(6)], FINEST) == 0.0


def test_how_often_a_value_is_said() -> None:
    said = np.array([0.0, 0.0, 0.1, np.nan, 0.1, 0.1, 0.3, 0.3, 0.1])[None, :, None]
    np.testing.assert_array_equal(repeats(said, np.array([0.1]))[0, :, 0], [2, 2, 3, 1, 3, 3, 2, 2, 1])
    np.testing.assert_array_equal(repeats(said, np.array([0.0])), 1.0)


def measured(motion: str, step: float, noise: float = 0.0, seed: int = 0) -> tuple[Noise, Floats, Floats]:
    """Noise, (E, F, 1) what was said, (E, F, 1) what was true."""
    said = np.stack(recorded(motion, step, noise, seed=seed))[:, :, None]
    true = np.stack(recorded(motion, 0.0, seed=seed))[:, :, None]
    return measure_noise(np.tile(TIME, (len(said), 1)), said, 0.001), said, true


@pytest.mark.parametrize("motion", MOTIONS)
@pytest.mark.parametrize("step", [2 * np.pi / 4096, 0.01])
def test_the_noise_has_a_floor_that_the_errors_have(motion: str, step: float) -> None:
    noise, said, true = measured(motion, step)
    assert noise.rms[0] == pytest.approx(step / ROOT_12, rel=0.15)
    assert np.sqrt(np.mean((said - true) ** 2)) < 1.3 * noise.rms[0]


@pytest.mark.parametrize("motion", MOTIONS)
def test_a_mean_is_as_uncertain_as_its_weights_say(motion: str) -> None:
    """The error of a weighted mean of all frames of an episode, in what independent errors of this size leave.

    Counted frame by frame, that of `sticking` is five times what it should be: half of it is one value.
    """
    noise, said, true = measured(motion, 0.02, seed=5)
    weight = 1 / noise.of(said) ** 2
    error = np.sum(weight * (said - true), axis=1) / np.sqrt(np.sum(weight, axis=1))
    assert np.sqrt(np.mean(error**2)) < 1.6


@pytest.mark.parametrize("motion", MOTIONS)
def test_without_an_encoder_nothing_changes(motion: str) -> None:
    rng = np.random.default_rng(2)
    said = np.stack([x + 1e-3 * rng.normal(size=len(x)) for x in recorded(motion, 0.0)])[:, :, None]
    noise = measure_noise(np.tile(TIME, (len(said), 1)), said, 0.001)
    np.testing.assert_array_equal(noise.of(said), noise.sigma[0])
    assert noise.sigma[0] == pytest.approx(1e-3, rel=0.1)


def test_outliers_count_in_what_is_stated_and_not_in_the_weights() -> None:
    rng = np.random.default_rng(2)
    said = np.stack([x + 1e-3 * rng.normal(size=len(x)) for x in recorded("pendulum", 0.0)])[:, :, None]
    far = rng.random(said.shape) < 0.01
    noise = measure_noise(np.tile(TIME, (len(said), 1)), said + 0.03 * far, 0.001)
    assert noise.sigma[0] == pytest.approx(1e-3, rel=0.1)
    assert noise.rms[0] == pytest.approx(np.sqrt(1 + 900 * np.mean(far)) * 1e-3, rel=0.25)


@needs_real
@pytest.mark.parametrize(("joint", "step"), [(0, 2 * np.pi / 4096), (2, 2 * np.pi / 4096), (4, 2 * np.pi / 4096)])
def test_a_real_servo_counts_4096_a_turn(joint: int, step: float) -> None:
    motions = np.load(REAL / "so101" / "motions.npz")
    said = [motions[name][:, joint] for name in sorted(motions.files) if name.endswith(".position")]
    assert encoder_step(said[:6], FINEST) == pytest.approx(step, rel=1e-4)


@needs_real
@pytest.mark.parametrize("run", ["ilqr", "sac", "ddp", "pd_identification", "energy_shaping"])
def test_a_real_motor_says_its_angle_in_16_bits(run: str) -> None:
    """Not the 12 bits of its encoder: its messages hold -95.5 to 95.5 rad."""
    said = np.load(REAL / "torque_pendulum" / "runs.npz")[f"{run}.measured.position"]
    assert encoder_step([said], FINEST) == pytest.approx(2 * 95.5 / 65535, rel=1e-3)
