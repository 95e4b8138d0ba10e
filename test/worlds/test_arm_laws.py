"""Each law of a joint against its source's closed form, or a limit that can be written down."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from compass_ros.types import Floats
from compass_ros.worlds.arms.chain import mass_matrix
from compass_ros.worlds.arms.law import Law, Moment
from compass_ros.worlds.arms.laws.bodies import LooseBase, Payload, TiltedBase
from compass_ros.worlds.arms.laws.bristles import Dahl, LuGre
from compass_ros.worlds.arms.laws.curves import LoadFriction, PlaceFriction, SkewFriction, StribeckCurve
from compass_ros.worlds.arms.laws.encoders import MagnetOffCentre, SlowClock
from compass_ros.worlds.arms.laws.fields import BalanceSpring, Cogging, DressPack, EddyBrake
from compass_ros.worlds.arms.laws.gears import FlexibleGear, Play, TransmissionError
from compass_ros.worlds.arms.laws.servos import (
    CommandPlay,
    ComplianceMargin,
    LineLatency,
    ProfileSpeed,
    SaggingDrive,
    Smoothing,
)
from compass_ros.worlds.arms.laws.thermal import WarmingUp
from compass_ros.worlds.arms.motion import Drive, play
from test.worlds.arms import arm, frictionless, moment

NONE = np.zeros((1, 2))


def one(*values: float) -> Floats:
    return np.array(values)


def torque(law: Law, at: Moment, inner: Floats | None = None) -> Floats:
    """(N,) of a single moment."""
    state = law.begin(1) if inner is None else inner
    found: Floats = np.asarray(law.force(at, state, NONE))[0]
    return found


def width(law: Law, rate: float, effort: float = 0.0, q: float = 0.0, time_s: float = 0.0) -> tuple[float, float]:
    """Bounds of the shoulder's dry friction."""
    own = arm()
    bounds = (-own.dry[None], own.dry[None])
    lower, upper = law.bounds(moment(own, one(q, 0), one(rate, 0), time_s), np.array([[effort, 0.0]]), bounds)
    return float(lower[0, 0]), float(upper[0, 0])


@pytest.mark.nightly
def test_lugre_slides_on_stribecks_curve_and_is_a_spring_before() -> None:
    law = LuGre((0,), one(0.12), one(0.2), one(0.05), one(0.001), one(0.3))
    own = law.fitted(arm())
    assert own.dry[0] == 0
    for rate in (0.01, -0.05, 0.3):
        at = moment(own, NONE, one(rate, 0))
        level = 0.12 + 0.08 * np.exp(-((rate / 0.05) ** 2))
        slid = law.advance(at, law.begin(1), 10.0)
        assert torque(law, at, slid)[0] == pytest.approx(-np.sign(rate) * level, rel=1e-6)
    bent = law.advance(moment(own, NONE, one(1e-4, 0)), law.begin(1), 0.01)
    assert torque(law, moment(own, NONE, NONE), bent)[0] == pytest.approx(-0.12 / 0.001 * 1e-6, rel=1e-3)


def test_dahl_nears_its_level_as_an_exponential_of_the_way() -> None:
    law = Dahl((0,), one(0.3), one(0.04))
    at = moment(arm(), NONE, one(0.5, 0))
    for way in (0.01, 0.04, 0.1):
        bent = law.advance(at, law.begin(1), way / 0.5)
        assert torque(law, at, bent)[0] == pytest.approx(-0.3 * (1 - np.exp(-way / 0.04)))


def test_stribecks_curve_falls_by_e_at_its_speed_and_locks() -> None:
    law = StribeckCurve((0,), one(0.1), one(0.05))
    assert width(law, 0) == pytest.approx((-0.22, 0.22))
    assert width(law, -0.05)[1] == pytest.approx(0.12 + 0.1 / np.e)
    assert width(law, 10)[0] == pytest.approx(-0.12)
    assert law.fitted(arm()).soft[0] < 0.02 * arm().soft[0]


def test_friction_of_a_loaded_gear_grows_with_the_load() -> None:
    law = LoadFriction((0,), one(0.05), one(0.1))
    assert width(law, 5.0, effort=-2.0) == pytest.approx((-0.22, 0.22))
    assert width(law, 0.0, effort=2.0) == pytest.approx((-0.42, 0.42))
    assert width(law, 0.0, effort=0.0) == pytest.approx((-0.12, 0.12))


