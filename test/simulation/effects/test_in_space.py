"""Laws on bodies in space, on pairs and in contacts, against closed motions, formulas integrated, or MuJoCo's own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import mujoco
import numpy as np
import pytest

from compass_ros.errors import ConfigError
from compass_ros.simulation.effects import Attached, Exported, FittedEffect, attach, effect
from compass_ros.simulation.extents import unit_body
from compass_ros.types import Floats
from test.simulation.effects.scenes import Acceleration, flown

ASKEW = np.array([1.5, -0.7, -9.0])
SPIN = np.array([3.0, -20.0, 8.0])
STEPS = 300
"""Of the integrator; it is of fourth order."""
START, SPEED = np.array([0.1, 0.2, 0.3]), np.array([2.0, -1.0, 3.0])


def free(gravity: Floats, bodies: str = "", step: float = 2e-4) -> mujoco.MjModel:
    """A ball of 0.2 kg, and what else there is."""
    return mujoco.MjModel.from_xml_string(
        f'<mujoco><option timestep="{step}" gravity="{gravity[0]} {gravity[1]} {gravity[2]}"/><worldbody>'
        '<body name="ball"><freejoint/><inertial pos="0 0 0" mass="0.2" diaginertia="1e-3 1e-3 1e-3"/></body>'
        f"{bodies}</worldbody></mujoco>"
    )


def law(name: str, numbers: tuple[float, ...], *objects: str) -> Exported:
    return Exported((FittedEffect(Attached(effect(name), objects), numbers, ()),), {})


def after(model: mujoco.MjModel, given: Exported, seconds: float, qpos: Floats, qvel: Floats) -> mujoco.MjData:
    data = mujoco.MjData(model)
    data.qpos[: len(qpos)], data.qvel[: len(qvel)] = qpos, qvel
    with attach(model, data, given):
        mujoco.mj_step(model, data, nstep=round(seconds / model.opt.timestep))
    return data


def stream(v: Floats, wind: Floats, coefficient: float) -> Floats:
    relative = wind - v
    return np.asarray(coefficient * (np.linalg.norm(relative) * relative + np.linalg.norm(v) * v))


AIR = np.array([0.8, 0.5, -0.6])
FORMULAS: dict[str, tuple[tuple[float, ...], Acceleration]] = {
    "viscous_drag": ((0.8,), lambda t, r, v: -0.8 * v),
    "quadratic_drag": ((0.4,), lambda t, r, v: -0.4 * np.linalg.norm(v) * v),
    "wind": ((*AIR, 0.3), lambda t, r, v: stream(v, AIR, 0.3)),
    "magnus": ((0.05,), lambda t, r, v: 0.05 * np.cross(SPIN, v)),
    "buoyancy": ((0.3,), lambda t, r, v: -0.3 * ASKEW),
}


@pytest.mark.parametrize("name", FORMULAS)
def test_a_force_on_a_flying_body_is_what_its_formula_says(name: str) -> None:
    """With gravity askew, and the spin as it was: a force at the centre of mass turns nothing."""
    numbers, formula = FORMULAS[name]
    data = after(free(ASKEW), law(name, numbers, "ball"), 0.5, START, np.concatenate([SPEED, SPIN]))
    expected = flown(lambda t, r, v: ASKEW + formula(t, r, v), START, SPEED, 0.5, STEPS)
    ballistic = START + 0.5 * SPEED + 0.125 * ASKEW
    moved = float(np.linalg.norm(expected[:3] - ballistic))
    assert moved > 0.02
    np.testing.assert_allclose(data.qpos[:3], expected[:3], atol=2e-3 * moved + 3e-4)
    np.testing.assert_allclose(data.qvel[3:6], SPIN, rtol=1e-9)


def test_wind_in_a_scene_with_air_adds_to_the_drag_there() -> None:
    """MuJoCo's drag of a sphere in air that moves is that in air at rest with this law; MuJoCo leaves out the half."""
    ball = '<geom type="sphere" size="0.1" mass="0.05" fluidshape="ellipsoid" fluidcoef="0.47 0 0 0 0"/>'
    xml = f"""<mujoco><option timestep="2e-4" density="1.2" wind="{{}} 0 0" gravity="0 0 -9.81"/>
      <worldbody><body name="ball"><freejoint/>{ball}</body></worldbody></mujoco>"""
    windy, still = (mujoco.MjModel.from_xml_string(xml.format(speed)) for speed in (4.0, 0.0))
    expected = mujoco.MjData(windy)
    expected.qvel[:3] = SPEED
    mujoco.mj_step(windy, expected, nstep=2500)
    drag = 1.2 * np.pi * 0.1**2 * 0.47 / 0.05
    given = law("wind", (4.0, 0.0, 0.0, drag), "ball")
    alone = after(still, law("wind", (0.0, 0.0, 0.0, drag), "ball"), 0.5, np.zeros(3), SPEED)
    found = after(still, given, 0.5, np.zeros(3), SPEED)
    moved = float(np.linalg.norm(expected.qpos[:3] - alone.qpos[:3]))
    assert moved > 0.1
    np.testing.assert_allclose(found.qpos[:3], expected.qpos[:3], atol=0.01 * moved)


