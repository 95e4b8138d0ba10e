"""Friction that is a spring before it slides, against bristles that scipy integrates."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from compass_ros.cells.rotors import add_anchors
from compass_ros.errors import ConfigError
from compass_ros.simulation.effects import Attached, Exported, FittedEffect, attach, effect
from compass_ros.simulation.effects.effect import restore
from compass_ros.types import Floats

INERTIA, OWN, EXTRA, SPEED, BENT = 0.05, 0.1, 0.08, 0.2, 2e-3
DAMPING = 2 * 0.05 * np.sqrt((OWN + EXTRA) / BENT * INERTIA)
PERIOD_S = 1.0


def axis(step: float, anchored: bool = True, kind: str = "hinge") -> mujoco.MjModel:
    """A joint across gravity, of inertia (or mass) 0.05."""
    spec = mujoco.MjSpec.from_string(
        f'<mujoco><option timestep="{step}"/><worldbody><body>'
        f'<joint name="axis" type="{kind}" axis="{"0 0 1" if kind == "hinge" else "1 0 0"}" frictionloss="{OWN}"/>'
        f'<inertial pos="0 0 0" mass="{INERTIA}" diaginertia="{INERTIA} {INERTIA} {INERTIA}"/>'
        "</body></worldbody></mujoco>"
    )
    if anchored:
        add_anchors(spec, ["axis", "no joint"])
    return spec.compile()


def friction(extra: float = EXTRA, presliding: float = BENT) -> Exported:
    numbers = (extra, SPEED, presliding)
    return Exported((FittedEffect(Attached(effect("stribeck_friction"), ("axis",)), numbers, ()),), {})


def pushed(model: mujoco.MjModel, given: Exported, most: float, seconds: float) -> Floats:
    """(T,) angle after each step under a torque that swings."""
    data, out = mujoco.MjData(model), []
    with attach(model, data, given):
        while data.time < seconds - 1e-9:
            data.qfrc_applied[0] = most * np.sin(2 * np.pi / PERIOD_S * data.time)
            mujoco.mj_step(model, data)
            out.append(data.qpos[0])
    return np.array(out)


def bristled(most: float, times: Floats) -> Floats:
    """Angles at these times, of rate v, deflection z with z' = v - |v| z / z(v), as LuGre has it, its force at most
    what slides."""
    stiffness = (OWN + EXTRA) / BENT

    def change(time: float, state: Floats) -> Floats:
        _, v, z = state
        level = OWN + EXTRA * np.exp(-((v / SPEED) ** 2))
        bending = v - abs(v) * z * stiffness / level
        force = np.clip(-stiffness * z - DAMPING * bending, -level, level)
        return np.array([v, (force + most * np.sin(2 * np.pi / PERIOD_S * time)) / INERTIA, bending])

    found = solve_ivp(change, (0.0, times[-1]), np.zeros(3), "RK45", times, rtol=1e-8, atol=1e-11, max_step=1e-3)
    return np.asarray(found.y[0])


@pytest.mark.parametrize("kind", ["hinge", "slide"])
@pytest.mark.parametrize("step", [1e-3, 2e-3])
@pytest.mark.parametrize(("most", "within"), [(0.05, 0.01), (0.3, 0.01)], ids=["presliding", "sliding"])
def test_it_moves_as_bristles_do(most: float, within: float, step: float, kind: str) -> None:
    got = pushed(axis(step, kind=kind), friction(), most, 2.0)
    expected = bristled(most, step * (1 + np.arange(len(got))))
    np.testing.assert_allclose(got, expected, atol=within * np.abs(expected).max())


def test_what_is_left_when_a_small_push_ends_is_less_than_what_a_large_one_leaves() -> None:
    small, large = (pushed(axis(1e-3), friction(), most, PERIOD_S / 2)[-1] for most in (0.02, 0.15))
    assert abs(small) < 0.1 * BENT < abs(large)


@pytest.mark.parametrize("presliding", [0.0, 1e-9])
def test_a_spring_without_travel_holds(presliding: float) -> None:
    assert np.abs(pushed(axis(2e-3), friction(presliding=presliding), 0.15, 2.0)).max() < 2e-9


def test_a_shorter_spring_slides_more_and_more_like_none() -> None:
    rigid, *soft = (pushed(axis(1e-3), friction(presliding=bent), 0.3, 1.0) for bent in (0.0, 2e-3, 2e-4, 2e-5))
    off = [float(np.abs(one - rigid).max()) for one in soft]
    assert off[0] > 3 * off[1] > 3 * off[2]


def test_it_is_absent_where_friction_is_neither_higher_nor_a_spring() -> None:
    plain, none = Exported((), {}), friction(0.0, presliding=0.0)
    np.testing.assert_array_equal(pushed(axis(1e-3), none, 0.3, 1.0), pushed(axis(1e-3), plain, 0.3, 1.0))


def test_a_joint_s_own_friction_alone_is_a_spring_too() -> None:
    """F = Fc (1 - exp(-angle / presliding)), Dahl's curve, but for how the joint swings on its spring."""
    bent = pushed(axis(1e-3), friction(0.0), 0.5 * OWN, PERIOD_S / 4)[-1]
    assert bent == pytest.approx(BENT * np.log(2), rel=0.2)


def test_a_scene_without_the_anchor_is_refused_in_one_line() -> None:
    model = axis(1e-3, anchored=False)
    with pytest.raises(ConfigError, match="the scene has no anchor for joint 'axis'; simulate its cell"):
        attach(model, mujoco.MjData(model), friction())


@pytest.mark.parametrize("kind", ["hinge", "slide"])
def test_an_anchor_that_no_law_moves_stays(kind: str) -> None:
    model = axis(1e-3, kind=kind)
    data = mujoco.MjData(model)
    data.qvel[0] = 1.0
    mujoco.mj_step(model, data, nstep=1000)
    assert data.qpos[0] > 0.1
    assert data.qpos[1] == data.qvel[1] == 0.0


def test_a_model_is_given_back_as_it_was() -> None:
    model, other = axis(1e-3), axis(1e-3)
    pushed(model, friction(), 0.3, 0.1)
    restore(other, model)
    np.testing.assert_array_equal(model.jnt_range, axis(1e-3).jnt_range)
