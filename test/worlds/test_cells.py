"""The real cells of ball and bar: without what their drawings lack they are what the simulator says."""

from __future__ import annotations

import numpy as np
import pytest

from compass_ros.policy import one
from compass_ros.policy.pushing import Simulated
from compass_ros.simulation import Simulator
from compass_ros.worlds.bounce import cell as bounce
from compass_ros.worlds.push import cell as push
from compass_ros.worlds.push import scene
from test.worlds.task import task_of


def test_a_ball_falls_as_the_laws_of_falling_say_until_it_bounces() -> None:
    _, task = task_of("bouncing_ball")
    one_drop, again = (bounce.drop(task, np.array([[0.3], [0.32]]), 1, steps=6) for _ in range(2))
    np.testing.assert_array_equal(one_drop.seen, again.seen)
    fallen = one_drop.seen[:, 0, 2] - one_drop.seen[:, 5, 2]
    assert fallen == pytest.approx(0.5 * 9.81 * one_drop.time_s[5] ** 2, rel=0.02)
    assert one_drop.episodes[1].action == {"height": 0.32}


def test_bars_are_pushed_as_in_the_simulator_with_their_parameters() -> None:
    """Coulomb's friction in both, straight pushes: 2 mm after half a second, and the same bits again."""
    cell, task = task_of("pushed_bar")
    plain = scene.physics({p.name: p.default for p in task.parameters} | dict(push.TRUE), {})
    real = push.Pushing(task, 2, 0, plain, noisy=False)
    true = cell.values(dict(push.TRUE))
    told = Simulated(one(Simulator(cell, threads=1), true), 2, 0, 0.0)
    velocity, across = np.array([[0.2, 0.0], [0.25, 0.02]]), np.array([0.004, 0.01])
    real.reset(across), told.reset(across)
    for _ in range(10):
        seen, said = real.step(velocity), told.step(velocity)
    assert np.abs(seen[0] - said[0])[:, :2].max() < 2e-3
    assert np.abs(seen[1] - said[1]).max() < 2e-3


@pytest.mark.nightly
def test_two_velocities_told_step_by_step_are_a_recorded_push() -> None:
    _, task = task_of("pushed_bar")
    command = np.array([[0.0, 0.2, 0.02, 0.3, -0.02]])
    played = push.push(task, command, 3, steps=14)
    stepped = push.Pushing(task, 1, 0, noisy=False)
    start = command[:, 0] + push.REPEATS_M * np.random.default_rng([3, 0]).standard_normal(1)
    stepped.reset(start)
    for i in range(14):
        seen, _ = stepped.step(command[:, 1:3] if i < 12 else command[:, 3:5])
    assert played.seen[0, -1, :2] == pytest.approx(seen[0, :2], abs=1e-5)
