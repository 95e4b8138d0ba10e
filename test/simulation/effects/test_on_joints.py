"""Laws on joints: the size that first order finds is the one that was planted, in any units; told by closed motions."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

from compass_ros.discovery.candidates import candidates
from compass_ros.discovery.first_order import FirstOrder
from compass_ros.simulation import Simulator
from compass_ros.simulation.effects import Attached, Exported, FittedEffect, attach, effect, read_effects, write_effects
from compass_ros.simulation.site_kinds import SiteKind
from compass_ros.simulation.sizes import JointSize, unit_joint
from compass_ros.simulation.visited import Visited
from compass_ros.types import Floats
from test.by_night import but
from test.simulation.robots import recorded, response_of, robot, shots

LAWS = ("coulomb_friction", "viscous_drag", "quadratic_drag", "stribeck_friction", "spring")
UNITS = [(1.0, 1.0), (1024.0, 1.0), (1 / 1024, 1.0), (1.0, 1024.0), (1 / 4096, 1 / 64)]
"""Sizes of a unit of force and of length: N m in kN m and mN m, m in mm, a robot of a watchmaker."""


def told(simulator: Simulator, inputs: Floats) -> tuple[Floats, Floats, Floats]:
    return simulator.defaults, inputs, np.tile(np.linspace(0, 1.0, 60), (len(inputs), 1))


def first_order(folder: Path, kind: str, law: str, force: float, length: float, gravity: bool) -> tuple[float, float]:
    """What first order finds of what was planted, as a share of it, and what it gains.

    With a time step so short that it does nothing like it: beside a long one a law gains less.
    """
    cell = robot(folder, (kind,), (), force, length, gravity, step_ms=0.25)
    simulator, inputs = Simulator(cell, threads=1), shots(cell, 4, length=length if kind == "slide" else 1.0)
    (asked,) = [c for c in candidates(simulator, *told(simulator, inputs)) if c.name == law]
    planted = [0.3 * q.scale if q.amplitude else q.start for q in asked.attached.effect.quantities]
    response = response_of(simulator, recorded(simulator, [asked.attached], planted, inputs))
    found = FirstOrder(response).ranked(asked)[0]
    return float(found.numbers[0] / planted[0]), found.gain


@pytest.mark.parametrize("gravity", [True, False], ids=["gravity", "weightless"])
@pytest.mark.parametrize("kind", ["hinge", "slide"])
@pytest.mark.parametrize("law", ["coulomb_friction", "viscous_drag", "quadratic_drag", "spring"])
def test_first_order_finds_the_size_that_was_planted(tmp_path: Path, kind: str, law: str, gravity: bool) -> None:
    share, gain = first_order(tmp_path, kind, law, 1.0, 1.0, gravity)
    assert share == pytest.approx(1, abs=0.03)
    assert gain > 40


@pytest.mark.parametrize("kind", ["hinge", "slide"])
@pytest.mark.parametrize("law", but(LAWS, "coulomb_friction", "spring"))
def test_units_change_nothing(tmp_path: Path, kind: str, law: str) -> None:
    found = [first_order(tmp_path, kind, law, force, length, True) for force, length in UNITS]
    share, gain = np.array(found).T
    np.testing.assert_allclose(share, share[0], rtol=5e-3)
    np.testing.assert_allclose(gain, gain[0], rtol=5e-3)


@pytest.mark.parametrize(("force", "length"), UNITS)
def test_sizes_of_a_joint_are_in_its_own_units(tmp_path: Path, force: float, length: float) -> None:
    joints = ("hinge", "slide", "hinge")
    plain, other = robot(tmp_path, joints), None
    before = Simulator(plain, threads=1)
    inputs = shots(plain, 3)
    expected = Visited(before, *told(before, inputs)).joint_sizes()
    other = robot(tmp_path, joints, (), force, length)
    simulator = Simulator(other, threads=1)
    units = [length if a.name[0] != "u" and joints[int(a.name[1:])] == "slide" else 1.0 for a in other.action]
    found = Visited(simulator, *told(simulator, inputs * units)).joint_sizes()
    for name, kind in zip(("j0", "j1", "j2"), joints, strict=True):
        of_force, of_length = (force * length, 1.0) if kind == "hinge" else (force, length)
        one, two = expected[name], found[name]
        assert (two.kind, two.length_unit) == (kind, "rad" if kind == "hinge" else "m")
        numbers = (two.inertia, two.speed, two.fastest, two.spread, two.force)
        of_unit = (of_force / of_length, of_length, of_length, of_length, of_force)
        told_there = (one.inertia, one.speed, one.fastest, one.spread, one.force)
        np.testing.assert_allclose(np.array(numbers) / of_unit, told_there, rtol=0.02)


@pytest.mark.parametrize(
    ("joints", "drives", "expected"),
    [
        (("hinge",), (), 0.4 * 0.1**2 + 0.4 * 0.02**2 + 4e-3),
        (("slide",), (), 0.4),
        (("slide", "slide"), (), 0.8),
    ],
)
def test_the_inertia_is_the_joints_own(
    tmp_path: Path, joints: tuple[str, ...], drives: tuple[str, ...], expected: float
) -> None:
    cell = robot(tmp_path, joints, drives)
    simulator = Simulator(cell, threads=1)
    assert Visited(simulator, *told(simulator, shots(cell, 2))).joint_sizes()["j0"].inertia == pytest.approx(expected)


@pytest.mark.parametrize("gravity", [True, False])
@pytest.mark.parametrize("drive", ["", "position", "motor"])
def test_the_force_of_a_joint_that_is_held_is_what_holds_it(tmp_path: Path, drive: str, gravity: bool) -> None:
    """A still arm's own motion says nothing of its forces; a joint that never moves has sizes too, and finite ones."""
    cell = robot(tmp_path, ("hinge",), (drive,) if drive else (), gravity=gravity)
    simulator = Simulator(cell, threads=1)
    size = Visited(simulator, *told(simulator, np.zeros((2, len(cell.input_names))))).joint_sizes()["j0"]
    assert all(np.isfinite(x) and x > 0 for x in (size.inertia, size.speed, size.fastest, size.spread, size.force))
    weight = 0.4 * 9.81 * 0.02 if gravity else 0.0
    assert size.force >= 0.4 * weight


