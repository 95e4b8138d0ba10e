"""Effects between the motion and the measurement: on made motions, exactly."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from compass_ros.simulation import Simulator
from compass_ros.simulation.effects import EFFECTS, Attached, effect
from compass_ros.simulation.effects.effect import Context, Sample
from compass_ros.simulation.sites import Site
from compass_ros.types import Floats
from test.simulation.table import DESCRIBED, cell, simulator, values

TIME = np.linspace(0.5, 1.0, 30)[None]
VELOCITY = np.array([0.3, -0.2, 0.1, 0.05])
START = np.array([-0.2, 0.1, 0.05, -0.1])


def line(time: Floats) -> Floats:
    """Two pucks that move straight on."""
    return np.asarray(START + VELOCITY * time[:, :, None])


def seen(name: str, numbers: float | tuple[float, ...], sample: Sample = line) -> Floats:
    """(30, 4) what the sensor says at TIME."""
    hook = effect(name).sensing
    assert hook is not None
    context = Context((), {}, ((0, 1), (2, 3)), ((), ()), 0.001)
    return np.asarray(hook(sample, np.atleast_2d(numbers), context)(TIME)[0])


def test_a_latency_shows_the_past() -> None:
    np.testing.assert_allclose(seen("camera_latency", 0.03), line(TIME - 0.03)[0], atol=1e-15)


def test_a_drift_stretches_time() -> None:
    np.testing.assert_allclose(seen("clock_drift", 0.02), line(1.02 * TIME)[0], atol=1e-15)


def test_a_scale_stretches_the_image() -> None:
    np.testing.assert_allclose(seen("camera_scale", 0.02), 1.02 * line(TIME)[0], atol=1e-15)


def test_a_rotation_turns_each_puck_about_the_origin() -> None:
    turn = np.array([[np.cos(0.05), -np.sin(0.05)], [np.sin(0.05), np.cos(0.05)]])
    plain = line(TIME)[0]
    turned = np.hstack([plain[:, :2] @ turn.T, plain[:, 2:] @ turn.T])
    np.testing.assert_allclose(seen("camera_rotation", 0.05), turned, atol=1e-15)


def test_a_lens_moves_points_outwards_by_the_cube_of_their_distance() -> None:
    plain = line(TIME)[0]
    outwards = seen("lens_distortion", 0.3) - plain
    for puck in (slice(0, 2), slice(2, 4)):
        distance = np.linalg.norm(plain[:, puck], axis=1)
        np.testing.assert_allclose(np.linalg.norm(outwards[:, puck], axis=1), 0.3 * distance**3, atol=1e-15)
        assert (np.sum(outwards[:, puck] * plain[:, puck], axis=1) > 0).all()


def test_a_rolling_shutter_shows_each_row_at_its_own_time() -> None:
    """At 0.225 m off row zero later, on its other side earlier; the pucks by themselves."""

    def across(time: Floats) -> Floats:
        moving = 0.4 * time
        return np.stack([moving, 0 * time + 0.225, moving, 0 * time - 0.1125], axis=2)

    shown = seen("rolling_shutter", (0.0, 0.02 / 0.225), across)
    np.testing.assert_allclose(shown[:, 0], 0.4 * (TIME[0] + 0.02), atol=1e-15)
    np.testing.assert_allclose(shown[:, 2], 0.4 * (TIME[0] - 0.01), atol=1e-15)


@pytest.mark.parametrize("spread", [0.25, 0.6, 1.0])
def test_a_lag_puts_a_ramp_behind_by_its_time_constant(spread: float) -> None:
    np.testing.assert_allclose(seen("tracking_lag", (0.04, spread)), line(TIME - 0.04)[0], atol=1e-15)


@pytest.mark.parametrize("poles", [1, 2, 3, 16])
def test_a_lag_is_so_many_filters_in_a_row(poles: int) -> None:
    """Against the filters' answer to a parabola and to a sine, both in closed form."""
    spread, each = poles**-0.5, 0.03 / poles
    parabola = seen("tracking_lag", (0.03, spread), lambda t: np.repeat((t**2)[:, :, None], 4, axis=2))
    expected = (TIME[0] - 0.03) ** 2 + 0.03**2 / poles
    np.testing.assert_allclose(parabola[:, 0], expected, atol=1e-14)
    w = 2 * np.pi * 2.0
    sine = seen("tracking_lag", (0.03, spread), lambda t: np.repeat(np.sin(w * t)[:, :, None], 4, axis=2))
    gain, phase = np.hypot(1, each * w) ** -poles, poles * np.arctan(each * w)
    np.testing.assert_allclose(sine[:, 0], gain * np.sin(w * TIME[0] - phase), atol=1e-6)


def test_a_lag_with_the_spread_of_a_moving_average_is_nearly_one() -> None:
    """The box has no third moment; what is left is a hundredth of what the lag makes."""
    w, box = 2 * np.pi * 2.0, 0.06
    sine = seen("tracking_lag", (box / 2, 3**-0.5), lambda t: np.repeat(np.sin(w * t)[:, :, None], 4, axis=2))
    mean = (np.cos(w * (TIME[0] - box)) - np.cos(w * TIME[0])) / (w * box)
    assert np.abs(sine[:, 0] - mean).max() < 0.015 * np.abs(mean - np.sin(w * TIME[0])).max()


def test_a_sensor_that_looks_ahead_finds_the_motion_there() -> None:
    """The last frames of a fast clock show what happened after the last stamp, not a puck that stands still."""
    fast = Simulator(cell(), [Attached(EFFECTS["clock_drift"], ())], threads=1)
    times = np.linspace(0, 1.0, 20)[None]
    ahead = fast.observe(np.append(cell().defaults, 0.1)[None], DESCRIBED[None], times)
    plain = simulator().observe(values(), DESCRIBED[None], 1.1 * times)
    np.testing.assert_array_equal(ahead, plain)
    assert np.linalg.norm(ahead[0, -1] - ahead[0, -2]) > 1e-3


