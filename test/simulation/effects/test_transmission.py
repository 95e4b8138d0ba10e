"""Elastic gears and play, whose motors have a state of their own: against two masses on a spring, and by hand."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import mujoco
import numpy as np
import pytest
from scipy.optimize import brentq

from compass_ros.cells import Cell
from compass_ros.cells.rotors import add_rotors
from compass_ros.errors import ConfigError
from compass_ros.simulation import Simulator
from compass_ros.simulation.effects import Attached, effect
from compass_ros.simulation.rotors import carry, onto_rotor
from compass_ros.simulation.sizes import unit_joint
from compass_ros.types import Floats
from test.cells.written import content, parameter, written
from test.simulation.effects.scenes import flown

LINK, ROTOR, KP, KV = 0.04, 0.01, 3.0, 0.3
DRIVES = {
    "position": f'<position name="d" joint="axis" kp="{KP}" kv="{KV}"/>',
    "motor": '<motor name="d" joint="axis"/>',
}
SECONDS, TOLD = 0.6, 0.5
GEAR = (ROTOR, 0.0, 0.0, 0.0, 0.0)
"""Of a gear whose spring is linear: rotor, share, windup, windup_force, hysteresis."""


def geared(folder: Path, drive: str = "position", armature: float = ROTOR, kind: str = "hinge") -> Cell:
    """A joint of inertia 0.04 (and an armature) without weight, its angle and effort measured; it starts at 0.2."""
    scene = f"""<mujoco><option timestep="5e-4" gravity="0 0 0" integrator="implicitfast"/><worldbody><body>
        <joint name="axis" type="{kind}" axis="0 0 1" armature="{armature}"/>
        <inertial pos="0 0 0" mass="{LINK}" diaginertia="{LINK} {LINK} {LINK}"/></body></worldbody>
        <actuator>{DRIVES[drive]}</actuator></mujoco>"""
    ctrl = {"name": "u", "unit": "1", "low": -1.0, "high": 1.0, "field": "ctrl", "of": "d"}
    first = {"name": "q", "unit": "1", "low": -1.0, "high": 1.0, "field": "qpos", "of": "axis"}
    signals = [{"name": "effort", "topic": "/e", "quantity": "joint_effort", "of": ["axis"], "noise": 0.1}]
    damping = parameter("axis@dyna@damping", "dof_damping", "axis", 0.0, 0.001)
    objects = [{"name": "axis", "quantity": "joint"}]
    made = content(objects, [damping], action=[ctrl, first], signals=signals, factors=["axis"])
    return written(folder, scene, made)


def angle(cell: Cell, numbers: Mapping[str, tuple[float, ...]], told: float = TOLD, kind: str = "hinge") -> Floats:
    """(T, 2) angle of the link and effort of the motor, with laws on the joint."""
    laws = [Attached(effect(name).at(unit_joint(kind)), ("axis",)) for name in numbers]  # type: ignore[arg-type]
    simulator = Simulator(cell, laws, threads=1)
    values = np.array([[*simulator.defaults[: len(cell.parameters)], *(n for own in numbers.values() for n in own)]])
    return np.asarray(simulator.motion(values, np.array([[told, 0.2]]), SECONDS).positions[0])


@pytest.mark.parametrize("kind", ["hinge", "slide"])
@pytest.mark.parametrize("drive", DRIVES)
@pytest.mark.parametrize("compliance", [2e-2, 5e-2, 0.2])
def test_an_elastic_joint_is_two_masses_and_a_spring(tmp_path: Path, kind: str, drive: str, compliance: float) -> None:
    stiffness, damping = 1 / compliance, 0.1 * np.sqrt(ROTOR / compliance)

    def formula(t: float, q: Floats, v: Floats) -> Floats:
        torque = stiffness * (q[1] - q[0]) + damping * (v[1] - v[0])
        drive_torque = KP * (TOLD - q[1]) - KV * v[1] if drive == "position" else TOLD
        return np.array([torque / LINK, (drive_torque - torque) / ROTOR])

    seen = angle(geared(tmp_path, drive, kind=kind), {"joint_elasticity": (compliance, *GEAR)}, kind=kind)
    expected = flown(formula, np.array([0.2, 0.2]), np.zeros(2), SECONDS, 2000)[0]
    rigid = angle(geared(tmp_path, drive, kind=kind), {}, kind=kind)
    assert np.abs(seen[:, 0] - rigid[:, 0]).max() > 2e-3
    assert seen[-1, 0] == pytest.approx(expected, abs=2e-3 * abs(expected) + 5e-4)


@pytest.mark.parametrize(
    ("windup", "force", "loss"), [(0.5, 0.2, 0.0), (0.95, 0.1, 0.0), (0.0, 0.0, 0.1), (0.8, 0.3, 0.05)]
)
def test_a_gear_is_soft_at_first_and_loses_what_friction_within_it_does(
    tmp_path: Path, windup: float, force: float, loss: float
) -> None:
    compliance = 0.2
    damping = 0.1 * np.sqrt(ROTOR / compliance)

    def formula(t: float, q: Floats, v: Floats) -> Floats:
        spring, rate = (q[1] - q[0]) / compliance, v[1] - v[0]
        torque = spring + damping * rate + loss * np.tanh(rate / 0.01)
        if windup:
            torque -= windup * force * np.tanh(spring / force)
        return np.array([torque / LINK, (TOLD - torque) / ROTOR])

    seen = angle(geared(tmp_path, "motor"), {"joint_elasticity": (compliance, ROTOR, 0.0, windup, force, loss)})[-1, 0]
    expected = flown(formula, np.array([0.2, 0.2]), np.zeros(2), SECONDS, 2000)[0]
    assert seen == pytest.approx(expected, abs=2e-3 * abs(expected) + 5e-4)


def test_a_stiff_gear_is_a_rigid_one(tmp_path: Path) -> None:
    cell = geared(tmp_path)
    rigid = angle(cell, {})
    for name, numbers in (("joint_elasticity", (1e-5, *GEAR)), ("backlash", (1e-7, ROTOR, 0.0))):
        assert np.abs(angle(cell, {name: numbers})[:, 0] - rigid[:, 0]).max() < 3e-3


@pytest.mark.parametrize("play", [0.02, 0.1, 0.2])
def test_a_motor_moves_half_its_play_before_the_joint_follows(tmp_path: Path, play: float) -> None:
    """Alone at first: theta = 0.2 + torque t^2 / (2 rotor); then both, within the play of each other."""
    seen = angle(geared(tmp_path, "motor"), {"backlash": (play, ROTOR, 0.0)})[:, 0]
    still = np.sqrt(play * ROTOR / TOLD)
    time = 5e-4 * np.arange(len(seen))
    assert (seen[time < 0.97 * still] == 0.2).all()
    assert (seen[time > 1.03 * still + 2e-3] > 0.2).all()
    met = time > still
    whole = LINK + ROTOR  # they meet inelastically: momentum and torque are those of both together
    momentum = TOLD * still + TOLD * (time[met] - still)
    expected = 0.2 + np.cumsum(momentum / whole) * 5e-4
    np.testing.assert_allclose(seen[met], expected, atol=play * 0.15 + 3e-3)


def test_within_its_play_a_servo_does_not_hold_its_joint(tmp_path: Path) -> None:
    """Told where it stands, the motor stays; a push on the joint moves it through half the play and no further."""
    cell = geared(tmp_path)
    simulator = Simulator(cell, [Attached(effect("backlash").at(unit_joint("hinge")), ("axis",))], threads=1)
    values = np.array([[0.0, 0.1, ROTOR, 0.0]])
    physics = simulator.physics
    model = simulator._player.written(physics, values)[0]
    data = mujoco.MjData(model)
    data.qpos[:], data.ctrl[0] = 0.2, 0.2
    data.qfrc_applied[0] = 0.03
    mujoco.mj_step(model, data, nstep=4000)
    assert data.qpos[0] - data.qpos[1] == pytest.approx(0.05, abs=2e-3)
    assert data.qpos[1] - 0.2 == pytest.approx(0.03 / KP, rel=0.05)


@pytest.mark.parametrize("share", [0.0, 0.3, 1.0])
def test_friction_is_shared_with_the_motor(tmp_path: Path, share: float) -> None:
    """By hand: each side loses its part, and the spring is between them."""
    compliance, lost = 5e-2, 0.4

    def formula(t: float, q: Floats, v: Floats) -> Floats:
        torque = (q[1] - q[0]) / compliance + 0.1 * np.sqrt(ROTOR / compliance) * (v[1] - v[0])
        on_link = torque - (1 - share) * lost * v[0]
        return np.array([on_link / LINK, (TOLD - torque - share * lost * v[1]) / ROTOR])

    cell = geared(tmp_path, "motor")
    law = Attached(effect("joint_elasticity").at(unit_joint("hinge")), ("axis",))
    values = np.array([[lost, compliance, ROTOR, share, 0.0, 0.0, 0.0]])
    seen = Simulator(cell, [law], threads=1).motion(values, np.array([[TOLD, 0.2]]), SECONDS).positions[0, -1, 0]
    expected = flown(formula, np.array([0.2, 0.2]), np.zeros(2), SECONDS, 2000)[0]
    assert seen == pytest.approx(expected, abs=2e-3 * abs(expected) + 5e-4)


def test_a_motor_that_sticks_holds_its_joint_within_the_play(tmp_path: Path) -> None:
    """With dry friction on the motor's side alone a push moves the joint through half the play; beyond it creeps."""
    simulator = Simulator(
        geared(tmp_path, "motor"), [Attached(effect("backlash").at(unit_joint("hinge")), ("axis",))], threads=1
    )
    model = simulator._player.written(simulator.physics, np.array([[0.0, 0.1, ROTOR, 0.0]]))[0]
    moved = []
    for share in (0.0, 1.0):
        model.dof_frictionloss[:] = 3.0, 0.0
        onto_rotor(model, "axis", ROTOR, share)
        data = mujoco.MjData(model)
        data.qfrc_applied[0] = 0.1
        mujoco.mj_step(model, data, nstep=800)
        moved.append(float(data.qpos[0]))
    assert abs(moved[0]) < 0.01
    assert moved[1] == pytest.approx(0.05, abs=0.01)


