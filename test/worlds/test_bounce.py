"""The bouncing ball: energy, closed forms of the laws, and the engine against the suite's at the true parameters."""

from __future__ import annotations

import numpy as np
import pytest

from compass_ros.types import Floats
from compass_ros.worlds import draw, soft
from compass_ros.worlds.bounce import ball, laws, scene
from compass_ros.worlds.bounce.ball import Loose, Physics, Rig
from compass_ros.worlds.world import Asked
from test.worlds.task import simulated, task_of
from test.worlds.test_flight import same

CELL, TASK = task_of("bouncing_ball")
DEFAULT = {p.name: p.default for p in TASK.parameters}
ELASTIC = DEFAULT | {"ball@dyna@damping": 0.0, "table@dyna@damping": 0.0, "ball@dyna@drag": 0.0}
ELASTIC |= {"env@dyna@air_viscosity": 0.0}


def dropped(speed: float, physics: Physics, spin: float = 0.0, along: float = 0.0) -> Floats:
    """(S, 7) after a bounce on the table, far from the plates, of a ball that comes down with `speed`."""
    state = np.array([[3.0, 0.0341, along, -speed, spin, 0.0, 0.0]])
    rig = Rig(ELASTIC | {"env@dyna@gravity": 0.0})
    return np.asarray(soft.march(ball.motion(rig, physics), state, 0.25, 2e-4)[-1, 0])


def test_without_laws_the_ball_bounces_as_the_simulators_does_at_the_true_parameters() -> None:
    """Runge and Kutta against the simulator's first-order steps of 0.5 ms: 0.2 to 0.9 mm until the basket, where a ball
    between wall and floor multiplies it."""
    values = draw.true_values(TASK.parameters, np.random.default_rng(5))
    heights, time_s = np.linspace(0.25, 0.35, 6), np.arange(108) / 100
    paths = ball.play(Rig(values), heights, np.zeros(6), 1.1)
    made = np.stack(scene.seen(values, paths, {}, time_s))
    seen = simulated(CELL, values, heights[:, None], np.tile(time_s, (6, 1)))
    away = (made - seen)[:, :, [0, 2]]
    assert np.sqrt(np.mean(away[:, :85] ** 2)) < 0.5 * scene.PLACE_M
    assert np.abs(away[:, :85]).max() < 1.5 * scene.PLACE_M


def test_first_order_steps_of_the_simulators_size_reproduce_it_to_a_tenth_of_a_millimetre() -> None:
    heights, time_s, step = np.array([0.27, 0.33]), np.arange(85) / 100, ball.STEP_S
    state = ball.play(Rig(DEFAULT), heights, np.zeros(2), step)[0]
    rate, path = ball.motion(Rig(DEFAULT), ball.PLAIN), []
    for _ in range(round(0.85 / step)):
        path.append(state)
        state = state.copy()
        state[:, 2:5] += step * rate(0.0, state)[:, 2:5]
        state[:, :2] += step * state[:, 2:4]
    seen = simulated(CELL, DEFAULT, heights[:, None], np.tile(time_s, (2, 1)))
    made = np.stack([soft.at(np.stack(path)[:, s, :2], step, time_s) for s in range(2)])
    assert np.abs(made - seen[:, :, [0, 2]]).max() < 1e-4


@pytest.mark.parametrize("speed", [0.3, 1.0, 2.5])
def test_energy_stays_where_nothing_takes_it(speed: float) -> None:
    assert dropped(speed, ball.PLAIN)[3] == pytest.approx(speed, rel=1e-4)


@pytest.mark.parametrize(("speed", "loss"), [(0.5, 0.02), (1.0, 0.02), (2.0, 0.01)])
def test_hunt_and_crossley_lose_in_proportion_to_the_speed(speed: float, loss: float) -> None:
    after = dropped(speed, Physics({"table": (laws.lossy(loss),)}, {}))
    assert 1 - after[3] / speed == pytest.approx(loss * speed, rel=0.08)


@pytest.mark.parametrize("friction", [0.05, 0.9])
def test_friction_keeps_the_angular_momentum_about_the_point_of_contact(friction: float) -> None:
    """And ends in rolling where there is enough of it: v' = (v + 2/3 r w) / (1 + 2/3), hollow ball (Cross 2002)."""
    radius, along, spin = 0.034, 1.0, -10.0
    after = dropped(2.0, Physics({}, {"table": laws.rubbing(friction)}), spin, along)
    before = along + 2 / 3 * radius * spin
    assert after[2] + 2 / 3 * radius * after[4] == pytest.approx(before, rel=1e-6)
    rolling = before / (1 + 2 / 3)
    sliding = along - friction * 4.0  # mu times the whole normal impulse, 2 m v
    assert after[2] == pytest.approx(max(rolling, sliding), rel=0.03)


def test_a_loose_plate_shares_energy_with_the_ball_and_a_heavy_one_does_not() -> None:
    light, heavy = (dropped(1.0, Physics({}, {}, loose=Loose("table", m, m * 1e4, 0.0))) for m in (0.3, 1e4))
    assert heavy[3] == pytest.approx(1.0, rel=1e-3)
    assert light[3] < 0.99
    total = 0.057 * light[3] ** 2 + 0.3 * (light[6] ** 2 + 1e4 * light[5] ** 2)
    assert total == pytest.approx(0.057, rel=1e-3)


@pytest.mark.nightly
def test_a_world_is_its_seed_alone() -> None:
    asked = Asked(2, None, ("adhesion",))
    one, again = (scene.conceal(TASK, asked) for _ in range(2))
    assert same(one, again)
    assert one.answer["kind"] == "one"
