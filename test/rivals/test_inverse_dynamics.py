"""Regression on inverse dynamics finds planted numbers of bodies and joints, and nothing that no torque tells."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

from compass_ros.rivals.inertias import moments_of, nearest_body, numbers, regressor
from compass_ros.rivals.inverse_dynamics import Log, Regressed, as_cell, regress, values
from compass_ros.simulation import Simulator
from test.planning.scenes import arm

BARE = """<mujoco model="bare"><compiler angle="radian"/><option timestep="0.001"/><worldbody>
<body name="upper"><joint name="shoulder" axis="0 1 0" damping="{0}" frictionloss="{1}" armature="{2}"/>
<inertial pos="0.15 0.02 0" mass="{3}" fullinertia="0.02 0.03 0.025 0.001 0.002 0"/>
<body name="lower" pos="0.3 0 0"><joint name="elbow" axis="{4}" damping="0.2" frictionloss="0.1" armature="0.01"/>
<inertial pos="{5} 0 0.03" mass="0.7" fullinertia="0.01 0.012 0.008 0 0.001 0"/></body></body>
</worldbody></mujoco>"""
DRAWN = (0.3, 0.2, 0.02, 1.2, "0 1 0", 0.12)
TRUTHS = {
    "friction": (0.6, 0.5, 0.02, 1.2, "0 1 0", 0.12),
    "armature": (0.3, 0.2, 0.06, 1.2, "0 1 0", 0.12),
    "centre": (0.3, 0.2, 0.02, 1.2, "0 1 0", 0.16),
    "nothing": DRAWN,
    "crossed axes": (0.5, 0.3, 0.03, 1.2, "1 0 0", 0.15),
}


def scene(truth: tuple[object, ...]) -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(BARE.format(*truth))


def log(model: mujoco.MjModel, seed: int, noise: float = 0.0) -> Log:
    """Ten seconds of sines with the torques that they need, from inverse dynamics and the friction in a formula."""
    rng = np.random.default_rng(seed)
    time = np.arange(0, 10, 0.005)
    frequency, phase = rng.uniform(0.1, 0.8, (3, 2)), rng.uniform(0, 6.28, (3, 2))
    turn = 2 * np.pi * frequency * time[:, None, None] + phase
    q, qd = 0.5 * np.sin(turn).sum(axis=1), 0.5 * (2 * np.pi * frequency * np.cos(turn)).sum(axis=1)
    qdd = -0.5 * ((2 * np.pi * frequency) ** 2 * np.sin(turn)).sum(axis=1)
    data, tau = mujoco.MjData(model), np.empty_like(q)
    loss = model.dof_frictionloss.copy()
    model.dof_frictionloss[:] = 0
    for f in range(len(time)):
        data.qpos[:], data.qvel[:], data.qacc[:] = q[f], qd[f], qdd[f]
        mujoco.mj_inverse(model, data)
        tau[f] = data.qfrc_inverse
    model.dof_frictionloss[:] = loss
    return Log(time, q + noise * rng.normal(size=q.shape), tau + loss * np.sign(qd))


def predicted(model: mujoco.MjModel, found: Regressed, like: Log) -> float:
    """rms of the torques that found bodies and joints ask for, beside those of another log."""
    step = like.time_s[1] - like.time_s[0]
    speed = np.gradient(like.position, step, axis=0)
    rate = np.gradient(speed, step, axis=0)
    columns = regressor(model, found.bodies, np.arange(2), like.position[5:-5:20], speed[5:-5:20], rate[5:-5:20])
    bodies = columns @ np.concatenate([numbers(s) for s in found.second])
    tau = (
        bodies
        + found.coulomb * np.sign(speed[5:-5:20])
        + found.viscous * speed[5:-5:20]
        + found.armature * rate[5:-5:20]
        + found.offset
    )
    return float(np.sqrt(np.mean((tau - like.effort[5:-5:20]) ** 2)))


@pytest.mark.parametrize("name", TRUTHS)
def test_planted_numbers_are_found(name: str) -> None:
    truth = scene(TRUTHS[name])
    drawn = scene((*DRAWN[:4], TRUTHS[name][4], DRAWN[5]))
    found = regress(drawn, ("shoulder", "elbow"), [log(truth, 1), log(truth, 2)], 10.0)
    np.testing.assert_allclose(found.coulomb, truth.dof_frictionloss, atol=0.02)
    np.testing.assert_allclose(found.viscous, truth.dof_damping, atol=0.03)
    other = log(truth, 3)
    assert predicted(drawn, found, other) < 0.06 * np.std(other.effort)
    assert found.told < 10 * 2 + 8, "not all numbers of two bodies show"


def test_the_regressor_is_mujocos_own_dynamics() -> None:
    model = scene(TRUTHS["crossed axes"])
    model.dof_frictionloss[:] = model.dof_damping[:] = model.dof_armature[:] = 0
    one = log(model, 4)
    step = one.time_s[1] - one.time_s[0]
    qd = np.gradient(one.position, step, axis=0)
    qdd = np.gradient(qd, step, axis=0)
    columns = regressor(model, np.array([1, 2]), np.arange(2), one.position[5:500], qd[5:500], qdd[5:500])
    own = np.concatenate([numbers(moments_of(model, body)) for body in (1, 2)])
    np.testing.assert_allclose(columns @ own, one.effort[5:500], atol=2e-3)


def test_bodies_are_made_real_and_real_ones_stay() -> None:
    real = moments_of(scene(DRAWN), 1)
    np.testing.assert_allclose(nearest_body(real), real, atol=1e-12)
    mended = nearest_body(real - np.diag([0.1, 0, 0, 0]))
    assert np.linalg.eigvalsh(mended).min() > 0


def test_a_regression_is_a_cell_that_simulates(tmp_path: Path) -> None:
    cell = arm(tmp_path)
    model = mujoco.MjModel.from_xml_path(str(cell.model_path))
    second = np.stack([moments_of(model, b) * (1.1, 0.9)[b - 1] for b in (1, 2)])
    pair, none = np.array([0.1, 0.2]), np.zeros(2)
    found = Regressed(np.array([1, 2], np.int64), second, pair, pair, pair, none, np.array([1.2, 0.8]), 0.0, 28)
    said = values(cell, found, ("shoulder", "elbow"))
    assert said["shoulder@actuation@gain"] == pytest.approx(96)
    assert said["lower@dyna@centre"] == pytest.approx(0.12)
    new = Simulator(as_cell(cell, found, ("shoulder", "elbow"), tmp_path)).physics.model
    np.testing.assert_allclose(new.body_mass[1:], [1.32, 0.63], rtol=1e-4)
    np.testing.assert_allclose(new.body_inertia[1:], model.body_inertia[1:] * [[1.1], [0.9]], rtol=1e-3)
    np.testing.assert_allclose(new.dof_damping, pair)
    np.testing.assert_allclose(new.actuator_gainprm[:, 0], [96, 32])
    np.testing.assert_allclose(new.actuator_biasprm[:, 2], model.actuator_biasprm[:, 2])
