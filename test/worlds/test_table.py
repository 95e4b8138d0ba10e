"""The table: collisions and laws against closed forms, and the engine against the suite's at the true parameters."""

from __future__ import annotations

import numpy as np
import pytest

from compass_ros.types import Floats
from compass_ros.worlds import draw, soft
from compass_ros.worlds.table import discs, laws, scene
from compass_ros.worlds.table.discs import PLAIN, Physics, Puck, Rig
from compass_ros.worlds.world import Asked
from test.worlds.task import simulated, task_of
from test.worlds.test_flight import same

CELL, TASK = task_of("air_hockey")
DEFAULT = {p.name: p.default for p in TASK.parameters}
SMOOTH = DEFAULT | {name: 0.0 for name in DEFAULT if name.endswith(("@damping", "@friction_sliding"))}


def ended(velocity: tuple[float, float], physics: Physics = PLAIN, values: dict[str, float] = SMOOTH) -> Floats:
    """(18,) after 0.7 s of puck 1 alone, from the middle of the left half; the others stand far away."""
    state = np.zeros((1, discs.STATE))
    state[0, :6], state[0, 8:10] = (-0.25, 0.0, 0.4, 0.18, 0.4, -0.15), velocity
    still = discs.told_by(values, np.array([[0.4, -0.15, 0.0, 1e3]]), faster=0.0)
    return np.asarray(soft.march(discs.motion(Rig(values), still, physics), state, 0.7, 1e-3)[-1, 0])


def puck(place: tuple[float, float], velocity: tuple[float, float] = (0.0, 0.0)) -> Puck:
    return Puck(0.0, np.array([place]), np.array([velocity]), np.array([[-0.1, 0.05]]), np.zeros(1))


def test_without_laws_the_pucks_move_as_the_simulators_do_at_the_true_parameters() -> None:
    """What is left is the simulator's first-order step of 1 ms: with that rule this engine follows it to 0.07 mm."""
    rng = np.random.default_rng(0)
    low, high = (np.array([getattr(field, side) for field in CELL.action]) for side in ("low", "high"))
    commands, time_s = rng.uniform(low, high, (5, 4)), np.arange(150) / 60
    seen = simulated(CELL, DEFAULT, commands, np.tile(time_s, (5, 1)))
    made = np.stack(scene.seen(DEFAULT, discs.play(Rig(DEFAULT), commands, 2.55), {}, time_s))
    assert np.sqrt(np.mean((made - seen) ** 2)) < scene.PLACE_M
    assert np.abs((made - seen)[:, :30]).max() < 0.5 * scene.PLACE_M


def test_two_smooth_pucks_keep_momentum_and_energy_and_part_at_a_right_angle() -> None:
    state = np.zeros((1, discs.STATE))
    state[0, :6], state[0, 8:10] = (-0.3, 0.01, -0.2, -0.01, 0.3, -0.1), (0.5, 0.0)
    still = discs.told_by(SMOOTH, np.array([[0.3, -0.1, 0.0, 1e3]]), faster=0.0)
    after = soft.march(discs.motion(Rig(SMOOTH), still, PLAIN), state, 0.3, 2.5e-4)[-1, 0]
    one, two = after[8:10], after[10:12]
    assert one + two == pytest.approx([0.5, 0.0], abs=1e-9)
    assert one @ one + two @ two == pytest.approx(0.25, rel=1e-4)
    assert abs(one @ two) < 1e-3


def test_a_smooth_rail_reflects_and_hunt_and_crossley_take_their_share() -> None:
    assert ended((-0.5, 0.2))[8:10] == pytest.approx([0.5, 0.2], rel=1e-3)
    lossy = Physics({}, {}, {"back_wall": (lambda t: np.asarray(1.5 * 0.2 * t.force * t.closing),)}, {})
    assert 1 - ended((-0.5, 0.0), lossy)[8] / 0.5 == pytest.approx(0.2 * 0.5, rel=0.12)  # to first order in a v


