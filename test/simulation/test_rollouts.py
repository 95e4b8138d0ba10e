"""Batched rollouts: the same bits however they are cut and shared out."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from benchmarks.rollouts import compare
from compass_ros.cells import load
from compass_ros.errors import ConfigError
from compass_ros.simulation import Simulator
from compass_ros.simulation.effects import EFFECTS, Attached
from compass_ros.simulation.simulator import CHUNK
from compass_ros.types import Floats
from test.simulation.table import DESCRIBED, WIDE, actions, cell, simulator, values


def drawn(count: int, seed: int) -> Floats:
    """(count, 64) values drawn within a quarter of a half-width of the defaults."""
    half = np.array([p.half_width for p in cell().parameters])
    low, high = np.array([(p.low, p.high) for p in cell().parameters]).T
    moves = np.random.default_rng(seed).uniform(-0.25, 0.25, (count, 64)) * half
    return np.asarray(np.clip(cell().defaults + moves, low, high))


def test_one_two_and_four_threads_give_the_same_bits() -> None:
    batch, shots = drawn(12, 0), actions(12)
    one, two, four = (Simulator(cell(), threads=n).motion(batch, shots, 1.5).positions for n in (1, 2, 4))
    assert (one == two).all()
    assert (one == four).all()


def test_a_rollout_depends_on_nothing_but_its_own_values() -> None:
    """Not on its neighbours, its place in the batch, the cut into chunks, or what was simulated before."""
    count = CHUNK + 5
    shots = np.tile(WIDE, (count // 3 + 1, 1))[:count]
    batch = drawn(count, 1)
    together = simulator().motion(batch, shots, 0.3).positions
    for i in (0, 7, CHUNK - 1, CHUNK, count - 1):
        assert (simulator().motion(batch[i : i + 1], shots[i : i + 1], 0.3).positions[0] == together[i]).all()


def test_rollouts_of_the_same_values_share_a_model_and_nothing_else() -> None:
    """Each as alone, with laws of their own sizes beside them."""
    dragged = simulator().with_effects([Attached(EFFECTS["viscous_drag"], ("puck1", "puck2"))])
    two, shots = drawn(2, 2), actions(6)
    batch = np.concatenate([two[[0, 1, 0, 1, 1, 0]], np.array([[0.1], [0.1], [0.3], [0.1], [0.0], [0.1]])], axis=1)
    together = dragged.motion(batch, shots, 0.5).positions
    for i in range(6):
        assert (dragged.motion(batch[i : i + 1], shots[i : i + 1], 0.5).positions[0] == together[i]).all()


def test_one_tree_moves_as_mujoco_moves_it() -> None:
    """To the bit, with dry friction, though islands are not looked for."""
    arm = Simulator(load("two_joint_arm"), threads=1)
    model = arm.physics.model
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = (0.9, -0.4), (0.5, 2.0)
    begin = np.concatenate([[0.0], data.qpos, data.qvel])
    states, _ = arm.play(arm.defaults[None], begin[None], None, 400)
    for state in states[0]:
        mujoco.mj_step(model, data)
        np.testing.assert_array_equal(state[1:], np.concatenate([data.qpos, data.qvel]))


def test_what_is_observed_is_the_motion_at_those_times_held_before_and_after() -> None:
    motion = simulator().motion(values(), DESCRIBED[None], 1.0)
    times = np.array([[-0.2, 0.0, 0.5, 0.5004, 1.0]])
    seen = simulator().observe(values(), DESCRIBED[None], times)[0]
    track = motion.positions[0]
    np.testing.assert_array_equal(seen[[0, 1, 2, 4]], track[[0, 0, 500, 1000]])
    np.testing.assert_allclose(seen[3], 0.6 * track[500] + 0.4 * track[501], atol=1e-15)


def test_bodies_are_where_the_camera_sees_them() -> None:
    biased = values({"env@camera@bias_x": 0.03})
    times = np.linspace(0, 2, 50)
    bodies = simulator().bodies(biased[0], DESCRIBED, times)
    seen = simulator().observe(biased, DESCRIBED[None], times[None])[0]
    assert set(bodies) == {"pusher", "puck1", "puck2"}
    np.testing.assert_allclose(np.hstack([bodies["puck1"][:, :2], bodies["puck2"][:, :2]]), seen, atol=1e-12)
    np.testing.assert_allclose(bodies["pusher"][0], [-0.225 + 0.03, 0.075, 0.0], atol=1e-12)


def test_rollouts_and_simulated_seconds_are_counted() -> None:
    counted = Simulator(cell(), threads=1)
    counted.motion(values(count=3), actions(3), 0.25)
    counted.observe(values(), DESCRIBED[None], np.array([[0.0, 0.5]]))
    assert counted.rollouts == 4
    assert counted.simulated_seconds == pytest.approx(3 * 0.25 + 0.5)


def test_parameters_of_effects_follow_those_of_the_cell() -> None:
    both = simulator().with_effects(
        [Attached(EFFECTS["swirl"], ("puck1", "puck2")), Attached(EFFECTS["camera_scale"], ())]
    )
    names = [p.name for p in both.parameters[64:]]
    assert names == [*(f"puck1+puck2@swirl@{q}" for q in ("strength", "centre_x", "centre_y", "radius", "tail")),
                     *(f"cell@camera_scale@{q}" for q in ("scale", "centre_x", "centre_y", "centre_z"))]  # fmt: skip
    assert both.defaults[64:].tolist() == [0.0, 0.0, 0.0, 0.12, 0.5, *4 * [0.0]]


@pytest.mark.parametrize(
    ("effect", "objects", "says"),
    [
        ("magnus", ("puck3",), "no body that slides in a plane or moving body 'puck3'.*did you mean 'puck"),
        ("magnus", (), "acts on at least one object"),
        ("local_wall", ("rigt_wall",), "did you mean 'right_wall'"),
        ("local_wall", ("left_wall", "right_wall"), "acts on one wall"),
        ("camera_scale", ("pusher",), "no tracked body 'pusher'"),
    ],
)
def test_an_effect_that_cannot_act_is_refused(effect: str, objects: tuple[str, ...], says: str) -> None:
    with pytest.raises(ConfigError, match=says):
        Simulator(cell(), [Attached(EFFECTS[effect], objects)], threads=1)


def test_friction_on_the_table_is_refused_for_what_does_not_lie_on_it() -> None:
    with pytest.raises(
        ConfigError, match=r"no body on the cell's table or moving body 'pusher'; it has \['puck1', 'puck2'\]"
    ):
        Simulator(cell(), [Attached(EFFECTS["friction_gradient"], ("pusher",))], threads=1)


def test_the_benchmark_runs() -> None:
    cost = compare(rollouts=2, threads=1, rounds=1, duration=0.1)
    assert min(cost.bare_cpu, cost.plain_cpu, cost.field_cpu) > 0
