"""Each force against closed formulas of motion, or against an integrator that knows the documented formula."""

from __future__ import annotations

import numpy as np
import pytest

from compass_ros.types import Floats
from test.simulation.effects.scenes import CREEP, GRAVITY, Acceleration, exported, flown, moved, scene

START, SPEED = np.array([-0.2, 0.03]), np.array([0.4, 0.1])
TIME = 0.6


def along(v: Floats) -> Floats:
    """Direction of motion, faded out under the creep speed as friction is."""
    return np.asarray(v / np.sqrt(v @ v + CREEP**2))


def turned(r: Floats) -> Floats:
    return np.array([-r[1], r[0]])


def radial(r: Floats, strength: float, x: float, y: float, radius: float, tail: float) -> Floats:
    off = r - [x, y]
    return np.asarray(strength / radius * (1 + tail * (off @ off / radius**2 - 1) / 2) ** (-1 / tail) * off)


def wind(v: Floats, ax: float, ay: float, speed: float) -> Floats:
    size = np.hypot(ax, ay)
    relative = speed * np.array([ax, ay]) / size - v
    return np.asarray(size * np.linalg.norm(relative) * relative / speed**2)


def attraction(r: Floats, strength: float, x: float, y: float, core: float) -> Floats:
    off = r - [x, y]
    return np.asarray(-strength * 1.5 * np.sqrt(3) * core**2 * off / (off @ off + core**2) ** 1.5)


def inside(r: Floats, x: float, y: float, radius: float) -> float:
    return float(1 / (1 + np.exp(10 * (np.hypot(*(r - [x, y])) / radius - 1))))


FORMULAS: dict[str, tuple[tuple[float, ...], Acceleration]] = {
    "table_tilt": ((0.02, -0.03), lambda t, r, v: GRAVITY * np.array([0.02, -0.03])),
    "viscous_drag": ((0.8,), lambda t, r, v: -0.8 * v),
    "quadratic_drag": ((3.0,), lambda t, r, v: -3.0 * np.linalg.norm(v) * v),
    "crosswind": ((0.2, -0.3, 1.2), lambda t, r, v: wind(v, 0.2, -0.3, 1.2)),
    "fan_field": ((0.5, -0.05, 0.1, 0.12, 0.7), lambda t, r, v: radial(r, 0.5, -0.05, 0.1, 0.12, 0.7)),
    "swirl": ((0.5, -0.05, 0.1, 0.12, 0.7), lambda t, r, v: turned(radial(r, 0.5, -0.05, 0.1, 0.12, 0.7))),
    "point_attraction": ((0.7, 0.0, 0.1, 0.08), lambda t, r, v: attraction(r, 0.7, 0.0, 0.1, 0.08)),
    "friction_patch": (
        (0.1, -0.1, 0.05, 0.08),
        lambda t, r, v: -0.1 * inside(r, -0.1, 0.05, 0.08) * GRAVITY * along(v),
    ),
    "friction_gradient": ((0.1, 0.2), lambda t, r, v: -(0.1 * r[0] + 0.2 * r[1]) * GRAVITY * along(v)),
    "anisotropic_friction": (
        (0.02, 0.03),
        lambda t, r, v: -GRAVITY * np.array([[0.02, 0.03], [0.03, -0.02]]) @ along(v),
    ),
    "stribeck_friction": (
        (0.04, 0.3),
        lambda t, r, v: -0.04 * np.exp(-((np.linalg.norm(v) / 0.3) ** 2)) * GRAVITY * along(v),
    ),
    "coulomb_friction": ((0.03,), lambda t, r, v: -0.03 * GRAVITY * along(v)),
    "magnus": ((1.5,), lambda t, r, v: 1.5 * turned(v)),
    "pulsating_lift": (
        (0.03, -0.02, 2.5),
        lambda t, r, v: -(0.03 * np.cos(5 * np.pi * t) - 0.02 * np.sin(5 * np.pi * t)) * GRAVITY * along(v),
    ),
}


NEED_A_TABLE = {name for name in FORMULAS if "friction" in name} | {"pulsating_lift", "table_tilt"}
IN_SPACE = {"viscous_drag", "quadratic_drag"}
"""What acts on a body wherever it moves."""


@pytest.mark.parametrize(
    ("name", "kind"),
    [(name, kind) for name in FORMULAS for kind in ("planar", "sliding", "free") if kind != "free" or name in IN_SPACE],
)
def test_a_force_is_what_its_formula_says(name: str, kind: str) -> None:
    numbers, acceleration = FORMULAS[name]
    depth = [np.zeros(1)] if kind == "free" else []
    model = scene(kind)
    given = exported(name, numbers, slide=name in NEED_A_TABLE)
    start, speed = np.concatenate([START, *depth]), np.concatenate([SPEED, *depth])
    after = moved(model, given, start, speed, TIME)
    expected = flown(acceleration, START, SPEED, TIME)
    ballistic = np.concatenate([START + SPEED * TIME, SPEED])
    size = len(start)
    found = np.concatenate([after[:2], after[size : size + 2]])
    assert np.abs(expected - ballistic).max() > 3e-3  # the effect matters
    np.testing.assert_allclose(found, expected, atol=2e-3 * np.abs(expected - ballistic).max() + 2e-5)