def test_skew_friction_keeps_its_mean() -> None:
    there, back = width(SkewFriction((0,), one(0.25)), 1.0)
    assert there == pytest.approx(-0.15)
    assert back == pytest.approx(0.09)


def test_friction_of_a_place_repeats_and_keeps_its_mean() -> None:
    law = PlaceFriction((0,), one(0.5), one(0.3))
    around = [width(law, 1.0, q=float(q))[1] for q in np.linspace(0, np.pi, 60, endpoint=False)]
    assert np.mean(around) == pytest.approx(0.12)
    assert np.ptp(around) == pytest.approx(0.12, rel=0.01)


def test_a_gear_warms_up_by_e_in_its_time() -> None:
    law = WarmingUp((0,), one(1.5), 60.0)
    assert width(law, 1.0)[1] == pytest.approx(0.12 * 2.5)
    assert width(law, 1.0, time_s=60.0)[1] == pytest.approx(0.12 * (1 + 1.5 / np.e))
    two = moment(arm(), np.zeros((2, 2)), np.tile(one(1.0, 0), (2, 1)))  # the second recording begins a minute later
    cold, warm = np.asarray(law.force(two, law.begin(2), np.zeros((2, 2))))[:, 0]
    assert warm / cold == pytest.approx(1 / np.e)
    assert cold == pytest.approx(-1.5 * arm().damping[0])


def test_cogging_repeats_with_its_teeth_and_has_no_mean() -> None:
    law = Cogging((0,), one(0.2), one(9), np.array([[1, 0.4, 0.1]]), np.array([[0.3, 1.0, -2.0]]))
    turn = np.linspace(0, 2 * np.pi / 9, 400, endpoint=False)
    felt = np.array([torque(law, moment(arm(), one(q, 0), NONE))[0] for q in turn])
    again = np.array([torque(law, moment(arm(), one(q + 2 * np.pi / 9, 0), NONE))[0] for q in turn])
    assert np.allclose(felt, again)
    assert abs(felt.mean()) < 1e-12
    assert np.abs(np.fft.rfft(felt))[1:4] / 200 == pytest.approx([0.2, 0.08, 0.02])


def test_a_balance_spring_is_the_slope_of_its_energy() -> None:
    law = BalanceSpring((0,), one(400), one(0.1), one(0.07), one(0.05), one(0.4))
    for q in (-2.0, -0.3, 0.4, 1.1, 2.9):
        slope = (law.energy(np.array([[q + 1e-6]])) - law.energy(np.array([[q - 1e-6]])))[0, 0] / 2e-6
        assert torque(law, moment(arm(), one(q, 0), NONE))[0] == pytest.approx(-slope, abs=1e-7)


def test_a_dress_pack_stiffens_alike_to_both_sides() -> None:
    law = DressPack((0,), one(0.5), one(0.2), one(0.1))
    there, back = (torque(law, moment(arm(), one(q, 0), NONE))[0] for q in (1.1, -0.9))
    assert there == pytest.approx(-0.7)
    assert back == pytest.approx(0.7)


def test_an_eddy_brake_is_strongest_at_its_critical_speed() -> None:
    law = EddyBrake((0,), one(0.3), one(2.0))
    felt = {v: torque(law, moment(arm(), NONE, one(v, 0)))[0] for v in (0.02, 1.9, 2.0, 2.1, 40.0)}
    assert felt[2.0] == pytest.approx(-0.3) == min(felt.values())
    assert felt[0.02] == pytest.approx(-0.3 * 0.02, rel=1e-3)
    assert felt[40.0] > -0.04


def gear() -> FlexibleGear:
    return FlexibleGear((0,), one(100), np.array([[1.4, 1.7]]), np.array([[0.5, 1.5]]), one(0.0), one(0.2), one(0.002))


def test_a_gear_has_three_stiffnesses_and_a_loop() -> None:
    law = gear()
    for twist, stiffness in ((0.002, 100), (0.008, 140), (0.05, 170)):
        slope = (law.spring(one(twist + 1e-6)) - law.spring(one(twist - 1e-6)))[0] / 2e-6
        assert slope == pytest.approx(stiffness)
        assert law.spring(one(-twist)) == pytest.approx(-law.spring(one(twist)))
    assert law.spring(one(0.005))[0] == pytest.approx(0.5)
    own = law.fitted(arm())
    lost, inner = 0.0, law.begin(1)
    for rate in (1.0, -1.0, 1.0, -1.0):  # the loop of the bristle is 4 x torque x half-width for wide swings
        for _ in range(4000):
            at = moment(own, np.zeros((1, 3)), one(0, 0, rate))
            inner = law.advance(at, inner, 1e-5)
            lost += float(law.loop[0] / law.bristle[0] * inner[0, 0]) * rate * 1e-5
    assert lost == pytest.approx(4 * 0.2 * 0.04, rel=0.15)


