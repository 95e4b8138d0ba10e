"""The pushed bar: closed forms of friction, and the engine against the suite's at the true parameters."""

from __future__ import annotations

import numpy as np
import pytest

from compass_ros.types import Floats
from compass_ros.worlds import draw, soft
from compass_ros.worlds.push import bar, laws, scene
from compass_ros.worlds.push.bar import Feet, Physics, Rig
from compass_ros.worlds.world import Asked
from test.by_night import but
from test.worlds.task import simulated, task_of
from test.worlds.test_flight import same

STILL = bar.told_by(np.zeros((1, 5)))
CELL, TASK = task_of("pushed_bar")
DEFAULT = {p.name: p.default for p in TASK.parameters}
PUSHES = np.array([[0.0, 0.2, 0.0, 0.2, 0.0], [0.03, 0.2, 0.0, 0.3, 0.0], [-0.04, 0.15, 0.05, 0.25, -0.05]])


def slid(velocity: tuple[float, float, float], physics: Physics, duration_s: float) -> Floats:
    """(11,) where a bar ends that slides by itself, far from the tool."""
    state = np.zeros((1, 11))
    state[0, 3:6], state[0, 6] = velocity, -1.0
    return np.asarray(soft.march(bar.motion(Rig(DEFAULT), STILL, physics), state, duration_s, 2.5e-4)[-1, 0])


def moving(slip: tuple[float, float], place: tuple[float, float] = (0.0, 0.0), path: float = 0.0) -> Feet:
    return Feet(np.full((1, 3, 2), place), np.full((1, 3, 2), slip), np.zeros(1), np.array([path]))


def test_without_laws_the_bar_moves_as_the_simulators_does_at_the_true_parameters() -> None:
    """MuJoCo's convex friction turns from the slip where that changes quickly: 0.1 to 0.3 mm, and 1 mm in pushes near
    the centre of mass, which run away from any difference."""
    values = draw.true_values(TASK.parameters, np.random.default_rng(1))
    time_s = np.arange(96) / 60
    friction = bar.coulomb(values["feet@dyna@friction"])
    paths = bar.play(Rig(values), PUSHES, 1.65, Physics(friction))
    made = np.stack(scene.seen(values, paths, {}, time_s))
    seen = simulated(CELL, values, PUSHES, np.tile(time_s, (3, 1)))
    assert np.sqrt(np.mean((made - seen)[:, :, :2] ** 2)) < 0.7 * scene.PLACE_M
    assert np.sqrt(np.mean((made - seen)[:, :, 3:] ** 2)) < 0.5 * scene.ANGLE_RAD
    assert np.ptp(seen[:, :, 0], axis=1).min() > 0.03


@pytest.mark.parametrize("friction", but((0.1, 0.3, 0.6), 0.3))
def test_a_bar_slides_as_far_as_coulomb_says(friction: float) -> None:
    after = slid((0.4, 0.0, 0.0), Physics(bar.coulomb(friction)), 0.6)
    assert after[0] == pytest.approx(0.4**2 / (2 * friction * 9.81), rel=0.02)
    assert abs(after[2]) < 1e-9


@pytest.mark.nightly
def test_a_film_slows_in_proportion() -> None:
    physics = scene.physics(DEFAULT | {"feet@dyna@friction": 0.0}, {"film": laws.Drawn((), {}, "", viscous_1s=2.0)})
    assert slid((0.4, 0.0, 0.0), physics, 0.5)[3] == pytest.approx(0.4 * np.exp(-1.0), rel=1e-4)


def test_loads_carry_weight_and_moments() -> None:
    rng = np.random.default_rng(0)
    force, arm = rng.uniform(-0.4, 0.4, (5, 3, 2)), np.tile(bar.FEET, (5, 1, 1))
    loads = bar._loads(force, arm, 0.3)
    assert loads.sum(axis=1) == pytest.approx(0.3 * 9.81)
    moments = np.einsum("sf,sfk->sk", loads, arm + bar.HEIGHT_M * force)
    assert np.abs(moments).max() < 1e-12


def test_a_push_without_friction_keeps_momentum_and_energy() -> None:
    values = DEFAULT | {"tool@actuation@servo_gain": 0.0, "tool@contact@damping": 0.0}
    state = np.zeros((1, 11))
    state[0, 6:10] = bar.TOOL_X, 0.03, 0.2, 0.0
    rate = bar.motion(Rig(values), STILL, Physics(bar.coulomb(0.0)))
    after = soft.march(rate, state, 0.3, 2.5e-4)[-1, 0]
    assert 0.3 * after[3] + 8 * after[8] == pytest.approx(8 * 0.2, rel=1e-9)
    energy = 0.3 * (after[3] ** 2 + after[4] ** 2) + bar.INERTIA * after[5] ** 2 + 8 * (after[8] ** 2 + after[9] ** 2)
    assert energy == pytest.approx(8 * 0.2**2, rel=1e-3)
    assert abs(after[5]) > 1.0


@pytest.mark.parametrize("seed", range(4))
def test_ratios_of_friction_have_their_limits(seed: int) -> None:
    fast, slow = moving((3.0, 0.0)), moving((1e-4, 0.0))
    stribeck, brushed, spill, worn = (
        draw_one(np.random.default_rng(seed)) for draw_one in (laws.stribeck, laws.brushed, laws.spill, laws.run_in)
    )
    assert ratio(stribeck, slow) == pytest.approx(1 + stribeck.quantities["more"], rel=0.1)
    assert ratio(stribeck, fast) == pytest.approx(1.0, abs=0.02)
    turn = brushed.quantities["angle_rad"]
    assert ratio(brushed, moving((np.cos(turn), np.sin(turn)))) == pytest.approx(1 + brushed.quantities["over"])
    assert ratio(spill, moving((1.0, 0.0), (-0.4, 0.3))) == pytest.approx(1.0)
    assert ratio(worn, moving((1.0, 0.0), path=1.0)) == pytest.approx(1.0, abs=1e-4)


def ratio(law: laws.Drawn, feet: Feet) -> float:
    assert law.ratio is not None
    return float(np.ravel(law.ratio(feet))[0])


def test_drives_are_late_slow_and_weak() -> None:
    told = bar.told_by(np.array([[0.0, 0.3, 0.0, 0.1, 0.0]]))
    late, slow, weak = (f(np.random.default_rng(0)) for f in (laws.late_drive, laws.slow_drive, laws.weak_drive))
    assert late.drive
    assert slow.drive
    assert weak.drive
    delay, constant = late.quantities["late_s"], slow.quantities["constant_s"]
    assert late.drive(told)(0.5 * delay)[0, 0] == 0.0
    assert late.drive(told)(0.6 + 0.5 * delay)[0, 0] == pytest.approx(0.3)
    assert slow.drive(told)(constant)[0, 0] == pytest.approx(0.3 * (1 - np.exp(-1)))
    assert slow.drive(told)(3.0)[0, 0] == pytest.approx(0.0, abs=1e-6)
    assert weak.drive(told)(0.1)[0, 0] == pytest.approx(min(0.3, weak.quantities["most_ms"]))


@pytest.mark.nightly
def test_a_world_is_its_seed_alone() -> None:
    asked = Asked(4, None, ("camera_scale",))
    one, again = (scene.conceal(TASK, asked) for _ in range(2))
    assert same(one, again)
    assert [law["name"] for law in one.answer["laws"]] == ["camera_scale"]  # type: ignore[attr-defined]
