"""Laws of geared and driven joints in motion, against formulas integrated or closed."""

from __future__ import annotations

from collections.abc import Callable

import mujoco
import numpy as np
import pytest

from compass_ros.errors import ConfigError
from compass_ros.simulation.effects import Attached, Exported, FittedEffect, attach, effect
from compass_ros.simulation.effects.effect import Context
from compass_ros.simulation.sizes import DriveSize
from compass_ros.types import Floats
from test.simulation.effects.scenes import flown

INERTIA = 0.05


def axis(actuator: str = "", kind: str = "hinge", step: float = 1e-4) -> mujoco.MjModel:
    """A joint of inertia (or mass) 0.05 without weight, and what drives it."""
    return mujoco.MjModel.from_xml_string(
        f'<mujoco><option timestep="{step}" gravity="0 0 0" integrator="implicitfast"/><worldbody><body>'
        f'<joint name="axis" type="{kind}" axis="0 0 1"/><inertial pos="0 0 0" mass="0.05" diaginertia=".05 .05 .05"/>'
        f"</body></worldbody><actuator>{actuator}</actuator></mujoco>"
    )


def three_links(step: float) -> mujoco.MjModel:
    """Joints j0 to j2 under gravity, without drives."""
    chain = "".join(
        f'<body pos="{0.3 * (i > 0)} 0 0"><joint name="j{i}" axis="0 1 0"/>'
        '<inertial pos="0.15 0 0" mass="0.5" diaginertia=".004 .004 .004"/>'
        for i in range(3)
    )
    return mujoco.MjModel.from_xml_string(
        f'<mujoco><option timestep="{step}"/><worldbody>{chain}{"</body>" * 3}</worldbody></mujoco>'
    )


def laws(*given: tuple[str, tuple[float, ...], str]) -> Exported:
    return Exported(tuple(FittedEffect(Attached(effect(n), (on,)), numbers, ()) for n, numbers, on in given), {})


def moved(
    model: mujoco.MjModel, given: Exported, start: tuple[float, float], seconds: float, told: float = 0.0
) -> Floats:
    """(2,) position and rate after some seconds."""
    data = mujoco.MjData(model)
    data.qpos[0], data.qvel[0] = start
    if model.nu:
        data.ctrl[0] = told
    with attach(model, data, given):
        mujoco.mj_step(model, data, nstep=round(seconds / model.opt.timestep))
    return np.array([data.qpos[0], data.qvel[0]])


@pytest.mark.parametrize("kind", ["hinge", "slide"])
@pytest.mark.parametrize(
    ("coulomb", "difference", "speed"),
    [(0.1, 0.05, 4.0), (0.1, 0.05, -4.0), (0.1, -0.1, 4.0), (0.1, -0.05, -4.0), (0.0, 0.1, 4.0), (0.0, 0.1, -4.0)],
)
def test_friction_is_higher_forwards_by_the_difference(
    kind: str, coulomb: float, difference: float, speed: float
) -> None:
    given = laws(("coulomb_friction", (coulomb,), "axis"), ("asymmetric_friction", (difference,), "axis"))
    slowing = (coulomb + (difference if speed > 0 else 0.0)) / INERTIA
    _, rate = moved(axis(kind=kind), given, (0.0, speed), 0.5)
    assert rate == pytest.approx(np.sign(speed) * (abs(speed) - 0.5 * slowing), rel=1e-4)


def test_one_sided_friction_holds_what_it_has_stopped() -> None:
    given = laws(("asymmetric_friction", (0.2,), "axis"))
    position, rate = moved(axis(step=1e-3), given, (0.0, 2.0), 3.0)
    assert position == pytest.approx(2.0**2 / (2 * 0.2 / INERTIA), abs=2.0 * 1e-3)  # what it moves within a step
    assert abs(rate) < 1e-6


FRICTIONS = [
    ("coulomb_friction", (0.2,)),
    ("stribeck_friction", (0.2, 0.5)),
    ("asymmetric_friction", (0.2,)),
    ("load_dependent_friction", (1.5,)),
]


