"""Laws of geared joints in motion, against formulas integrated or closed."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from compass_ros.simulation.effects import attach
from compass_ros.types import Floats
from test.simulation.effects.scenes import INERTIA, axis, flown, laws, swung


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
    _, rate = swung(axis(kind=kind), given, (0.0, speed), 0.5)
    assert rate == pytest.approx(np.sign(speed) * (abs(speed) - 0.5 * slowing), rel=1e-4)


def test_one_sided_friction_holds_what_it_has_stopped() -> None:
    given = laws(("asymmetric_friction", (0.2,), "axis"))
    position, rate = swung(axis(step=1e-3), given, (0.0, 2.0), 3.0)
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
    position, rate = swung(model, laws((law, numbers, "axis")), (0.3, 0.0), 10.0, told=0.2 * share)
    assert abs(position - 0.3) < 1e-9
    assert abs(rate) < 1e-9


@pytest.mark.parametrize("size", [-0.1, 0.0, 0.1])
def test_a_joints_own_friction_holds_with_a_laws(size: float) -> None:
    """Frictionloss and law together bear the load without a creep; without a law frictionloss creeps as MuJoCo's."""
    model = axis('<motor name="m" joint="axis"/>', step=1e-3)
    model.dof_frictionloss[0] = 0.2
    given = laws(("stribeck_friction", (size, 0.5), "axis"))
    position, rate = swung(model, given, (0.3, 0.0), 10.0, told=0.9 * (0.2 + size))
    if size:
        assert abs(position - 0.3) < 1e-9
        return
    alone, its_rate = swung(model, laws(), (0.3, 0.0), 10.0, told=0.18)
    np.testing.assert_allclose((position, rate), (alone, its_rate), rtol=1e-12)
    assert position - 0.3 > 0.03


@pytest.mark.parametrize("soft", [True, False])
@pytest.mark.parametrize("size", [-0.1, 0.1])
def test_skewed_friction_creeps_as_the_joints_own_does(size: float, soft: bool) -> None:
    """Oracle: MuJoCo's, as high as the law makes it in the direction of the load."""
    model = axis('<motor name="m" joint="axis"/>', step=1e-3)
    if not soft:
        model.dof_solimp[0, :2] = 0.9999
    ends = []
    for own, given in ((0.2, laws(("asymmetric_friction", (size,), "axis"))), (0.2 + size, laws())):
        model.dof_frictionloss[0] = own
        ends.append(swung(model, given, (0.3, 0.0), 10.0, told=0.9 * (0.2 + size)))
    np.testing.assert_allclose(ends[0], ends[1], rtol=1e-9)
    assert bool(ends[0][0] - 0.3 > 0.01) is soft


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
    position, _ = swung(model, laws((law, numbers, "axis")), (0.3, 0.0), 1.0, told=0.21)
    assert position - 0.3 > 0.5 * 0.009 / INERTIA * 1.0**2


SOFT_S = 0.95 * 0.02 / 2
"""Time constant of MuJoCo's frictionloss at its defaults: 1 / b with b = 2 / (d_max timeconst)."""


@pytest.mark.parametrize("step", [1e-3, 4e-3])
@pytest.mark.parametrize("start", [-0.6, 0.5])
def test_soft_friction_is_what_mujoco_calls_frictionloss(start: float, step: float) -> None:
    model = axis('<position name="s" joint="axis" kp="4" kv=".4"/>', step=step)
    held, ours = (
        swung(model, laws(("coulomb_friction", (0.2, softness), "axis")), (start, 0.0), 3.0) for softness in (0, SOFT_S)
    )
    model.dof_frictionloss[0] = 0.2
    theirs = swung(model, laws(), (start, 0.0), 3.0)
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
    position, rate = swung(model, given, (0.3, 0.0), 5.0, told=0.2 * share)
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


@pytest.mark.parametrize("at_rest", [0.0, 0.4])
def test_friction_by_load_knows_the_load_of_this_very_moment(at_rest: float) -> None:
    """Of a servo, whose torque changes with the angle, against the formula integrated; higher when slow or not. No
    load, no friction."""
    model = axis('<position name="s" joint="axis" kp="4" kv=".1"/>')

    def formula(t: float, q: Floats, v: Floats) -> Floats:
        servo = 4 * (1.0 - q) - 0.1 * v
        share = 0.2 + at_rest * np.exp(-((v / 1.5) ** 2))
        return np.asarray((servo - share * np.abs(servo) * np.tanh(v / 1e-3)) / INERTIA)

    found = swung(model, laws(("load_dependent_friction", (0.2, at_rest, 1.5), "axis")), (0.0, 0.0), 0.3, told=1.0)
    np.testing.assert_allclose(found, flown(formula, np.zeros(1), np.zeros(1), 0.3, 600), rtol=3e-3)
    assert swung(axis(), laws(("load_dependent_friction", (0.9,), "axis")), (0.0, 3.0), 0.3)[1] == 3.0


@pytest.mark.parametrize("periods", [1.0, 4.0, 7.5, 24.0, 60.0])
def test_cogging_repeats_with_the_angle(periods: float) -> None:
    def formula(t: float, q: Floats, v: Floats) -> Floats:
        once = 0.3 * np.cos(periods * q) - 0.2 * np.sin(periods * q)
        twice = 0.1 * np.cos(2 * periods * q) + 0.15 * np.sin(2 * periods * q)
        return np.asarray((once + twice - 0.1 * np.cos(3 * periods * q) + 0.05 * np.sin(3 * periods * q)) / INERTIA)

    numbers = (0.3, -0.2, periods, 0.1, 0.15, -0.1, 0.05)
    found = swung(axis(), laws(("cogging", numbers, "axis")), (0.2, 5.0), 0.5)
    np.testing.assert_allclose(found, flown(formula, np.array([0.2]), np.array([5.0]), 0.5, 600), rtol=1e-3)
    turned = swung(axis(), laws(("cogging", numbers, "axis")), (0.2 + 2 * np.pi / periods, 5.0), 0.5)
    np.testing.assert_allclose(turned - found, [2 * np.pi / periods, 0], atol=1e-5)
