"""What a push at a moment does, by chained transitions: beside the rollout that is really pushed."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import mujoco
import numpy as np
import pytest

from compass_ros.simulation import Simulator
from compass_ros.simulation.kicks import Kicks, inertias, kicks
from compass_ros.simulation.transitions import SMALL, Chart, changes
from compass_ros.types import Floats
from test.simulation import robots
from test.simulation.table import simulator as table

SHOT = np.array([[-0.206, -0.08, 0.163, 0.385]])
COUNT = 12


def pushed(
    simulator: Simulator, known: Kicks, inputs: Floats, time_s: Floats, case: tuple[int, int], by: float
) -> Floats:
    """(E, F, C) change of what is observed per unit, from rollouts that begin at the moment with another velocity."""
    moment, dof = case
    values = np.tile(simulator.defaults, (len(inputs), 1))
    _, _, controls, steps = simulator.begun(values, inputs, simulator.physics.duration(values, inputs, time_s))
    first = round(known.moments_s[moment] / simulator.time_step)
    model = simulator.physics.model
    ends = []
    for sign in (1.0, -1.0):
        start = known.states[:, moment].copy()
        start[:, 1 + model.nq + dof] += sign * by
        driven = None if controls is None else np.ascontiguousarray(controls[:, first:])
        states, _ = simulator.play(values, start, driven, steps - first)
        states = np.concatenate([start[:, None], states], axis=1)
        ends.append(states[..., 1 + simulator.physics.dynamics.columns()])
    change = (ends[0] - ends[1]) / (2 * by)
    at = np.clip(np.round(time_s / simulator.time_step).astype(int) - first, 0, steps - first)
    out = np.take_along_axis(change, at[:, :, None], axis=1)
    return np.where((time_s >= known.moments_s[moment])[:, :, None], out, 0.0)


@pytest.mark.parametrize(
    ("joints", "drives"),
    [
        (("hinge",), ()),
        (("hinge", "hinge"), ()),
        (("hinge", "slide"), ("motor", "motor")),
        (("hinge", "hinge"), ("position", "position")),
        (("hinge", "hinge", "slide"), ("intvelocity", "muscle", "general")),
    ],
)
def test_of_robots(tmp_path: Path, joints: Sequence[str], drives: Sequence[str]) -> None:
    cell = robots.robot(tmp_path, joints, drives)
    simulator = Simulator(cell, threads=1)
    inputs = robots.shots(cell, 2)
    time_s = np.tile(np.arange(0, cell.duration, 0.02), (2, 1))
    known = kicks(simulator, simulator.defaults, inputs, time_s, COUNT)
    assert known.response.shape == (2, time_s.shape[1], len(joints), COUNT, len(joints))
    for case in ((0, 0), (COUNT // 2, len(joints) - 1)):
        expected = pushed(simulator, known, inputs, time_s, case, 1e-4)
        found = known.response[:, :, :, case[0], case[1]]
        assert found == pytest.approx(expected, abs=2e-3 * np.abs(expected).max())


def test_of_pucks_that_collide() -> None:
    simulator = table()
    time_s = np.arange(0, 1.5, 0.02)[None]
    known = kicks(simulator, simulator.defaults, SHOT, time_s, COUNT)
    model = simulator.physics.model
    for name in ("puck1_x", "puck2_y"):
        dof = int(model.joint(name).dofadr[0])
        expected = pushed(simulator, known, SHOT, time_s, (2, dof), 1e-4)
        found = known.response[:, :, :, 2, dof]
        assert found == pytest.approx(expected, abs=0.02 * np.abs(expected).max())


def test_nothing_is_moved_before_a_push(tmp_path: Path) -> None:
    cell = robots.robot(tmp_path, ("hinge", "hinge"))
    simulator = Simulator(cell, threads=1)
    time_s = np.arange(0, cell.duration, 0.02)[None]
    known = kicks(simulator, simulator.defaults, robots.shots(cell, 1), time_s, COUNT)
    for k, moment in enumerate(known.moments_s):
        assert not known.response[0, time_s[0] < moment - simulator.time_step, :, k].any()


def test_the_same_bits_on_any_number_of_threads(tmp_path: Path) -> None:
    cell = robots.robot(tmp_path, ("hinge", "slide"), ("position",))
    time_s = np.tile(np.arange(0, cell.duration, 0.05), (3, 1))
    one, two = (
        kicks(s, s.defaults, robots.shots(cell, 3), time_s, COUNT).response
        for s in (Simulator(cell, threads=n) for n in (1, 2))
    )
    assert np.array_equal(one, two)


FREE = """<mujoco><worldbody><body pos="0 0 1"><freejoint/><geom type="box" size=".1 .2 .3"/></body>
<body><joint type="ball"/><geom type="box" size=".1 .2 .3" pos=".1 0 0"/><body><joint axis="0 1 0"/>
<geom size=".1" pos="0 0 .2"/></body></body></worldbody></mujoco>"""


def test_tangent_numbers_are_those_of_mujoco() -> None:
    """Against mj_integratePos and mj_differentiatePos, of free bodies, balls and hinges."""
    model = mujoco.MjModel.from_xml_string(FREE)
    chart, rng = Chart.of(model), np.random.default_rng(0)
    state = np.zeros(1 + model.nq + model.nv + model.na)
    qpos = model.qpos0.copy()
    mujoco.mj_integratePos(model, qpos, rng.normal(size=model.nv), 1.0)
    state[1 : 1 + model.nq] = qpos
    for number in range(model.nv):
        moved = chart.moved(state[None], number, 1e-5)[0]
        expected, way = qpos.copy(), np.zeros(model.nv)
        way[number] = 1.0
        mujoco.mj_integratePos(model, expected, way, 1e-5)
        assert moved[1 : 1 + model.nq] == pytest.approx(expected, abs=1e-10)
        found = np.zeros(model.nv)
        mujoco.mj_differentiatePos(model, found, 1.0, qpos, moved[1 : 1 + model.nq])
        assert chart.apart(state[None], moved[None])[0, : model.nv] == pytest.approx(found, abs=1e-9)


def test_inertias_are_those_of_mujoco(tmp_path: Path) -> None:
    cell = robots.robot(tmp_path, ("hinge", "hinge"))
    simulator = Simulator(cell, threads=1)
    time_s = np.arange(0, cell.duration, 0.02)[None]
    known = kicks(simulator, simulator.defaults, robots.shots(cell, 1), time_s, COUNT)
    found = inertias(simulator, simulator.defaults, known.states)
    model = simulator.physics.model
    data, full = mujoco.MjData(model), np.zeros((model.nv, model.nv))
    data.qpos[:] = known.states[0, 5, 1 : 1 + model.nq]
    mujoco.mj_forward(model, data)
    for column in range(model.nv):
        mujoco.mj_mulM(model, data, full[column], np.eye(model.nv)[column])
    assert found[0, 5] == pytest.approx(full, abs=1e-12)


def test_what_stands_still_is_moved_as_the_others_are(tmp_path: Path) -> None:
    cell = robots.robot(tmp_path, ("hinge", "hinge"))
    chart = Chart.of(Simulator(cell, threads=1).physics.model)
    states = np.zeros((1, 100, 1 + 4))
    states[0, :, 3] = 2.0
    sizes = changes(chart, states, np.array([0, 50, 100]), 0.001)
    assert sizes[2] == pytest.approx(2 * SMALL)
    assert sizes[3] == pytest.approx(0.2 * SMALL)
