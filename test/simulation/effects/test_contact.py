"""Effects of the contact channel: speeds and spins into and out of a wall, against a contact integrated by hand."""

from __future__ import annotations

import copy

import mujoco
import numpy as np
import pytest

from compass_ros.errors import ConfigError
from compass_ros.simulation import Simulator
from compass_ros.simulation.effects import EFFECTS, Attached, Exported, attach
from compass_ros.types import Floats
from test.simulation.effects.scenes import exported
from test.simulation.table import cell, simulator, values

RADIUS, MASS, INERTIA = 0.0255, 0.03, 9.75e-6
STIFFNESS, DAMPING = 10000.0, 10.0
IMPEDANCE = (0.01, 0.95, 0.006)


def wall(time_step: float = 2e-5) -> mujoco.MjModel:
    """A puck, and a wall 0.05 m from its centre at -y, with the contact of the air-hockey table."""
    return mujoco.MjModel.from_xml_string(f"""
        <mujoco><option timestep="{time_step}" integrator="implicitfast" gravity="0 0 0"/>
          <default><geom contype="0" conaffinity="0" condim="1"/></default>
          <worldbody><geom name="wall" type="plane" size="1 1 0.1" pos="0 -0.05 0" zaxis="0 1 0"/>
            <body name="puck"><joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/>
              <joint type="hinge" axis="0 0 1"/>
              <inertial pos="0 0 0" mass="{MASS}" diaginertia="5.13e-6 5.13e-6 {INERTIA}"/>
              <geom name="puck" type="sphere" size="{RADIUS}"/></body></worldbody>
          <contact><pair geom1="wall" geom2="puck" condim="1" solref="{-STIFFNESS} {-DAMPING}"
            solimp="{IMPEDANCE[0]} {IMPEDANCE[1]} {IMPEDANCE[2]} 0.5 2"/></contact></mujoco>""")


def bounced(given: Exported, velocity: tuple[float, float, float]) -> Floats:
    """(vx, vy, yaw rate) after the wall."""
    model = wall()
    data = mujoco.MjData(model)
    data.qvel[:] = velocity
    with attach(model, data, given):
        while data.qvel[1] < 0 or data.ncon:
            mujoco.mj_step(model, data)
    return np.array(data.qvel)


def by_hand(speed: float, slope: float) -> float:
    """Speed after the wall by MuJoCo's law of a soft contact, a = d (-b v - k d r) / (d + (1 - d) w) at depth r < 0."""
    low, high, width = IMPEDANCE
    w = 2.0 / 3.0  # MuJoCo weighs softness with the mean of the inverse mass over three axes, of which one is locked
    r, v, h = 0.0, -speed, 1e-6
    while r <= 0:
        x = min(-r / width, 1.0)
        d = low + (high - low) * (2 * x**2 if x < 0.5 else 1 - 2 * (1 - x) ** 2)
        damping = DAMPING / high * (1 + slope * abs(v))
        wanted = -damping * v - STIFFNESS / high**2 * d * r
        v += h * max(wanted, 0.0) * d / (d + (1 - d) * w)
        r += h * v
    return v


@pytest.mark.parametrize("speed", [0.15, 0.3, 0.6])
@pytest.mark.parametrize("slope", [0.0, 5.0])
def test_speed_after_a_wall_follows_the_law(speed: float, slope: float) -> None:
    after = bounced(exported("rate_dependent_restitution", (slope,), ()), (0.0, -speed, 0.0))
    assert after[1] == pytest.approx(by_hand(speed, slope), rel=5e-3)


def test_restitution_falls_with_speed_only_with_the_effect() -> None:
    speeds = (0.1, 0.3, 0.6)
    plain, rated = (
        [bounced(exported("rate_dependent_restitution", (slope,), ()), (0, -v, 0))[1] / v for v in speeds]
        for slope in (0.0, 5.0)
    )
    assert rated[0] < plain[0]
    fall = [1 - r / p for r, p in zip(rated, plain, strict=True)]
    assert fall[2] > 1.6 * fall[1] > 0.02
    assert fall[1] > 2 * fall[0]


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_rim_friction_takes_mu_times_the_normal_impulse_and_spins_the_puck(side: float) -> None:
    friction = 0.1
    after = bounced(exported("tangential_impulse", (friction,), ()), (side * 0.4, -0.3, 0.0))
    plain = bounced(exported("tangential_impulse", (0.0,), ()), (side * 0.4, -0.3, 0.0))
    normal = 0.3 + plain[1]
    lost = side * 0.4 - after[0]
    assert after[1] == pytest.approx(plain[1], rel=1e-6)
    assert lost == pytest.approx(side * friction * normal, rel=0.02)
    arm = INERTIA * after[2] / (MASS * lost)  # from the centre to where the rims touch, a little inside the rim
    assert -RADIUS < arm < -0.85 * RADIUS


def test_rim_friction_stops_at_rolling() -> None:
    """However rough, the rim does not slide back: slip and spin end together."""
    after = bounced(exported("tangential_impulse", (0.8,), ()), (0.05, -0.4, 0.0))
    assert after[0] + after[2] * RADIUS == pytest.approx(0, abs=0.01)
    assert 0 < after[0] < 0.05