@pytest.mark.parametrize("name", ["joint_elasticity", "backlash"])
def test_the_measured_effort_is_the_motors(tmp_path: Path, name: str) -> None:
    numbers = (0.05, *GEAR) if name == "joint_elasticity" else (0.05, ROTOR, 0.0)
    seen = angle(geared(tmp_path, "motor"), {name: numbers})
    np.testing.assert_allclose(seen[5:, 1], TOLD)


@pytest.mark.parametrize("armature", [0.0, 0.3 * ROTOR, ROTOR, 3 * ROTOR])
def test_the_rotor_is_a_part_of_the_armature(tmp_path: Path, armature: float) -> None:
    """So that a stiff gear moves what was moved before, unless the drawing had none.

    But for the inertia that damping between two trees of bodies is to an implicit integrator: 2 x 5 % of the rotor.
    """
    seen = angle(geared(tmp_path, "motor", armature), {"joint_elasticity": (1e-4, *GEAR)})[-1, 0]
    inertia = LINK + (armature or ROTOR)
    assert seen == pytest.approx(0.2 + 0.5 * TOLD / inertia * SECONDS**2, rel=0.1 * ROTOR / inertia + 1e-3)


def test_play_beside_an_elasticity_is_a_spring_with_a_dead_band(tmp_path: Path) -> None:
    """In either order."""
    numbers = {"joint_elasticity": (0.05, *GEAR), "backlash": (0.1, ROTOR, 0.0)}
    cell = geared(tmp_path)
    both = angle(cell, numbers)
    np.testing.assert_array_equal(both, angle(cell, dict(reversed(numbers.items()))))
    assert np.abs(both - angle(cell, {"joint_elasticity": (0.05, *GEAR)}))[:, 0].max() > 5e-3