@pytest.mark.parametrize("friction", [0.02, 0.3])
def test_a_rough_rail_drags_the_rim_until_it_rolls(friction: float) -> None:
    """And r m dv = I w: the angular momentum about the point of contact stays."""
    after, radius = ended((-0.6, 0.2), Physics({}, {}, {}, {"back_wall": friction})), 0.0255
    rolling = 0.2 / (1 + radius**2 / discs.TURNING)
    lost = 0.2 - after[9]
    assert lost == pytest.approx(min(friction * 1.2, rolling), rel=0.03)
    assert abs(after[14]) == pytest.approx(radius * lost / discs.TURNING, rel=1e-6)


@pytest.mark.parametrize("share", [0.5, 1.0])
def test_a_puck_slides_as_far_as_its_cushion_lets_it(share: float) -> None:
    values = SMOOTH | {"puck1@dyna@friction_sliding": 0.4}
    after = ended((0.25, 0.0), Physics({}, {}, {}, {}, carried=share), values)
    slowing = 0.4 * 9.81 * (1 - 0.8 * share)
    assert after[0] + 0.25 == pytest.approx(0.25**2 / (2 * slowing), rel=0.01)


@pytest.mark.parametrize("seed", range(5))
def test_fields_have_their_closed_forms(seed: int) -> None:
    rng = [np.random.default_rng(seed) for _ in range(5)]
    sag, swirl, magnet, film, breeze = (
        laws.sag(rng[0]),
        laws.vortex(rng[1]),
        laws.magnet(rng[2]),
        *(f(r) for f, r in ((laws.air_film, rng[3]), (laws.draught, rng[4]))),
    )
    for law in (sag, swirl, magnet, film, breeze):
        assert law.force is not None
    assert force(sag, puck((0.0, 0.0))) == pytest.approx([0.0, 0.0])
    step = 1e-5  # weight along the slope of the plate
    high, low = (np.cos(np.pi / 0.9 * x) * np.cos(np.pi / 0.45 * 0.05) for x in (0.2 + step, 0.2 - step))
    slope = -sag.quantities["depth_m"] * (high - low) / (2 * step)
    assert force(sag, puck((0.2, 0.05)))[0] == pytest.approx(-laws.GRAVITY * slope, rel=1e-6)
    q = magnet.quantities
    far = force(magnet, puck((q["x_m"] + 3 * q["height_m"], q["y_m"])))
    near = force(magnet, puck((q["x_m"] + 0.5 * q["height_m"], q["y_m"])))
    assert np.sign(far[0]) == -np.sign(near[0])  # upright dipoles change from pull to push at r = 2 h
    assert force(film, puck((0.0, 0.0), (0.3, -0.1))) == pytest.approx(
        film.quantities["rate_1s"] * np.array([-0.3, 0.1])
    )
    carried = breeze.quantities["speed_ms"] * np.array(
        [np.cos(breeze.quantities["towards_rad"]), np.sin(breeze.quantities["towards_rad"])]
    )
    still = laws.in_air(-carried[None])[0]
    assert force(breeze, puck((0.0, 0.0), (carried[0], carried[1]))) == pytest.approx(-still)
    c = swirl.quantities
    around = force(swirl, puck((c["x_m"] + 10 * c["core_m"], c["y_m"])))
    assert abs(around[0]) < 1e-12
    speed = abs(c["circulation_m2s"]) / (2 * np.pi * 10 * c["core_m"])
    assert abs(around[1]) == pytest.approx(laws.in_air(np.array([[speed, 0.0]]))[0, 0], rel=1e-6)


def force(law: laws.Drawn, one: Puck) -> Floats:
    assert law.force is not None
    return np.asarray(law.force(one)[0])


@pytest.mark.nightly
def test_a_world_is_its_seed_alone() -> None:
    asked = Asked(4, "none")
    one, again = (scene.conceal(TASK, asked) for _ in range(2))
    assert same(one, again)
    values = draw.true_values(TASK.parameters, draw.streams(4, "air_hockey", scene._STREAMS)["values"])
    assert one.answer["parameters"] == values