@pytest.mark.parametrize(("speed", "step"), [(1.0, 1e-3), (1000.0, 1e-3), (1e-3, 1e-3), (1.0, 1e-2), (1.0, 1e-4)])
def test_friction_on_a_joint_stops_it_and_holds_it(speed: float, step: float) -> None:
    """After speed / deceleration, in any unit and with any time step, without a jerk back."""
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><option timestep="{step}" gravity="0 0 0"/><worldbody><body><joint name="rail" type="slide"/>'
        '<geom size=".1" mass="2"/></body></worldbody></mujoco>'
    )
    data = mujoco.MjData(model)
    data.qvel[0] = speed
    friction = Attached(effect("coulomb_friction").at(unit_joint("slide")), ("rail",))
    slowest = []
    with attach(model, data, Exported((FittedEffect(friction, (2.0 * speed / 0.5,), ()),), {})):
        while data.time < 0.9 - 0.5 * step:
            mujoco.mj_step(model, data)
            slowest.append(data.qvel[0])
    assert data.qpos[0] == pytest.approx(0.5 * speed * 0.5, rel=0.03)
    assert min(slowest) > -1e-3 * speed
    assert abs(slowest[-1]) < 1e-3 * speed


def test_a_spring_swings_with_its_frequency() -> None:
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><option timestep="1e-4" gravity="0 0 0"/><worldbody><body><joint name="axis" type="hinge"/>'
        '<inertial pos="0 0 0" mass="1" diaginertia="1 1 0.25"/></body></worldbody></mujoco>'
    )
    data = mujoco.MjData(model)
    spring = Attached(effect("spring").at(unit_joint("hinge")), ("axis",))
    with attach(model, data, Exported((FittedEffect(spring, (4.0, 0.3, 0.0, 0.0), ()),), {})):
        mujoco.mj_step(model, data, nstep=round(np.pi / 4.0 / 1e-4))
    assert data.qpos[0] == pytest.approx(0.6, rel=1e-3)  # half a period of 2 pi / sqrt(4 / 0.25)