@pytest.mark.parametrize("friction", [0.0, 0.5, 20.0])
def test_an_arm_that_rests_begins_with_its_gear_loaded(tmp_path: Path, friction: float) -> None:
    """A servo holds an arm that weighs 2 N m on a gear: it stays where it was measured, but for what the motor sinks.

    With dry friction on the joint's side, play is at the flank below the arm, or in between where friction holds it.
    """
    weight, compliance, play = 2.0, 0.02, 0.1
    scene = f"""<mujoco><option timestep="5e-4" gravity="0 0 -{weight}" integrator="implicitfast"/><worldbody><body>
        <joint name="axis" type="slide" axis="0 0 1" armature="{ROTOR}" frictionloss="{friction}"/>
        <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body></worldbody>
        <actuator><position name="d" joint="axis" kp="1e4" kv="100"/></actuator></mujoco>"""
    ctrl = {"name": "u", "unit": "m", "low": -1.0, "high": 1.0, "field": "ctrl", "of": "d"}
    first = {"name": "q", "unit": "m", "low": -1.0, "high": 1.0, "field": "qpos", "of": "axis"}
    objects = [{"name": "axis", "quantity": "joint"}]
    damping = parameter("axis@dyna@damping", "dof_damping", "axis", 0.0, 0.001)
    cell = written(tmp_path, scene, content(objects, [damping], action=[ctrl, first], factors=["axis"]))
    flank = 0.5 * play * min(weight / (friction or 1e-9), 1)
    windup, force = 0.7, 1.5
    spring = float(brentq(lambda s: s - windup * force * np.tanh(s / force) - weight, 0, 9))
    for numbers, twist in (
        ({"joint_elasticity": (compliance, *GEAR)}, weight * compliance),
        ({"joint_elasticity": (compliance, ROTOR, 0.0, windup, force, 0.0)}, spring * compliance),
        ({"backlash": (play, ROTOR, 0.0)}, flank),
    ):
        seen = angle(cell, numbers, told=0.2 + twist, kind="slide")[:, 0]
        assert np.abs(seen - 0.2).max() < 1.5e-3


