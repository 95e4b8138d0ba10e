"""Numbers of the scene that nobody listed: planted wrong ones are ranked first, named, said, and come back."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

from compass_ros.calibration.cost import ROBUST, start
from compass_ros.calibration.differences import linearise
from compass_ros.calibration.least_squares import Fit
from compass_ros.cells import Cell
from compass_ros.cells.auto import with_auto
from compass_ros.config import CalibrationConfig
from compass_ros.discovery.candidates import Candidate, candidates
from compass_ros.discovery.first_order import FirstOrder, Ranked
from compass_ros.discovery.neighbours import rank
from compass_ros.discovery.odds import Prior
from compass_ros.discovery.response import respond
from compass_ros.discovery.words import missing
from compass_ros.pipeline import calibrate
from compass_ros.simulation import Simulator
from compass_ros.simulation.effects import Attached, FittedEffect, attach, effect, read_effects, write_effects
from compass_ros.simulation.effects.parameter import deviates
from compass_ros.simulation.export import write_scene
from compass_ros.simulation.sizes import unit_joint
from compass_ros.types import Floats
from test.by_night import but
from test.cells.written import content, parameter, written
from test.discovery.servo import noisy
from test.simulation import robots

SCENE = """<mujoco><option timestep="0.002" integrator="implicitfast"/><worldbody>
  <body name="upper"><joint name="shoulder" axis="0 1 0" damping="0.05" armature="0.01"/>
    <inertial pos="0.01 0 -0.12" mass="0.8" diaginertia="0.006 0.006 0.001"/>
    <body name="lower" pos="0 0 -0.25"><joint name="elbow" axis="0 1 0" damping="0.05" armature="0.01" stiffness="0.5"/>
      <inertial pos="0.01 0 -0.1" mass="0.5" diaginertia="0.003 0.003 0.0006"/></body></body></worldbody>
  <actuator><position name="m1" joint="shoulder" kp="8" kv="0.4"/>
    <position name="m2" joint="elbow" kp="4" kv="0.2"/></actuator></mujoco>"""
JOINTS = {"shoulder": "m1", "elbow": "m2"}
PLANTED = {
    "elbow@dyna@armature": 0.008,
    "lower@dyna@mass": 0.15,
    "lower@dyna@centre_x": 0.02,
    "m2@actuation@servo_gain": 1.0,
    "lower@pose@z": -0.03,
    "shoulder@dyna@armature": -0.008,
    "elbow@dyna@stiffness": -0.3,
}
"""How far off: a rotor, a mass, its place, a gain, the length of a link."""
NAMED = [name for name in PLANTED if name not in ("elbow@dyna@stiffness", "shoulder@dyna@armature")]


def arm(folder: Path) -> Cell:
    """Two joints with servos, of which only the damping is tuned."""
    action = [
        {"name": f"{name}_{of}", "unit": "rad", "low": -1.5, "high": 1.5, "field": field, "of": of}
        for joint, motor in JOINTS.items()
        for name, field, of in (("q", "qpos", joint), ("u", "ctrl", motor))
    ]
    tuned = [parameter(f"{j}@dyna@damping", "dof_damping", j, 0.05, 0.02) | {"bounds": [0.0, 0.5]} for j in JOINTS]
    objects = [{"name": name, "quantity": "joint"} for name in JOINTS]
    return written(folder, SCENE, content(objects, tuned, action=action, noise_m=1e-3, horizon=60))


def law(simulator: Simulator, name: str) -> Attached:
    number = simulator.places.numbers[name].number
    assert number is not None
    return Attached(deviates(number, simulator.places.model), (name,))


def steps(count: int) -> Floats:
    return np.random.default_rng(5).uniform(-1.2, 1.2, (count, 4))


def ranked(
    simulator: Simulator, attached: Attached, numbers: list[float]
) -> tuple[tuple[Candidate, ...], list[Ranked]]:
    """Laws to first order about a simulator that lacks one, with both dampings free."""
    likelihood = robots.recorded(simulator, [attached], numbers, steps(4))
    point, free = start(likelihood, simulator.defaults), np.arange(len(simulator.parameters))
    fit = Fit(point, linearise(likelihood, point, free, np.full(len(free), 1e-3)), free, 1e4 * ROBUST, 0, True)
    response = respond(simulator, likelihood, fit)
    asked = candidates(simulator, simulator.defaults, likelihood.inputs, likelihood.time_s)
    return asked, rank(FirstOrder(response), asked)


@pytest.mark.parametrize("name", PLANTED)
def test_a_wrong_number_is_ranked_first_with_its_size(tmp_path: Path, name: str) -> None:
    """Against all laws and all other numbers, where it is a fiftieth as far off as in the verdicts: first order."""
    simulator, size = Simulator(arm(tmp_path), threads=1), PLANTED[name] / 50
    _, found = ranked(simulator, law(simulator, name), [size])
    best = next(r for r in found if len(r.candidate.parts) == 1)
    assert (best.candidate.name, best.candidate.objects) == ("parameter", (name,))
    assert best.numbers[0] == pytest.approx(size, rel=0.1)


def test_where_a_law_is_true_no_number_is_first(tmp_path: Path) -> None:
    simulator = Simulator(arm(tmp_path), threads=1)
    coulomb = Attached(effect("coulomb_friction").at(unit_joint("hinge")), ("elbow",))
    asked, found = ranked(simulator, coulomb, [0.002, 0.0])
    assert "parameter" in {c.name for c in asked}
    assert (found[0].candidate.name, found[0].candidate.objects) == ("coulomb_friction", ("elbow",))


def test_what_is_listed_is_not_asked_and_what_does_the_same_once(tmp_path: Path) -> None:
    cell = arm(tmp_path)
    time = np.tile(np.linspace(0, 1, 30), (4, 1))
    for one, asked in ((cell, True), (with_auto(cell), False)):
        simulator = Simulator(one, threads=1)
        found = candidates(simulator, simulator.defaults, steps(4), time)
        names = {name for c in found if c.name == "parameter" for name in c.objects}
        assert bool(names) is asked
        assert not any("damping" in name for name in names)
        if asked:
            assert set(PLANTED) <= names
            same, idle = {"upper@dyna@moment_x"}, {"upper@pose@x", "lower@dyna@centre_y"}  # as an armature; nothing
            assert not (same | idle) & names


def test_each_number_is_a_law_of_its_own(tmp_path: Path) -> None:
    """A number is one choice of all numbers; two of them are two laws, and never one on several."""
    simulator = Simulator(arm(tmp_path), threads=1)
    asked, found = ranked(simulator, law(simulator, "lower@dyna@mass"), [0.003])
    prior = Prior.of(asked)
    assert prior.sites["parameter"] == sum(c.name == "parameter" for c in asked)
    assert prior.of_laws(["parameter", "parameter"]) == pytest.approx(2 * prior.of_laws(["parameter"]))
    assert all(len(r.candidate.parts) == 1 for r in found if r.candidate.name == "parameter")


@pytest.mark.parametrize("name", PLANTED)
def test_a_wrong_number_comes_back_from_its_file_and_acts_on_a_plain_model(tmp_path: Path, name: str) -> None:
    simulator = Simulator(arm(tmp_path), threads=1)
    attached, size = law(simulator, name), PLANTED[name]
    write_effects([FittedEffect(attached, (size,), (0.1,))], {}, tmp_path / "effects.yaml")
    given = read_effects(tmp_path / "effects.yaml")
    assert given.effects[0].attached.effect.quantities[0].unit == attached.effect.quantities[0].unit
    write_scene(simulator.cell, simulator.defaults, tmp_path / "written.xml")
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "written.xml"))
    data, inputs = mujoco.MjData(model), steps(1)
    data.qpos[:], data.ctrl[:] = inputs[0, [0, 2]], inputs[0, [1, 3]]
    before = [getattr(model, array).copy() for array in ("body_mass", "body_pos", "dof_armature", "actuator_gainprm")]
    expected = simulator.with_effects([attached]).motion(np.append(simulator.defaults, size)[None], inputs, 0.3)
    plain = simulator.motion(simulator.defaults[None], inputs, 0.3)
    rows = []
    with attach(model, data, given):
        data.qacc_warmstart[:] = 0
        for _ in range(150):
            mujoco.mj_step(model, data)
            rows.append(data.qpos.copy())
    assert (np.array(rows) == expected.positions[0, 1:151]).all()
    assert np.abs(plain.positions[0, 150] - rows[-1]).max() > 1e-3
    for array, value in zip(("body_mass", "body_pos", "dof_armature", "actuator_gainprm"), before, strict=True):
        assert (getattr(model, array) == value).all()
    assert (simulator.motion(simulator.defaults[None], inputs, 0.3).positions == plain.positions).all()


def test_the_sentence_has_the_number_as_it_is_and_as_it_should_be(tmp_path: Path) -> None:
    simulator = Simulator(arm(tmp_path), threads=1)
    armature = law(simulator, "elbow@dyna@armature")
    words = missing([armature], [np.array([0.021])], simulator.places)
    assert words == "the scene's armature of elbow is wrong: 0.031 kg m^2 instead of 0.01"
    beside = replace(effect("coulomb_friction"), on=("hinge",))
    both = missing([Attached(beside, ("elbow",)), armature], [np.array([0.1]), np.array([0.021])], simulator.places)
    assert both == f"the simulator lacks {beside.sentence}, and {words}"


@pytest.mark.slow
@pytest.mark.parametrize("name", but(NAMED, "lower@dyna@mass"))
def test_a_wrong_number_is_named(tmp_path: Path, name: str) -> None:
    cell = arm(tmp_path)
    attached = law(Simulator(cell, threads=1), name)
    truth = [0.06, 0.04, PLANTED[name]]
    episodes = noisy(Simulator(cell, [attached], threads=1), truth, steps(10), 1.0, 5e-4, 5)
    mismatch = calibrate(episodes, cell, CalibrationConfig(threads=1))[0].mismatch
    assert mismatch.verdict == "named", mismatch.sentence
    assert [(e.name, *e.parameters) for e in mismatch.effects] == [("parameter", "deviation")]
    assert mismatch.effects[0].parameters["deviation"].value == pytest.approx(PLANTED[name], rel=0.02)
    assert mismatch.where is not None
    assert (mismatch.where.site_kind, mismatch.where.site) == ("field", name)
    assert mismatch.explanations[0].laws[0].sites == (name,)