@pytest.mark.nightly
def test_a_stiff_gear_is_no_gear() -> None:
    drive = Drive(None, np.array([[0.8, -0.6]]), 0.0, 0.5, 100.0, np.zeros(1))
    stiff = replace(gear(), stiffness=one(2e4), damping=one(2.0), loop=one(0.0), ends=np.array([[1e6, 2e6]]))
    own = frictionless(arm())
    assert np.abs(play(own, drive, [stiff]).angle - play(own, drive).angle).max() < 1e-3
    soft = replace(stiff, stiffness=one(5.0), damping=one(0.02))
    assert np.abs(play(own, drive, [soft]).angle - play(own, drive).angle).max() > 5e-3


def test_play_pushes_and_never_pulls() -> None:
    law = Play((0,), one(0.01), one(1000), one(2.0))
    assert law.contact(one(0.004), one(5.0)) == 0
    assert law.contact(one(0.006), one(0.0)) == pytest.approx(1.0)
    assert law.contact(one(-0.006), one(0.0)) == pytest.approx(-1.0)
    assert law.contact(one(0.006), one(-5.0)) == 0


def test_a_transmission_error_neither_wins_nor_loses_energy() -> None:
    law = TransmissionError((0,), np.array([[0.002, 0.0005]]), one(60), np.array([[0.3, 1.0]]), one(900), one(0))
    own = law.fitted(arm())
    rng = np.random.default_rng(1)
    for _ in range(5):
        q, v = rng.normal(size=3), rng.normal(size=3)
        q[2] = q[0] + 0.003 * rng.normal()

        def energy(at: Floats) -> float:
            ahead, _ = law.wave(at[None, 2:])
            return float(0.5 * 900 * (at[2] - at[0] + ahead[0, 0]) ** 2)

        power = torque(law, moment(own, q, v)) @ v
        assert power == pytest.approx(-(energy(q + 1e-7 * v) - energy(q - 1e-7 * v)) / 2e-7, rel=1e-4, abs=1e-6)


def test_a_payload_adds_the_energy_of_a_ball() -> None:
    own, place = arm(), one(0.03, -0.02, -0.3)
    law = Payload((), 0.2, place, 0.02)
    q = one(0.7, -0.4)
    more = mass_matrix(q, own.armature, *law.fitted(own).chain) - mass_matrix(q, own.armature, *own.chain)
    alone = replace(own, mass=one(0, 0.2), centre=np.stack([np.zeros(3), place]), inertia=np.zeros((2, 3, 3)))
    ball = replace(alone, inertia=np.stack([np.zeros((3, 3)), 0.4 * 0.2 * 0.02**2 * np.eye(3)]))
    assert np.allclose(more, mass_matrix(q, np.zeros(2), *ball.chain), rtol=1e-9)


@pytest.mark.nightly
def test_a_tilt_about_the_first_axis_is_an_offset_of_that_joint() -> None:
    own = arm()
    tilted = TiltedBase((), one(0.0, 0.02)).fitted(own)
    assert np.linalg.norm(tilted.gravity) == pytest.approx(9.81)
    drive = Drive(None, np.array([[0.8, -0.6]]), 0.0, 1.0, 100.0, np.zeros(1))
    moved = replace(drive, first=drive.first + one(0.02, 0))
    found = play(frictionless(tilted), drive).angle - play(frictionless(own), moved).angle
    assert np.abs(found + one(0.02, 0)).max() < 1e-6
    aside = TiltedBase((), one(0.02, 0.0)).fitted(own)
    assert np.abs(play(frictionless(aside), drive).angle - play(frictionless(own), drive).angle).max() > 1e-3


def test_a_stiff_base_stands_and_a_loose_one_rocks() -> None:
    own = frictionless(arm())
    drive = Drive(None, np.array([[0.8, -0.6]]), 0.0, 0.5, 100.0, np.zeros(1))
    still = play(own, drive).angle
    for stiffness, low, high in ((2e6, 0.0, 1e-4), (100.0, 1e-3, 1.0)):
        law = LooseBase((), one(stiffness, stiffness), one(10, 10), 0.2)
        assert low <= np.abs(play(own, drive, [law]).angle - still).max() <= high


