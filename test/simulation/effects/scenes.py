"""Plain MuJoCo scenes without contacts, on which exported effects are attached, and an integrator to compare with."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import mujoco
import numpy as np

from compass_ros.cells.dynamics import Sliding
from compass_ros.simulation.effects import Attached, Exported, FittedEffect, attach, effect
from compass_ros.types import Floats

GRAVITY, CREEP, INERTIA = 9.81, 0.002, 0.05
Acceleration = Callable[[float, Floats, Floats], Floats]
"""(time, position, velocity) -> acceleration."""

_JOINTS = {
    "planar": '<joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/><joint type="hinge" axis="0 0 1"/>',
    "sliding": '<joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/>',
    "free": "<freejoint/>",
    "hinge": '<joint name="hinge" type="hinge" axis="0 0 1"/>',
}


def scene(kind: str, time_step: float = 2e-4, centre: str = "0 0 0") -> mujoco.MjModel:
    """One body `puck` of 0.03 kg, its mass at `centre`: planar (with yaw), sliding (without), free, or on a hinge."""
    gravity = 0 if kind == "free" else -GRAVITY
    return mujoco.MjModel.from_xml_string(f"""
        <mujoco><option timestep="{time_step}" gravity="0 0 {gravity}"/>
          <worldbody><body name="puck">{_JOINTS[kind]}
            <inertial pos="{centre}" mass="0.03" diaginertia="5e-6 5e-6 9e-6"/></body></worldbody></mujoco>""")


def exported(
    name: str, numbers: Sequence[float], objects: tuple[str, ...] = ("puck",), slide: bool = False
) -> Exported:
    """One effect; with `slide` the puck lies with its full weight on a table without friction of its own."""
    table = Sliding("puck", np.zeros(1), np.array([CREEP]), np.ones(1))
    fitted = FittedEffect(Attached(effect(name), objects), tuple(numbers), (0.0,) * len(numbers))
    return Exported((fitted,), {"puck": table} if slide else {})


def moved(model: mujoco.MjModel, given: Exported, position: Floats, velocity: Floats, seconds: float) -> Floats:
    """Positions, then velocities after some seconds with the effects attached."""
    data = mujoco.MjData(model)
    data.qpos[: len(position)] = position
    data.qvel[: len(velocity)] = velocity
    with attach(model, data, given):
        mujoco.mj_step(model, data, nstep=round(seconds / model.opt.timestep))
    return np.concatenate([data.qpos[: len(position)], data.qvel[: len(velocity)]])


def axis(actuator: str = "", kind: str = "hinge", step: float = 1e-4) -> mujoco.MjModel:
    """A joint of inertia (or mass) 0.05 without weight, and what drives it."""
    return mujoco.MjModel.from_xml_string(
        f'<mujoco><option timestep="{step}" gravity="0 0 0" integrator="implicitfast"/><worldbody><body>'
        f'<joint name="axis" type="{kind}" axis="0 0 1"/><inertial pos="0 0 0" mass="0.05" diaginertia=".05 .05 .05"/>'
        f"</body></worldbody><actuator>{actuator}</actuator></mujoco>"
    )


def laws(*given: tuple[str, tuple[float, ...], str]) -> Exported:
    return Exported(tuple(FittedEffect(Attached(effect(n), (on,)), numbers, ()) for n, numbers, on in given), {})


def swung(
    model: mujoco.MjModel, given: Exported, start: tuple[float, float], seconds: float, told: float = 0.0
) -> Floats:
    """(2,) position and rate after some seconds."""
    data = mujoco.MjData(model)
    data.qpos[0], data.qvel[0] = start
    if model.nu:
        data.ctrl[0] = told
    with attach(model, data, given):
        mujoco.mj_step(model, data, nstep=round(seconds / model.opt.timestep))
    return np.array([data.qpos[0], data.qvel[0]])


def flown(acceleration: Acceleration, position: Floats, velocity: Floats, seconds: float, steps: int = 4000) -> Floats:
    """The same by the classical Runge-Kutta method, fourth order, from a formula."""
    size, h = len(position), seconds / steps
    y = np.concatenate([position, velocity])

    def rate(time: float, state: Floats) -> Floats:
        return np.concatenate([state[size:], acceleration(time, state[:size], state[size:])])

    for i in range(steps):
        t = i * h
        k1 = rate(t, y)
        k2 = rate(t + h / 2, y + h / 2 * k1)
        k3 = rate(t + h / 2, y + h / 2 * k2)
        k4 = rate(t + h, y + h * k3)
        y = y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    return y
