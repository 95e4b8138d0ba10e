"""The arms' equations of motion: against MuJoCo's, against energy, against smaller steps, against closed forms."""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from compass_ros.types import Floats
from compass_ros.worlds.arms.arm import Arm
from compass_ros.worlds.arms.chain import accelerate, mass_matrix
from compass_ros.worlds.arms.motion import Drive, play
from test.worlds.arms import CELLS, arm, frictionless


def accelerations(own: Arm, q: Floats, v: Floats, force: Floats) -> Floats:
    state, bounds, belongs = (q[None], v[None], force[None]), (-own.dry[None], own.dry[None]), own.armature
    return np.asarray(accelerate(*state, *bounds, own.soft, own.back, belongs, *own.chain, own.gravity)[0])


@pytest.mark.parametrize("name", ["two_joint_arm", "two_joint_arm_driven", "kinova3"])
def test_accelerations_are_mujocos(name: str) -> None:
    own, model = arm(name), mujoco.MjModel.from_xml_path(str(CELLS / f"{name}.xml"))
    data, rng = mujoco.MjData(model), np.random.default_rng(0)
    for speed in (0.0, 0.05, 1.0, 3.0, 8.0):  # stuck, creeping, sliding
        q, v, pull = rng.normal(size=model.nq), speed * rng.normal(size=model.nq), rng.normal(size=model.nq)
        data.qpos[:], data.qvel[:], data.qfrc_applied[:] = q, v, pull
        if model.nu:
            data.ctrl[:] = q
        mujoco.mj_forward(model, data)
        drive = np.clip(-own.damper * v, -own.limit, own.limit)
        ours = accelerations(own, q, v, drive + pull - own.damping * v)
        assert np.allclose(ours, data.qacc, rtol=1e-6, atol=1e-7)


def heights(own: Arm, q: Floats) -> Floats:
    """(n,) of the centres of mass [m]."""
    place, turn, found = np.zeros(3), np.eye(3), []
    for i in range(len(own.mass)):
        place, turn = place + turn @ own.origin[i], turn @ own.turn[i]
        axis = own.axis[i]
        cross = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
        turn = turn @ (np.eye(3) + np.sin(q[i]) * cross + (1 - np.cos(q[i])) * cross @ cross)
        found.append((place + turn @ own.centre[i])[2])
    return np.array(found)


@pytest.mark.nightly
def test_energy_stays_without_friction() -> None:
    own = frictionless(arm())
    drive = Drive(None, np.array([[1.2, -0.9], [0.4, 1.5]]), 0.0, 2.0, 500.0, np.zeros(2))
    played = play(own, drive)
    rates = np.gradient(played.angle, 1 / 500, axis=1, edge_order=2)

    def energy(e: int, f: int) -> float:
        q, v = played.angle[e, f], rates[e, f]
        lifted = 9.81 * own.mass @ heights(own, q)
        return float(0.5 * v @ mass_matrix(q, own.armature, *own.chain) @ v + lifted)

    for e in range(2):
        totals = [energy(e, f) for f in range(5, played.angle.shape[1] - 5, 50)]
        swing = 9.81 * own.mass @ (heights(own, played.angle[e, 0]) - heights(own, np.zeros(2)))
        assert np.ptp(totals) < 1e-4 * swing  # what the rates by differences allow


@pytest.mark.nightly
def test_half_the_step_gives_the_same_motion() -> None:
    first = np.array([[1.2, -0.9], [0.4, 1.5]])
    coarse = Drive(None, first, 0.0, 1.5, 100.0, np.zeros(2))
    moved = play(arm(), coarse).angle
    assert np.abs(moved - play(arm(), replace(coarse, step_s=0.5 * coarse.step_s)).angle).max() < 2e-5
    smooth = play(frictionless(arm()), coarse).angle
    half = play(frictionless(arm()), replace(coarse, step_s=0.5 * coarse.step_s)).angle
    assert np.abs(smooth - half).max() < 1e-9


@pytest.mark.parametrize("locks", [False, True])
def test_a_stuck_joint_creeps_as_the_drawing_says_or_hardly(locks: bool) -> None:
    own = replace(arm(), gravity=np.zeros(3))
    own = own.locking(np.arange(2)) if locks else own
    pull, v = np.array([0.05, 0.0]), np.zeros(2)
    for _ in range(20000):
        v = v + 0.0005 * accelerations(own, np.zeros(2), v, pull)
    inverse = np.linalg.inv(mass_matrix(np.zeros(2), own.armature, *own.chain))
    expected = pull[0] * own.soft[0] / own.back[0]  # friction carries the pull: soft f = back v
    assert v[0] == pytest.approx(expected, rel=1e-6)
    by_the_manual = pull[0] * inverse[0, 0] * (0.1 / 0.9) / (2 / (0.95 * 0.02))
    assert v[0] == pytest.approx(by_the_manual, rel=1e-6) if not locks else abs(v[0]) < 0.002 * by_the_manual


def test_a_pull_beyond_the_bounds_moves_a_joint_as_newton_says() -> None:
    own = replace(arm(), gravity=np.zeros(3))
    v = np.array([0.5, 0.0])
    found = accelerations(replace(own, dry=np.array([0.1, 0.0])), np.zeros(2), v, np.array([0.3, 0.0]))
    free = accelerations(replace(own, dry=np.zeros(2)), np.zeros(2), v, np.array([0.2, 0.0]))
    assert np.allclose(found, free, rtol=1e-9)
