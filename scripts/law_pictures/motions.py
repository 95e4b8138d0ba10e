"""Motions, simulated without a law and with it, by `attach` on a plain MuJoCo model."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import mujoco
import numpy as np
from matplotlib.axes import Axes

from compass_ros.cells.rotors import add_rotors
from compass_ros.reporting.palette import LIGHT
from compass_ros.simulation.effects import Attached, Effect, Exported, FittedEffect, attach
from compass_ros.simulation.sizes import unit_joint
from compass_ros.types import Floats
from scripts.law_pictures.axes import SLIDING, WITH, WITHOUT, Draw, both, labelled

PUCK = """<mujoco><option timestep="0.0005" integrator="implicitfast"/>
  <default><geom contype="0" conaffinity="0" condim="1"/></default><worldbody>
  <geom name="wall" type="plane" size="1 1 0.1" pos="0.3 0 0" zaxis="-1 0 0"/>
  <body name="puck"><joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/>
    <joint type="hinge" axis="0 0 1"/><inertial pos="0 1e-6 0" mass="0.03" diaginertia="5e-6 5e-6 9.75e-6"/>
    <geom name="puck" type="sphere" size="0.0255"/></body></worldbody>
  <contact><pair geom1="wall" geom2="puck" condim="1" solref="-10000 -10" solimp="0.01 0.95 0.006 0.5 2"/></contact>
  </mujoco>"""
BALL = """<mujoco><option timestep="0.0005" integrator="implicitfast"/><worldbody>
  <geom name="floor" type="plane" size="9 9 1" solref="-4000 -8"/>
  <body name="ball" pos="0 0 1"><freejoint/><geom name="ball" size="0.05" mass="0.2" solref="-4000 -8"/></body>
  </worldbody></mujoco>"""
BOX = """<mujoco><option timestep="0.001" cone="pyramidal"/><worldbody>
  <geom name="floor" type="plane" size="9 9 1" friction="0.3 0 0" condim="3"/>
  <body name="ball" pos="0 0 0.05"><freejoint/>
    <geom name="ball" type="box" size="0.1 0.1 0.05" mass="0.2" friction="0.3 0 0" condim="3"/></body>
  </worldbody></mujoco>"""
SERVO = """<mujoco><option timestep="0.001" integrator="implicitfast"/><worldbody>
  <body name="link"><joint name="joint" axis="0 1 0" damping="0.05" armature="0.02"/>
    <geom type="capsule" fromto="0 0 0 0.3 0 0" size="0.02" mass="0.4" contype="0" conaffinity="0"/></body>
  </worldbody>
  <actuator><position name="servo" joint="joint" kp="12" kv="0.6"/></actuator></mujoco>"""
PENDULUM = """<mujoco><option timestep="0.001" integrator="implicitfast"/><worldbody>
  <body name="link"><joint name="joint" axis="0 1 0" damping="0.004"/>
    <geom type="capsule" fromto="0 0 0 0 0 -0.3" size="0.02" mass="0.4" contype="0" conaffinity="0"/></body>
  </worldbody></mujoco>"""
PAIR = """<mujoco><option gravity="0 0 0"/><worldbody>
  <body name="post"><geom size="0.01" contype="0" conaffinity="0"/></body>
  <body name="ball"><freejoint/><geom name="ball" size="0.02" mass="0.1" contype="0" conaffinity="0"/></body>
  </worldbody></mujoco>"""


def play(
    scene: str,
    laws: Sequence[tuple[Effect, Sequence[float], tuple[str, ...]]],
    seconds: float,
    qpos: Sequence[float] = (),
    qvel: Sequence[float] = (),
    told: Callable[[float], float] | None = None,
    slides: bool = False,
    rotor: bool = False,
) -> tuple[Floats, Floats, Floats]:
    """(T,) times, (T, nq) positions, (T, nv) velocities of a plain model with laws attached."""
    spec = mujoco.MjSpec.from_string(scene)
    if rotor:
        add_rotors(spec, ["joint"])
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qpos[: len(qpos)], data.qvel[: len(qvel)] = qpos, qvel
    given = tuple(FittedEffect(Attached(law, on), tuple(numbers), (0.0,) * len(numbers)) for law, numbers, on in laws)
    rows = []
    with attach(model, data, Exported(given, {"puck": SLIDING} if slides else {})):
        while data.time < seconds:
            if told is not None:
                data.ctrl[0] = told(data.time)
            mujoco.mj_step(model, data)
            rows.append([data.time, *data.qpos, *data.qvel])
    every = max(len(rows) // 150, 1)
    time, position, velocity = np.split(np.array(rows)[::every], [1, 1 + model.nq], axis=1)
    return time[:, 0], position, velocity


def sized(law: Effect) -> Effect:
    """A law on a hinge in its own units."""
    return law.at(unit_joint("hinge")) if law.on_joint is not None else law


def puck(
    numbers: Sequence[float],
    shots: Sequence[tuple[Sequence[float], Sequence[float]]],
    seconds: float = 1.2,
    on: tuple[str, ...] = ("puck",),
    show: str = "path",
) -> Draw:
    """Shots of a puck, each a first position and velocity."""

    def draw(axes: Axes, law: Effect) -> None:
        for begin, push in shots:
            for laws, style in (((), WITHOUT), (((law, numbers, on),), WITH)):
                time, position, velocity = play(PUCK, laws, seconds, begin, push, slides=True)
                if show == "path":
                    axes.plot(position[:, 0], position[:, 1], **style)
                else:
                    shown = np.hypot(velocity[:, 0], velocity[:, 1]) if show == "speed" else position[:, 0]
                    axes.plot(time, shown, **style)
        if show == "path":
            axes.axvline(0.3, color=LIGHT["ink"], lw=1) if max(b[0] + v[0] for b, v in shots) > 0.6 else None
            axes.set_aspect("equal", adjustable="datalim")
        words = {"path": ("x [m]", "y [m]"), "speed": ("time [s]", "speed [m/s]"), "x": ("time [s]", "x [m]")}
        labelled(axes, *words[show])

    return draw


def ball(
    numbers: Sequence[float],
    on: tuple[str, ...] = ("ball",),
    push: Sequence[float] = (),
    axes_shown: tuple[int | None, int] = (None, 2),
    seconds: float = 1.6,
    begin: Sequence[float] = (0, 0, 1),
    scene: str = BALL,
) -> Draw:
    """A ball that is thrown or dropped: a coordinate over time, or over another."""

    def draw(axes: Axes, law: Effect) -> None:
        across, up = axes_shown
        for laws, style in (((), WITHOUT), (((law, numbers, on),), WITH)):
            time, position, _ = play(scene, laws, seconds, begin, push)
            axes.plot(time if across is None else position[:, across], position[:, up], **style)
        labelled(axes, "time [s]" if across is None else f"{'xyz'[across]} [m]", f"{'xyz'[up]} [m]")

    return draw


def step(time: float) -> float:
    """What a servo is told: half a radian after 0.1 s, and back."""
    return -0.6 if 0.1 < time < 0.9 else 0.0


def servo(
    numbers: Sequence[float],
    on: tuple[str, ...] = ("joint",),
    rotor: bool = False,
    told: Callable[[float], float] = step,
    scene: str = SERVO,
) -> Draw:
    """A link on a position servo."""

    def draw(axes: Axes, law: Effect) -> None:
        for laws, style in (((), WITHOUT), (((sized(law), numbers, on),), WITH)):
            time, position, _ = play(scene, laws, 1.6, (), (), told, rotor=rotor)
            axes.plot(time, position[:, 0], **style)
        labelled(axes, "time [s]", "angle [rad]")

    return draw


def wave(time: float) -> float:
    return -0.2 + 0.25 * float(np.sin(2 * np.pi * time / 0.8))


def pendulum(numbers: Sequence[float], on: tuple[str, ...] = ("link",)) -> Draw:
    """A link that swings."""

    def draw(axes: Axes, law: Effect) -> None:
        for laws, style in (((), WITHOUT), (((law, numbers, on),), WITH)):
            time, position, _ = play(PENDULUM, laws, 4.0, (0.8,))
            axes.plot(time, position[:, 0], **style)
        labelled(axes, "time [s]", "angle [rad]")

    return draw


def heavier(axes: Axes, law: Effect) -> None:
    """A number of the scene that is wrong: the link's centre of mass is further out."""
    shifted = PENDULUM.replace("0 0 0 0 0 -0.3", "0 0 0 0 0 -0.36")
    for scene, style in ((PENDULUM, WITHOUT), (shifted, WITH)):
        time, position, _ = play(scene, (), 4.0, (0.8,))
        axes.plot(time, position[:, 0], **style)
    labelled(axes, "time [s]", "angle [rad]")


def apart(numbers: Sequence[float]) -> Draw:
    """Force between two bodies over their distance."""

    def draw(axes: Axes, law: Effect) -> None:
        model = mujoco.MjModel.from_xml_string(PAIR)
        data, away = mujoco.MjData(model), np.linspace(0.02, 0.5, 121)
        force = np.zeros_like(away)
        fitted = FittedEffect(Attached(law, ("post", "ball")), tuple(numbers), (0.0,) * len(numbers))
        with attach(model, data, Exported((fitted,), {})):
            for i, x in enumerate(away):
                data.qpos[0] = x
                mujoco.mj_forward(model, data)
                force[i] = -data.qfrc_passive[0]
        both(axes, away, 0 * away, force)
        labelled(axes, "distance [m]", "pull [N]")

    return draw


# Commands and sensors, by their hooks.