@pytest.mark.parametrize("step", [1e-3, 5e-3])
@pytest.mark.parametrize("share", [0.1, 0.9])
@pytest.mark.parametrize(("law", "numbers"), FRICTIONS)
def test_friction_holds_a_joint_against_a_load_below_it(
    law: str, numbers: tuple[float, ...], share: float, step: float
) -> None:
    """A motor that pulls for ten seconds: the joint does not creep."""
    model = axis('<motor name="m" joint="axis"/>', step=step)
    position, rate = moved(model, laws((law, numbers, "axis")), (0.3, 0.0), 10.0, told=0.2 * share)
    assert abs(position - 0.3) < 1e-9
    assert abs(rate) < 1e-9


@pytest.mark.parametrize("size", [-0.1, 0.0, 0.1])
@pytest.mark.parametrize("law", ["stribeck_friction", "asymmetric_friction"])
def test_a_joints_own_friction_holds_with_a_laws(law: str, size: float) -> None:
    """Frictionloss and law together bear the load without a creep; without a law frictionloss creeps as MuJoCo's."""
    model = axis('<motor name="m" joint="axis"/>', step=1e-3)
    model.dof_frictionloss[0] = 0.2
    numbers = (size, 0.5) if law == "stribeck_friction" else (size,)
    position, rate = moved(model, laws((law, numbers, "axis")), (0.3, 0.0), 10.0, told=0.9 * (0.2 + size))
    if size:
        assert abs(position - 0.3) < 1e-9
        return
    alone, its_rate = moved(model, laws(), (0.3, 0.0), 10.0, told=0.18)
    np.testing.assert_allclose((position, rate), (alone, its_rate), rtol=1e-12)
    assert position - 0.3 > 0.03


@pytest.mark.parametrize("last", [(0.02, 1.0), (-100.0, -20.0), (-100.0, 0.0)])
@pytest.mark.parametrize("middle", [0.5, 4.0])
def test_joints_beside_one_with_a_law_keep_mujocos_friction(middle: float, last: tuple[float, float]) -> None:
    """Three links whose middle joint has a law that is as soft as frictionloss: all move as with frictionloss alone.

    `last`: `solreffriction` of the last joint; without damping (0) no speed is pulled towards zero.
    """
    model, ends = three_links(0.001), []
    model.dof_solref[2] = last
    for given in (laws(("coulomb_friction", (middle, SOFT_S), "j1")), laws()):
        model.dof_frictionloss[:] = 8.0, 0.0 if given.effects else middle, 1.3
        data = mujoco.MjData(model)
        with attach(model, data, given):
            mujoco.mj_step(model, data, nstep=1500)
        ends.append(data.qpos.copy())
    assert np.abs(ends[1]).max() > 0.3
    np.testing.assert_allclose(ends[0], ends[1], atol=1e-3)


@pytest.mark.parametrize("on", ["j0", "j2"])
def test_a_joint_is_held_while_others_creep(on: str) -> None:
    """What MuJoCo's frictionloss of the others does to a held joint is borne by its friction too."""
    model = three_links(0.001)
    model.dof_frictionloss[:] = 8.0, 4.0, 1.3
    data = mujoco.MjData(model)
    with attach(model, data, laws(("coulomb_friction", (1.0,), on))):
        mujoco.mj_step(model, data, nstep=1500)
    assert abs(data.joint(on).qpos[0]) < 1e-3
    assert np.abs(data.qpos).max() > 0.1


@pytest.mark.parametrize(("law", "numbers"), FRICTIONS[:3])
def test_friction_lets_go_above_it(law: str, numbers: tuple[float, ...]) -> None:
    model = axis('<motor name="m" joint="axis"/>', step=1e-3)
    position, _ = moved(model, laws((law, numbers, "axis")), (0.3, 0.0), 1.0, told=0.21)
    assert position - 0.3 > 0.5 * 0.009 / INERTIA * 1.0**2


SOFT_S = 0.95 * 0.02 / 2
"""Time constant of MuJoCo's frictionloss at its defaults: 1 / b with b = 2 / (d_max timeconst)."""