@pytest.mark.parametrize(
    ("rest", "out", "free"), [(0.0, 0.1, 0.0), (0.7, 0.1, 0.0), (-2.0, 0.1, 0.0), (0.4, 0.01, 0.1)]
)
def test_a_spring_on_levers_is_one_between_two_points(rest: float, out: float, free: float) -> None:
    """MuJoCo's own: a tendon from 0.2 m beside the axis to a point of the link; with a free length to first order in
    a b / l^2, l^2 = a^2 + b^2: f / l (1 + a b cos(x) / l^2) of the pull is missing."""
    of = (
        '<mujoco><option timestep="1e-4" gravity="0 0 0"/><worldbody>{anchor}<body><joint name="axis" axis="0 0 1"/>'
        '<inertial pos="0 0 0" mass="1" diaginertia="1 1 0.25"/><site name="out" pos="{out} 0 0"/></body></worldbody>'
        "{rest}</mujoco>"
    )
    anchor = f'<site name="fixed" pos="{0.2 * np.cos(rest)} {0.2 * np.sin(rest)} 0"/>'
    tendon = (
        f'<tendon><spatial stiffness="{20 / out}" springlength="{free}"><site site="fixed"/><site site="out"/>'
        "</spatial></tendon>"
    )
    product, length = 0.2 * out, np.hypot(0.2, out)
    of_free = free / length
    slack = of_free * product / length**2 / (1 - of_free)
    drawn = mujoco.MjModel.from_xml_string(of.format(anchor=anchor, rest=tendon, out=out))
    bare = mujoco.MjModel.from_xml_string(of.format(anchor="", rest="", out=out))
    expected, data = mujoco.MjData(drawn), mujoco.MjData(bare)
    spring = Attached(effect("spring").at(unit_joint("hinge")), ("axis",))
    numbers = (20 / out * product * (1 - of_free), rest, 1.0, slack)
    with attach(bare, data, Exported((FittedEffect(spring, numbers, ()),), {})):
        for it, model in ((expected, drawn), (data, bare)):
            it.qpos[0] = rest + 2.0
            mujoco.mj_step(model, it, nstep=5000)
    assert abs(expected.qpos[0] - rest - 2.0) > 0.3
    assert data.qpos[0] == pytest.approx(expected.qpos[0], abs=1e-6 if free == 0 else 2e-3)


def test_a_file_of_before_springs_had_levers_still_reads(tmp_path: Path) -> None:
    numbers = "{stiffness: {value: 3.0, unit: N m/rad}, rest: {value: 0.1, unit: rad}}"
    file = tmp_path / "effects.yaml"
    file.write_text(f"effects: [{{name: spring, objects: [it], 'on': hinge, values: {numbers}}}]\nsliding: {{}}\n")
    (back,) = read_effects(file).effects
    assert back.values == (3.0, 0.1, 0.0, 0.0)


@pytest.mark.parametrize("kind", ["hinge", "slide"])
@pytest.mark.parametrize("law", LAWS)
def test_a_law_on_a_joint_comes_back_from_its_file_with_kind_and_units(
    tmp_path: Path, law: str, kind: SiteKind
) -> None:
    size = JointSize(kind, 0.5, 2.0, 5.0, 0.1, 1.0, 3.0, 1.0)
    sized = effect(law).at(size)
    values = tuple(0.5 * q.high for q in sized.quantities)
    write_effects([FittedEffect(Attached(sized, ("it",)), values, values)], {}, tmp_path / "effects.yaml")
    (back,) = read_effects(tmp_path / "effects.yaml").effects
    assert (back.values, back.attached.objects, back.attached.effect.on) == (values, ("it",), (kind,))
    assert [q.unit for q in back.attached.effect.quantities] == [q.unit for q in sized.quantities]
    assert all(q.low <= q.start <= q.high and 0 < q.scale <= q.high - q.low for q in sized.quantities)