def test_viscous_drag_is_an_exponential() -> None:
    after = moved(scene("planar"), exported("viscous_drag", (2.0,)), np.zeros(2), np.array([0.5, 0.0]), 1.0)
    np.testing.assert_allclose(after, [0.25 * (1 - np.exp(-2)), 0, 0.5 * np.exp(-2), 0], rtol=1e-3)


def test_quadratic_drag_halves_the_speed_in_one_over_k_v() -> None:
    after = moved(scene("planar"), exported("quadratic_drag", (4.0,)), np.zeros(2), np.array([0.5, 0.0]), 0.5)
    np.testing.assert_allclose(after, [np.log(2) / 4, 0, 0.25, 0], rtol=3e-4)


def test_a_tilt_gives_a_parabola() -> None:
    after = moved(scene("sliding"), exported("table_tilt", (0.01, 0.0)), np.zeros(2), np.array([0.0, 0.3]), 1.0)
    np.testing.assert_allclose(after, [0.5 * 0.01 * GRAVITY, 0.3, 0.01 * GRAVITY, 0.3], rtol=3e-4)


def test_dry_friction_stops_after_v_squared_over_two_mu_g() -> None:
    after = moved(
        scene("planar"), exported("coulomb_friction", (0.02,), slide=True), np.zeros(2), np.array([0.3, 0]), 3.0
    )
    assert after[0] == pytest.approx(0.3**2 / (2 * 0.02 * GRAVITY), rel=2e-3)
    assert after[2] == pytest.approx(0, abs=1e-6)


def test_magnus_turns_a_path_into_a_circle() -> None:
    after = moved(scene("planar"), exported("magnus", (2.0,)), np.zeros(2), np.array([0.4, 0.0]), np.pi / 2)
    np.testing.assert_allclose(after, [0, 0.4, -0.4, 0], atol=4e-4)  # half a turn, anticlockwise, radius v / rate


def pushed(name: str, r: float, tail: tuple[float, ...]) -> float:
    """Acceleration [m/s^2] at a distance r [m] from the centre of a field of strength 1 and radius (or core) 0.2."""
    field = exported(name, (1.0, 0.05, 0.0, 0.2, *tail))
    after = moved(scene("planar", 1e-4), field, np.array([0.05 + r, 0.0]), np.zeros(2), 1e-3)
    return float(np.hypot(*after[2:]) / 1e-3)


@pytest.mark.parametrize(
    ("name", "radius", "tail"),
    [("fan_field", 0.2, (0.0,)), ("swirl", 0.2, (0.3,)), ("swirl", 0.2, (1.2,)), ("point_attraction", 0.141421, ())],
)
def test_a_field_peaks_with_its_strength_at_its_radius(name: str, radius: float, tail: tuple[float, ...]) -> None:
    assert pushed(name, radius, tail) == pytest.approx(1.0, rel=1e-3)
    assert max(pushed(name, 0.95 * radius, tail), pushed(name, 1.05 * radius, tail)) < 1.0


@pytest.mark.parametrize(
    ("tail", "far"), [(0.0, 3 * np.exp(-4)), (1e-10, 3 * np.exp(-4)), (1e-3, 3 * np.exp(-4)), (1.0, 0.6)]
)
def test_a_tail_of_one_falls_as_1_over_r_and_no_tail_as_a_bell_does(tail: float, far: float) -> None:
    assert pushed("swirl", 0.6, (tail,)) == pytest.approx(far, rel=2e-2)


def test_a_fast_stream_pushes_as_a_tilt_does() -> None:
    stream = moved(scene("planar"), exported("crosswind", (0.1, 0.0, 1e4)), np.zeros(2), np.array([0.0, 0.3]), 1.0)
    tilt = moved(scene("planar"), exported("table_tilt", (0.1 / GRAVITY, 0.0)), np.zeros(2), np.array([0.0, 0.3]), 1.0)
    np.testing.assert_allclose(stream, tilt, atol=1e-4)


@pytest.mark.parametrize(
    ("name", "numbers", "rate"),
    [
        ("coulomb_friction", (2e-5,), 5.0 - 2e-5 / 9e-6),
        ("stribeck_friction", (2e-5, 1e4), 5.0 - 2e-5 / 9e-6),
        ("viscous_drag", (1e-5,), 5.0 * np.exp(-1e-5 / 9e-6)),
    ],
)
def test_on_a_joint_a_force_is_a_torque(name: str, numbers: tuple[float, ...], rate: float) -> None:
    after = moved(scene("hinge"), exported(name, numbers, ("hinge",)), np.zeros(1), np.array([5.0]), 1.0)
    assert after[1] == pytest.approx(rate, rel=1e-3)


def test_a_force_acts_at_the_centre_of_mass() -> None:
    """A tilt does not turn a puck whose mass is off centre, and a drag slows its centre of mass."""
    model = scene("planar", centre="0.004 0.002 0")
    tilted = moved(model, exported("table_tilt", (0.02, 0.01)), np.zeros(3), np.array([0.2, 0.1, 0.0]), 0.5)
    np.testing.assert_allclose(tilted[3:5], [0.2 + 0.02 * GRAVITY / 2, 0.1 + 0.01 * GRAVITY / 2], rtol=1e-4)
    assert tilted[5] == pytest.approx(0, abs=1e-9)
    slowed = moved(model, exported("viscous_drag", (2.0,)), np.zeros(3), np.array([0.0, 0.0, 9.0]), 0.01)
    assert slowed[5] == pytest.approx(9.0, rel=1e-6)  # its spin about that centre is left alone