@pytest.mark.parametrize("rates", [(0.8, 0.0, 0.0), (0.0, -0.5, 0.9), (0.4, 0.6, -0.7)])
def test_a_spin_that_is_not_measured_is_three_rates(rates: tuple[float, float, float]) -> None:
    by_chance = effect("magnus").at(unit_body(turns=False))
    kind = replace(by_chance, quantities=tuple(replace(q, chance=False) for q in by_chance.quantities))
    given = Exported((FittedEffect(Attached(kind, ("ball",)), rates, ()),), {})
    data = after(free(ASKEW), given, 0.5, START, np.concatenate([SPEED, SPIN]))
    expected = flown(lambda t, r, v: ASKEW + np.cross(rates, v), START, SPEED, 0.5, STEPS)
    np.testing.assert_allclose(data.qpos[:3], expected[:3], atol=1e-3)
    assert np.linalg.norm(data.qpos[:3] - START - 0.5 * SPEED - 0.125 * ASKEW) > 0.05
    nobody_knows = Exported((FittedEffect(Attached(by_chance, ("ball",)), rates, ()),), {})
    data = after(free(ASKEW), nobody_knows, 0.5, START, np.concatenate([SPEED, SPIN]))
    np.testing.assert_allclose(data.qpos[:3], START + 0.5 * SPEED + 0.125 * ASKEW, atol=1e-3)


@pytest.mark.parametrize("gravity", [(0, 0, -9.81), (0, 0, 9.81), (9.81, 0, 0), (-9.81, 0, 0), (0, -3, 0), (1, 2, -2)])
@pytest.mark.parametrize("angles", [(0.2, 0.0), (0.0, -0.1), (0.1, 0.25)])
def test_a_tilt_turns_gravity_and_keeps_its_size(gravity: tuple[float, ...], angles: tuple[float, float]) -> None:
    g, seconds = np.array(gravity, float), 0.1
    data = after(free(g), law("gravity_tilt", angles, "ball"), seconds, np.zeros(3), np.zeros(6))
    found = data.qvel[:3] / seconds
    assert np.linalg.norm(found) == pytest.approx(np.linalg.norm(g), rel=1e-9)
    assert np.arccos(found @ g / (g @ g)) == pytest.approx(np.hypot(*angles), rel=1e-6)
    if g[2] == -9.81:
        np.testing.assert_allclose(found[:2] / np.hypot(*found[:2]), np.array(angles) / np.hypot(*angles), atol=1e-9)


ARM = """<mujoco><option timestep="1e-3"/><worldbody><body name="arm" pos="0 0 1"><joint axis="0 1 0"/>
  <geom type="capsule" fromto="0 0 0 .1 0 -.3" size=".02" mass=".5"/>
  <body name="hand" pos=".1 0 -.3"><joint axis="1 .2 0"/><geom type="box" size=".02 .03 .05" pos=".01 0 -.05" mass=".2"
  euler="20 10 0"/>{more}</body></body></worldbody></mujoco>"""


@pytest.mark.parametrize(
    "place", [(0.0, 0.0, 0.0), (0.03, 0.0, 0.0), (0.0, -0.05, 0.02), (0.02, 0.03, -0.1), (-0.04, 0.02, 0.06)]
)
def test_a_payload_is_what_mujoco_makes_of_a_lump_welded_there(place: tuple[float, ...]) -> None:
    model = mujoco.MjModel.from_xml_string(ARM.format(more=""))
    at = model.body("hand").ipos + place
    lump = (
        f'<body pos="{at[0]} {at[1]} {at[2]}"><inertial pos="0 0 0" mass=".3" diaginertia="1e-12 1e-12 1e-12"/></body>'
    )
    data = after(
        model,
        law("payload", (0.3, *(0.3 * p for p in place)), "hand"),
        0.5,
        np.array([0.5, 0.3]),
        np.array([1.0, -2.0]),
    )
    welded = mujoco.MjModel.from_xml_string(ARM.format(more=lump))
    other = mujoco.MjData(welded)
    other.qpos[:], other.qvel[:] = (0.5, 0.3), (1.0, -2.0)
    mujoco.mj_step(welded, other, nstep=500)
    np.testing.assert_allclose(data.qpos, other.qpos, atol=1e-6)