def test_a_drive_has_less_torque_at_speed_and_under_load() -> None:
    law = SaggingDrive((0, 1), one(4, 2), one(10, 10), 0.2)
    still, fast = (moment(arm(), NONE, one(v, 0)) for v in (0.0, 10.0))
    assert law.effort(still, np.array([[9.0, 0.0]]))[0, 0] == pytest.approx(4 * (1 - 0.2 * 0.5))
    assert law.effort(still, np.array([[9.0, 9.0]]))[0, 0] == pytest.approx(4 * (1 - 0.2))
    assert law.effort(fast, np.array([[9.0, 0.0]]))[0, 0] == pytest.approx(0.0)
    assert law.effort(fast, np.array([[-3.0, 0.0]]))[0, 0] == pytest.approx(-3.0)
    assert law.effort(still, np.array([[1.0, -0.5]]))[0] == pytest.approx(one(1.0, -0.5))


def test_a_margin_swallows_small_errors_whole() -> None:
    law = ComplianceMargin((0,), one(0.005))
    seen = law.error(moment(arm(), NONE, NONE), np.array([[0.004, 0.004]]))
    assert seen[0] == pytest.approx(one(0, 0.004))
    assert law.error(moment(arm(), NONE, NONE), np.array([[-0.006, 0]]))[0, 0] == -0.006


def commands(values: Floats) -> tuple[Floats, Floats]:
    """(T,) times and (1, T, 2) targets of the shoulder."""
    return np.arange(len(values)) * 0.0005, np.stack([values, np.zeros_like(values)], axis=-1)[None]


def test_play_in_a_command_loses_its_width_at_every_turn() -> None:
    way = np.concatenate([np.linspace(0, 1, 1000), np.linspace(1, -1, 2000)])
    told = CommandPlay((0,), one(0.1)).command(*commands(way))[0, :, 0]
    assert told.max() == pytest.approx(0.95)
    assert told.min() == pytest.approx(-0.95)
    assert (np.abs(told - way) <= 0.05 + 1e-12).all()


def test_a_line_is_late_by_its_latency() -> None:
    time, targets = commands(np.sin(np.arange(4000) * 0.01))
    late = LineLatency((), 0.01).command(time, targets)
    assert np.array_equal(late[:, 20:], targets[:, :-20])
    assert (late[:, :20] == targets[:, :1]).all()


def test_a_profile_keeps_to_its_speed_and_arrives() -> None:
    time, targets = commands(np.where(np.arange(4000) < 500, 0.0, 0.6))
    told = ProfileSpeed((0,), one(0.5)).command(time, targets)[0, :, 0]
    assert np.diff(told).max() / 0.0005 == pytest.approx(0.5)
    assert told[-1] == pytest.approx(0.6)


def test_smoothing_answers_a_step_as_two_equal_filters_do() -> None:
    time, targets = commands(np.where(np.arange(2000) < 1, 0.0, 1.0))
    told = Smoothing((0,), one(0.03)).command(time, targets)[0, :, 0]
    assert np.abs(told - (1 - (1 + time / 0.03) * np.exp(-time / 0.03))).max() < 0.01


def test_a_magnet_off_the_axis_errs_once_and_twice_a_turn() -> None:
    law = MagnetOffCentre((0,), np.array([[0.01, 0.002]]), np.array([[0.5, -1.0]]))
    turn = np.zeros((1, 400, 2))
    turn[0, :, 0] = np.linspace(0, 2 * np.pi, 400, endpoint=False)
    wrong = (law.seen(turn) - turn)[0]
    assert np.abs(np.fft.rfft(wrong[:, 0]))[1:4] / 200 == pytest.approx([0.01, 0.002, 0], abs=1e-9)
    assert wrong[0, 0] == 0  # the encoder's zero is set with the magnet where it is
    assert (wrong[:, 1] == 0).all()


def test_a_slow_clock_runs_away_by_its_rate() -> None:
    time = np.arange(500) / 100
    assert SlowClock((), 0.005).clock(time) == pytest.approx(1.005 * time)
    drive = Drive(None, np.array([[0.8, -0.6]]), 0.0, 2.0, 100.0, np.zeros(1))
    seen, true = play(arm(), drive, [SlowClock((), 0.005)]).angle[0, :, 0], play(arm(), drive).angle[0, :, 0]
    between = np.interp(1.005 * time[:190], time[:201], true)
    assert np.abs(seen[:190] - between).max() < 1e-3  # what lines between the frames allow
    assert np.abs(seen[:190] - true[:190]).max() > 0.01