@pytest.mark.parametrize("step", [1e-3, 4e-3])
@pytest.mark.parametrize("start", [-0.6, 0.5])
def test_soft_friction_is_what_mujoco_calls_frictionloss(start: float, step: float) -> None:
    model = axis('<position name="s" joint="axis" kp="4" kv=".4"/>', step=step)
    held, ours = (
        moved(model, laws(("coulomb_friction", (0.2, softness), "axis")), (start, 0.0), 3.0) for softness in (0, SOFT_S)
    )
    model.dof_frictionloss[0] = 0.2
    theirs = moved(model, laws(), (start, 0.0), 3.0)
    assert abs(theirs[0]) > 0.02  # it sticks beside the target
    assert abs(held[0] - theirs[0]) > 0.005
    np.testing.assert_allclose(ours, theirs, atol=1e-6)


def test_soft_frictions_of_coupled_joints_are_mujocos_too() -> None:
    model = three_links(0.001)
    most, ends = (1.0, 0.5, 0.2), []
    for mine in (False, True):
        model.dof_frictionloss[:] = 0.0 if mine else most
        given = laws(*(("coulomb_friction", (f * mine, SOFT_S), f"j{i}") for i, f in enumerate(most)))
        data = mujoco.MjData(model)
        with attach(model, data, given):
            mujoco.mj_step(model, data, nstep=1500)
        ends.append(data.qpos.copy())
    np.testing.assert_allclose(ends[1], ends[0], atol=1e-3)


@pytest.mark.parametrize("share", [-0.7, 0.3])
def test_a_joint_creeps_in_proportion_to_what_pulls_at_it(share: float) -> None:
    """At rest v / tau + R F = 0, R = (1 - d) / (d I) with d = 0.9."""
    model = axis('<motor name="m" joint="axis"/>', step=1e-3)
    given = laws(("coulomb_friction", (0.2, 0.02), "axis"))
    position, rate = moved(model, given, (0.3, 0.0), 5.0, told=0.2 * share)
    creep = 0.02 * (0.1 / 0.9 / INERTIA) * 0.2 * share
    assert rate == pytest.approx(creep, rel=1e-6)
    assert position - 0.3 == pytest.approx(5.0 * creep, rel=1e-2)


@pytest.mark.parametrize("speed", [0.0, 0.1])
def test_coupled_joints_are_held_together(speed: float) -> None:
    """Three links under gravity, each held by friction above its weight's torque: they come to rest and stay there."""
    model = three_links(0.002)
    data = mujoco.MjData(model)
    data.qvel[:] = speed
    given = laws(*(("coulomb_friction", (most,), f"j{i}") for i, most in enumerate((8.0, 4.0, 1.2))))
    with attach(model, data, given):
        mujoco.mj_step(model, data, nstep=100)
        rest = data.qpos.copy()
        mujoco.mj_step(model, data, nstep=2000)
    assert np.abs(rest).max() < 0.01
    assert np.abs(data.qpos - rest).max() < 1e-6


@pytest.mark.parametrize("torque", [0.5, -0.3])
@pytest.mark.parametrize("coefficient", [0.0, 0.1, 0.5])
@pytest.mark.parametrize("applied", [False, True])
def test_a_gear_loses_its_share_of_what_drives_it(torque: float, coefficient: float, applied: bool) -> None:
    """Whatever the torque comes from: a motor behind a gear, or a force on the joint."""
    model = axis('<motor name="m" joint="axis" gear="2"/>')
    data = mujoco.MjData(model)
    data.ctrl[0], data.qfrc_applied[0] = (0.0, torque) if applied else (torque / 2, 0.0)
    with attach(model, data, laws(("load_dependent_friction", (coefficient,), "axis"))):
        mujoco.mj_step(model, data, nstep=2000)
    assert data.qvel[0] == pytest.approx(0.2 * torque * (1 - coefficient) / INERTIA, rel=1e-3)