def test_a_moment_alone_is_a_load_at_the_farthest_place() -> None:
    """Three extents away, an extent the root mean square distance of the body's mass from its centre."""
    lacking, whole = (mujoco.MjModel.from_xml_string(ARM.format(more="")) for _ in range(2))
    farthest = 3 * float(np.sqrt(lacking.body("hand").inertia.sum() / (2 * lacking.body("hand").mass[0])))
    start = 0.5, np.array([0.5, 0.3]), np.array([1.0, -2.0])
    data = after(lacking, law("payload", (0.0, 0.0, 0.006, 0.0), "hand"), *start)
    other = after(whole, law("payload", (0.006 / farthest, 0.0, 0.006, 0.0), "hand"), *start)
    np.testing.assert_allclose(data.qpos, other.qpos, atol=1e-12)


def test_a_payload_beside_the_centre_of_a_body_compiled_as_centred_is_refused() -> None:
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><worldbody><body name="it"><freejoint/><geom size=".1"/></body></worldbody></mujoco>'
    )
    with attach(model, mujoco.MjData(model), law("payload", (0.1, 0.0, 0.0, 0.0), "it")):
        assert model.body("it").mass[0] > 4.1
    with pytest.raises(ConfigError, match=r"'payload' cannot act beside the centre of 'it'.*centred for good"):
        attach(model, mujoco.MjData(model), law("payload", (0.1, 0.05, 0.0, 0.0), "it"))


OTHER = (
    '<body name="other"><freejoint/><inertial pos="0 0 0" mass="0.6" diaginertia="1e-3 1e-3 1e-3"/></body>'
    '<body name="post" pos=".1 .1 .1"/>'
)


def pulled(r: Floats, strength: float, core: float) -> Floats:
    return np.asarray(-strength * 1.5 * np.sqrt(3) * core**2 * r / (r @ r + core**2) ** 1.5)


def taut(r: Floats, stiffness: float, length: float) -> Floats:
    return np.asarray(-stiffness * max(0.0, 1 - length / float(np.linalg.norm(r))) * r)


Force = Callable[[Floats, float, float], Floats]
PAIRS: list[tuple[str, tuple[float, float], Force]] = [
    ("pair_attraction", (0.4, 0.3), pulled),
    ("pair_attraction", (-0.4, 0.1), pulled),
    ("tether", (9.0, 0.2), taut),
    ("tether", (9.0, 0.0), taut),
    ("tether", (9.0, 4.0), taut),
]


@pytest.mark.parametrize(("name", "numbers", "force"), PAIRS)
@pytest.mark.parametrize("turned", [False, True])
def test_two_bodies_move_about_their_centre_by_the_formula(
    name: str, numbers: tuple[float, float], force: Force, turned: bool
) -> None:
    """In whichever order they are named; their momentum stays."""
    apart, rate = np.array([0.3, 0.4, -0.2]), np.array([0.5, -0.4, 0.3])
    objects = ("other", "ball") if turned else ("ball", "other")
    qpos = np.concatenate([np.zeros(3), [1, 0, 0, 0], apart])
    qvel = np.concatenate([np.zeros(6), rate])
    data = after(free(np.zeros(3), OTHER), law(name, numbers, *objects), 1.0, qpos, qvel)
    reduced = 0.2 * 0.6 / 0.8
    expected = flown(lambda t, r, v: force(r, *numbers) / reduced, apart, rate, 1.0, STEPS)
    np.testing.assert_allclose(data.qpos[7:10] - data.qpos[:3], expected[:3], atol=1e-3)
    np.testing.assert_allclose(0.2 * data.qvel[:3] + 0.6 * data.qvel[6:9], 0.6 * rate, atol=1e-9)


@pytest.mark.parametrize(("name", "numbers", "force"), PAIRS)
def test_a_body_is_pulled_to_one_that_stands(name: str, numbers: tuple[float, float], force: Force) -> None:
    data = after(free(np.zeros(3), OTHER), law(name, numbers, "post", "ball"), 0.6, START, np.array([0.5, 0, 0]))
    expected = flown(lambda t, r, v: force(r - 0.1, *numbers) / 0.2, START, np.array([0.5, 0.0, 0.0]), 0.6, STEPS)
    np.testing.assert_allclose(data.qpos[:3], expected[:3], atol=1e-3)


def floor(body: str, condim: int = 3, cone: str = "elliptic") -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(
        f'<mujoco><option timestep="1e-3" cone="{cone}" impratio="10"/><worldbody><geom name="floor" type="plane" '
        f'size="9 9 1" condim="{condim}"/><body name="it" pos="0 0 .1"><freejoint/>{body}</body></worldbody></mujoco>'
    )


BALL = '<geom name="it" size=".1" mass=".5"/>'
CUBE = '<geom name="it" type="box" size=".1 .1 .1" mass=".5"/>'