def test_spin_comes_from_rim_friction_alone() -> None:
    assert bounced(Exported((), {}), (0.4, -0.3, 0.0))[2] == pytest.approx(0, abs=1e-12)


def right_wall(numbers: Floats) -> Floats:
    """(T,) distance of puck 2 from the right wall's place in the drawing, on a shot that hits it."""
    changed = Simulator(cell(), [Attached(EFFECTS["local_wall"], ("right_wall",))], threads=1)
    shot = np.array([[-0.225, 0.075, 0.0, 0.45]])
    positions = changed.motion(np.append(cell().defaults, numbers)[None], shot, 1.2).positions[0]
    return np.asarray(positions[:, 3] + 0.225 - RADIUS)


def test_a_wall_that_stands_elsewhere_shifts_the_bounce() -> None:
    plain, away, near = (right_wall(np.array([offset, 0.0])) for offset in (0.0, 0.004, -0.004))
    assert away.min() - plain.min() == pytest.approx(-0.004, abs=1e-4)
    assert near.min() - plain.min() == pytest.approx(0.004, abs=1e-4)
    touch = int(np.argmax(plain < 0.005))
    assert (away[:touch] == plain[:touch]).all()


def test_a_soft_wall_is_entered_deeper() -> None:
    plain, soft = (right_wall(np.array([0.0, softness])).min() for softness in (0.0, -1.0))
    assert soft < 1.3 * plain < 0


def test_one_wall_alone_changes() -> None:
    model = copy.copy(simulator().physics.model)
    data = mujoco.MjData(model)
    with attach(model, data, exported("local_wall", (0.01, -0.5), ("obstacle",))):
        assert model.geom("obstacle").pos[0] == pytest.approx(0.1 - 0.01)  # its thinner side lies along x
        bar = model.geom("obstacle").id
        own = (model.pair_geom1 == bar) | (model.pair_geom2 == bar)
        np.testing.assert_allclose(model.pair_solref[:, 0], np.where(own, -10000 * np.exp(-0.5), -10000))
    assert model.geom("obstacle").pos[0] == 0.1


@pytest.mark.parametrize("arm", [0.0, 0.02])
@pytest.mark.parametrize(("place", "sign"), [((0.0, 0.003), 1.0), ((0.0, -0.003), -1.0)])
def test_a_push_beside_the_centre_of_mass_turns_the_puck(place: tuple[float, float], sign: float, arm: float) -> None:
    """A straight push along x through the centre of the rim: spin = offset x momentum / inertia."""
    heavy = Simulator(cell(), [Attached(EFFECTS["off_centre_mass"], ("puck1",))], threads=1)
    given = np.concatenate([values()[0], place, [arm]])
    time = np.linspace(0.0, 0.4, 401)
    puck = heavy.bodies(given, np.array([-0.24, 0.0, 0.0, 0.5]), time)["puck1"]
    rate, speed = np.gradient(puck[:, 2], time)[-1], np.gradient(puck[:, 0], time)
    strike = int(np.argmax(speed))
    turning = np.gradient(puck[:, 2], time)[strike]
    assert np.sign(rate) == sign
    centre_speed = speed[strike] - turning * place[1]  # of the centre of mass
    inertia = INERTIA + MASS * 0.003 * arm
    assert turning == pytest.approx(place[1] * MASS * centre_speed / inertia, rel=0.05)


def test_a_mass_that_mujoco_compiled_as_centred_cannot_be_moved() -> None:
    model = wall()
    with pytest.raises(ConfigError, match="compiled it as centred for good"):
        attach(model, mujoco.MjData(model), exported("off_centre_mass", (0.001, 0.0, 0.0)))


def test_the_other_friction_cone_changes_contacts_with_friction() -> None:
    """A box that slides on the diagonal of its contact frame: there the pyramid holds 1 / sqrt(2) of the friction."""
    model = mujoco.MjModel.from_xml_string("""
        <mujoco><option timestep="0.001" cone="elliptic"/><worldbody><geom type="plane" size="9 9 1" friction="0.3"/>
        <body name="box" pos="0 0 0.05"><freejoint/><geom type="box" size="0.1 0.1 0.05" friction="0.3"/></body>
        </worldbody></mujoco>""")

    def slid(other: float) -> float:
        data = mujoco.MjData(model)
        data.qvel[:2] = 1.0
        with attach(model, data, exported("friction_cone", (other,), ())):
            mujoco.mj_step(model, data, nstep=200)
        return float(np.hypot(*data.qvel[:2]))

    loss = 0.3 * 9.81 * 0.2
    assert slid(0.0) == pytest.approx(np.sqrt(2) - loss, rel=0.01)
    assert slid(1.0) == pytest.approx(np.sqrt(2) - loss / np.sqrt(2), rel=0.01)
    assert slid(0.4) == slid(0.0)
    assert model.opt.cone == mujoco.mjtCone.mjCONE_ELLIPTIC