@pytest.mark.parametrize(("actuator", "twist"), [("", 0.0), ('<actuator><motor joint="axis"/></actuator>', 0.04)])
def test_a_gear_without_a_motor_begins_unloaded(actuator: str, twist: float) -> None:
    """Of a link that hangs at 2 N m, its motor bears that; what held it before it was let go, a hand, held the link."""
    spec = mujoco.MjSpec.from_string(
        '<mujoco><option gravity="0 0 -2"/><worldbody><body><joint name="axis" axis="0 1 0" armature="0.1"/>'
        f'<inertial pos="1 0 0" mass="1" diaginertia="1 1 1"/></body></worldbody>{actuator}</mujoco>'
    )
    add_rotors(spec, ["axis"])
    model = spec.compile()
    tendon, _ = onto_rotor(model, "axis", 0.1, 1.0)
    model.tendon_stiffness[tendon] = 50.0
    data = mujoco.MjData(model)
    carry(model, data)
    assert abs(data.qpos[1] - data.qpos[0]) == pytest.approx(twist, abs=1e-12)


def test_a_joint_that_nothing_drives_has_no_gear(tmp_path: Path) -> None:
    scene = '<mujoco><worldbody><body><joint name="axis"/><geom size=".1"/></body></worldbody></mujoco>'
    simulator = Simulator(written(tmp_path, scene, content([{"name": "axis", "quantity": "joint"}])), threads=1)
    with pytest.raises(ConfigError, match="'backlash' cannot act on 'axis': nothing drives it"):
        simulator.with_effects([Attached(effect("backlash"), ("axis",))])


def test_costs_are_counted_together_and_the_plain_scene_comes_back(tmp_path: Path) -> None:
    plain = Simulator(geared(tmp_path), threads=1, options={"timestep": 2.5e-4})
    wider = plain.with_effects([Attached(effect("backlash").at(unit_joint("hinge")), ("axis",))])
    told = np.array([[TOLD, 0.2]])
    first = plain.motion(plain.defaults[None], told, 0.1).positions
    wider.motion(np.array([[0.0, 0.1, ROTOR, 0.0]]), told, 0.1)
    again = wider.with_effects([])
    assert (again.motion(plain.defaults[None], told, 0.1).positions == first).all()
    assert plain.rollouts == wider.rollouts == again.rollouts == 3
    assert wider.time_step == again.time_step == 2.5e-4
    assert again.cell == plain.cell