@pytest.mark.parametrize("body", [BALL, CUBE])
@pytest.mark.parametrize(
    ("force", "lift", "stays"),
    [(2.0, 6.7, True), (2.0, 7.1, False), (0.0, 5.1, False), (0.0, 4.7, True), (9.0, 13.5, True)],
)
def test_to_lift_what_sticks_takes_its_weight_and_the_adhesion(
    body: str, force: float, lift: float, stays: bool
) -> None:
    """0.5 kg; a cube with four points of contact sticks as strongly as a ball with one."""
    model = floor(body)
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, nstep=300)
    data.xfrc_applied[1, 2] = lift
    with attach(model, data, law("adhesion", (force,), "it", "floor")):
        mujoco.mj_step(model, data, nstep=300)
    assert bool(data.qpos[2] < 0.101) is stays


@pytest.mark.parametrize("hysteresis", [0.0, 0.5, 1.0])
def test_a_bounce_loses_what_is_missing_of_the_adhesion_while_surfaces_meet(hysteresis: float) -> None:
    """No gravity and a contact without losses: m (v^2 - v'^2) / 2 = hysteresis F (1 - i) d, at a depth of d.

    Of what else acts at a contact of impedance i MuJoCo's constraint leaves the share 1 - i: half.
    """
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><option timestep="2e-5" gravity="0 0 0"/><worldbody><geom name="floor" type="plane" size="9 9 1" '
        'solref="-4000 0" solimp=".5 .5 1e-4"/><body name="it" pos="0 0 .1005"><freejoint/><geom name="it" '
        'size=".1" mass=".5" solref="-4000 0" solimp=".5 .5 1e-4"/></body></worldbody></mujoco>'
    )
    data, force = mujoco.MjData(model), 4.0
    data.qvel[2], deepest = -0.5, 0.0
    with attach(model, data, law("adhesion", (force, hysteresis), "it", "floor")):
        for _ in range(5000):
            mujoco.mj_step(model, data)
            deepest = max(deepest, 0.1 - data.qpos[2])
    assert data.qpos[2] > 0.1005
    lost = 0.5 * 0.5 * (0.5**2 - data.qvel[2] ** 2)
    assert lost == pytest.approx(hysteresis * force * 0.5 * deepest, rel=0.03, abs=2e-4)


@pytest.mark.parametrize("cone", ["elliptic", "pyramidal"])
@pytest.mark.parametrize("lever", [0.0, 1e-3, 4e-3, 1e-2, 2e-2])
def test_a_rolling_ball_slows_down_by_the_closed_formula(cone: str, lever: float) -> None:
    """a = lever m g R / (I + m R^2); it stops and does not turn back."""
    model = floor(BALL, cone=cone)
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, nstep=200)
    data.qvel[:] = (1.0, 0, 0, 0, 10.0, 0)
    inertia = 0.4 * 0.5 * 0.1**2
    slowed = lever * 0.5 * 9.81 * 0.1 / (inertia + 0.5 * 0.1**2)
    with attach(model, data, law("rolling_resistance", (lever,), "it", "floor")):
        mujoco.mj_step(model, data, nstep=400)
        assert data.qvel[0] == pytest.approx(1.0 - 0.4 * slowed, abs=0.02 * 0.4 * slowed + 2e-3)
        mujoco.mj_step(model, data, nstep=2500)
    expected = max(0.0, 1.0 - 2.9 * slowed)
    assert data.qvel[0] == pytest.approx(expected, abs=0.02 * min(2.9 * slowed, 1) + 6e-3)


@pytest.mark.parametrize(("name", "number"), [("rate_dependent_restitution", 1.5), ("tangential_impulse", 0.2)])
def test_a_law_of_contacts_on_one_pair_is_the_law_of_all_there_and_nothing_elsewhere(name: str, number: float) -> None:
    balls = "".join(
        f'<body name="{n}" pos="{x} 0 0.2"><freejoint/><geom name="{n}" size=".05" mass=".1" priority="1" condim="1" '
        'solref="-8000 -20"/></body>'
        for n, x in (("left", -1), ("right", 1))
    )
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><option timestep="5e-4"/><worldbody><geom name="floor" type="plane" size="9 9 1"/>'
        f"{balls}</worldbody></mujoco>"
    )
    fast = np.tile([0.4, 0.0, -1.0, 0.0, 0.0, 0.0], 2)

    def bounced(given: Exported) -> tuple[Floats, Floats]:
        data = after(model, given, 0.3, model.qpos0, fast)
        return data.qvel[:3].copy(), data.qvel[6:9].copy()

    none, everywhere = bounced(Exported((), {})), bounced(law(name, (number,)))
    one = bounced(law(name, (number,), "floor", "left"))
    np.testing.assert_allclose(one[0], everywhere[0], rtol=0, atol=1e-12)
    np.testing.assert_allclose(one[1], none[1], rtol=0, atol=1e-12)
    assert np.linalg.norm(one[0] - none[0]) > 0.02