def test_friction_by_load_knows_the_load_of_this_very_moment() -> None:
    """Of a servo, whose torque changes with the angle: against the formula integrated. No load, no friction."""
    model = axis('<position name="s" joint="axis" kp="4" kv=".1"/>')

    def formula(t: float, q: Floats, v: Floats) -> Floats:
        servo = 4 * (1.0 - q) - 0.1 * v
        return np.asarray((servo - 0.2 * np.abs(servo) * np.tanh(v / 1e-3)) / INERTIA)

    found = moved(model, laws(("load_dependent_friction", (0.2,), "axis")), (0.0, 0.0), 0.3, told=1.0)
    np.testing.assert_allclose(found, flown(formula, np.zeros(1), np.zeros(1), 0.3, 600), rtol=2e-3)
    assert moved(axis(), laws(("load_dependent_friction", (0.9,), "axis")), (0.0, 3.0), 0.3)[1] == 3.0


@pytest.mark.parametrize("periods", [1.0, 4.0, 7.5, 24.0, 60.0])
def test_cogging_repeats_with_the_angle(periods: float) -> None:
    def formula(t: float, q: Floats, v: Floats) -> Floats:
        once = 0.3 * np.cos(periods * q) - 0.2 * np.sin(periods * q)
        return np.asarray((once + 0.1 * np.cos(2 * periods * q) + 0.15 * np.sin(2 * periods * q)) / INERTIA)

    numbers = (0.3, -0.2, periods, 0.1, 0.15)
    found = moved(axis(), laws(("cogging", numbers, "axis")), (0.2, 5.0), 0.5)
    np.testing.assert_allclose(found, flown(formula, np.array([0.2]), np.array([5.0]), 0.5, 600), rtol=1e-3)
    turned = moved(axis(), laws(("cogging", numbers, "axis")), (0.2 + 2 * np.pi / periods, 5.0), 0.5)
    np.testing.assert_allclose(turned - found, [2 * np.pi / periods, 0], atol=1e-5)


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
    rate = moved(axis(actuator), laws(("torque_saturation", (1 / 0.4, 0.0), "a")), (0.0, 0.0), 0.1, told)[1]
    assert rate == pytest.approx(np.sign(told) * 0.1 * limit / INERTIA, rel=1e-3)


@pytest.mark.parametrize("actuator", ['<motor name="a" joint="axis"/>', '<velocity name="a" joint="axis" kv="9"/>'])
@pytest.mark.parametrize("told", [9.0, -9.0])
def test_a_motor_nears_its_speed_without_a_load_as_an_exponential(actuator: str, told: float) -> None:
    """inertia v' = limit (1 - v / most); against its motion it pushes as hard as it can."""
    limit, most, seconds = 0.4, 2.0, 0.3
    law = laws(("torque_saturation", (1 / limit, 1 / most), "a"))
    rate = moved(axis(actuator), law, (0.0, 0.0), seconds, told)[1]
    expected = most * -np.expm1(-limit * seconds / (INERTIA * most))
    assert rate == pytest.approx(np.sign(told) * expected, rel=5e-3)
    braked = moved(axis(actuator), law, (0.0, -1.5 * np.sign(told)), 0.01, told)[1]
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
    found = moved(model, servo(band, punch), (0.1, 0.0), 0.4, told)
    np.testing.assert_allclose(found, flown(formula, np.array([0.1]), np.zeros(1), 0.4, 600), rtol=3e-3, atol=1e-3)


def test_within_its_dead_band_a_servo_does_nothing() -> None:
    model = axis('<position name="a" joint="axis" kp="4"/>')
    for punch in (0.0, 1.0):
        assert moved(model, servo(0.2, punch), (0.1, 0.0), 0.5, 0.25)[1] == pytest.approx(0, abs=1e-12)
    assert abs(moved(model, servo(0.2, 0.0), (0.1, 0.0), 0.5, 0.35)[1]) > 0.1


def test_a_dead_band_of_what_is_told_a_force_is_outside_of_the_model() -> None:
    model = axis('<motor name="a" joint="axis"/>')
    with pytest.raises(ConfigError, match="'dead_band' belongs to the actuation, outside"):
        moved(model, laws(("dead_band", (0.1,), "a")), (0.0, 0.0), 0.1, 0.5)


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


def followed(name: str, told: Floats, number: float) -> Floats:
    """(T,) what a drive makes of (T,) commands."""
    hook = effect(name).controls
    assert hook is not None
    return np.asarray(hook(told[None, :, None], np.array([[number]]), Context((), {}, (), (), STEP))[0, :, 0])