def test_the_motion_itself_is_left_alone() -> None:
    blurred = Simulator(cell(), [Attached(EFFECTS["camera_rotation"], ())], threads=1)
    turned = blurred.motion(np.append(cell().defaults, [0.1, 0.0, 0.0])[None], DESCRIBED[None], 0.5).positions
    assert (turned == simulator().motion(values(), DESCRIBED[None], 0.5).positions).all()


@pytest.mark.parametrize("name", [n for n, e in EFFECTS.items() if e.channel == "sensing"])
def test_each_rollout_has_its_own_number(name: str) -> None:
    hook = effect(name).sensing
    assert hook is not None
    vector = Site("sensor", ("it",), columns=(0, 1, 2))
    context = Context((vector,), {}, ((0, 1), (2, 3)), ((), ()), 0.001)
    amount, *shapes = effect(name).quantities
    numbers = np.array([[size, *(q.start for q in shapes)] for size in (0.0, amount.high)])
    both = hook(line, numbers, context)(np.tile(TIME, (2, 1)))
    np.testing.assert_array_equal(both[0], line(TIME)[0])
    assert np.abs(both[1] - both[0]).max() > 1e-4


def encoder(name: str, numbers: tuple[float, ...], true: Floats, columns: tuple[int, ...] = (0,)) -> Floats:
    """(30, C) what a sensor with a law says of (30, C) true values."""
    hook = effect(name).sensing
    assert hook is not None
    context = Context((Site("encoder", ("it",), columns=columns),), {}, (), (), 0.001)
    return np.asarray(hook(lambda time: true[None], np.array([numbers]), context)(TIME)[0])


def test_a_scale_and_an_offset_of_a_sensor() -> None:
    true = np.linspace(-2, 3, 60).reshape(30, 2)
    np.testing.assert_allclose(encoder("scale", (0.03,), true), 1.03 * true)
    np.testing.assert_allclose(encoder("offset", (-0.2,), true), true - 0.2)


@pytest.mark.parametrize("turns", [0.1, 0.5, 1.0, 3.0, 20.0])
def test_an_eccentric_disc_reads_as_geometry_has_it(turns: float) -> None:
    """A head at (1, 0) over a disc whose graduation is about a point off the shaft that turns along: to first order."""
    e, f = 2e-4, -1e-4
    angle = np.linspace(0, 2 * np.pi * turns, 30)
    centre = e * np.exp(1j * (angle + 0.4)) + f * np.exp(1j * angle)
    read = angle - np.unwrap(np.angle(1.0 - centre))  # the disc's own angle under the head
    cosine, sine = e * np.sin(0.4), e * np.cos(0.4) + f
    seen = encoder("eccentricity", (cosine, sine, 0.0, 0.0), angle[:, None])
    np.testing.assert_allclose(seen[:, 0] + cosine, read, atol=2e-7)  # its zero is set anew


@pytest.mark.parametrize("gain", [1e-3, -2e-3])
def test_unequal_channels_of_a_resolver_err_twice_a_turn(gain: float) -> None:
    """The arctangent of a sine that is too large and of a cosine that is not: gain / 2 sin(2 q) to first order."""
    angle = np.linspace(-np.pi + 0.1, np.pi - 0.1, 200)
    read = np.arctan2((1 + gain) * np.sin(angle), np.cos(angle))
    seen = encoder("eccentricity", (0.0, 0.0, 0.0, gain / 2), angle[:, None])
    np.testing.assert_allclose(seen[:, 0], read, atol=gain**2)


@pytest.mark.parametrize(
    "vector", [(0.2, 0.0, 0.0), (0.0, -0.1, 0.0), (0.0, 0.0, 0.3), (0.1, 0.2, -0.2), (0.0, 0.0, 0.0)]
)
def test_a_sensor_askew_turns_each_triple_about_its_own_origin(vector: tuple[float, float, float]) -> None:
    """About the axis by the angle of the vector: the part along it stays, lengths and angles too (Rodrigues)."""
    true = np.random.default_rng(0).normal(size=(30, 6))
    found = encoder("rotation", vector, true, tuple(range(6)))
    w = np.array(vector)
    angle = np.linalg.norm(w)
    axis = w / angle if angle else w
    for triple in (slice(0, 3), slice(3, 6)):
        v = true[:, triple]
        along = (v @ axis)[:, None] * axis
        expected = np.cos(angle) * (v - along) + along + np.sin(angle) * np.cross(axis, v)
        np.testing.assert_allclose(found[:, triple], expected, atol=1e-12)


@pytest.mark.parametrize("seed", range(5))
def test_a_camera_askew_turns_a_pose_as_a_whole(seed: int) -> None:
    """Any point of the body is seen where the rotation puts it."""
    rng = np.random.default_rng(seed)
    turn, pose = rng.normal(size=3), np.append(rng.normal(size=3), rng.normal(size=4))
    pose[3:] /= np.linalg.norm(pose[3:])
    (found,) = encoder("rotation", tuple(turn), np.tile(pose, (30, 1)), tuple(range(7)))[:1]
    point, rotation = rng.normal(size=3), Rotation.from_rotvec(turn)

    def seen_at(p: Floats) -> Floats:
        return np.asarray(p[:3] + Rotation.from_quat(p[[4, 5, 6, 3]]).apply(point))

    np.testing.assert_allclose(seen_at(found), rotation.apply(seen_at(pose)), atol=1e-12)
