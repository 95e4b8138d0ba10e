"""Draws each law as it looks in data, and writes the gallery in docs/laws.md.

    python scripts/draw_laws.py                    # docs/images/laws/*.svg and the tables of docs/laws.md; some seconds
    python scripts/draw_laws.py --sheet laws.png   # all of them on one sheet, to look at

Every picture comes from the library's own formulas: forces by `evaluate`, motions by `attach` on a plain MuJoCo model,
commands and sensors by the hooks of the law. Grey, dashed: the simulator without the law; green: with it.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from compass_ros.cells.dynamics import Sliding
from compass_ros.cells.rotors import add_rotors
from compass_ros.reporting.figures import save, styled
from compass_ros.reporting.markdown import replace_between
from compass_ros.reporting.palette import LIGHT
from compass_ros.simulation.effects import EFFECTS, Attached, Effect, Exported, FittedEffect, attach, effect
from compass_ros.simulation.effects.effect import Context
from compass_ros.simulation.native.program import evaluate
from compass_ros.simulation.sites import Site
from compass_ros.simulation.sizes import unit_joint
from compass_ros.types import Floats

ROOT = Path(__file__).parents[1]
PAGE, FOLDER = ROOT / "docs" / "laws.md", ROOT / "docs" / "images" / "laws"
BEGIN, END = "<!-- gallery: begin -->\n", "<!-- gallery: end -->\n"
WITHOUT: Mapping[str, Any] = {"color": LIGHT["faint"], "ls": "--", "lw": 1.1}
WITH: Mapping[str, Any] = {"color": LIGHT["with_effects"], "lw": 1.5}
SLIDING = Sliding("puck", np.array([0.05]), np.array([0.002]), np.ones(1))
GRAVITY = 9.81
Draw = Callable[[Axes, Effect], None]


@dataclass(frozen=True)
class Picture:
    """One law: what to draw, and what one sees in it."""

    draw: Draw
    seen: str


def labelled(axes: Axes, x: str, y: str) -> None:
    axes.set_xlabel(x)
    axes.set_ylabel(y)


def both(axes: Axes, x: Floats, without: Floats, given: Floats) -> None:
    axes.plot(x, without, **WITHOUT)
    axes.plot(x, given, **WITH)


# Forces by formula.


def torque(numbers: Sequence[float], over: str = "speed", reach: float = 3.0) -> Draw:
    """On a hinge, over its speed or its angle."""

    def draw(axes: Axes, law: Effect) -> None:
        along = np.linspace(-reach, reach, 401)
        states = np.zeros((1, along.size, 6))
        states[0, :, 0 if over == "angle" else 2], states[..., 4] = along, 1.0
        context = Context((Site("hinge", ("joint",)),), {}, (), (), 1e-3)
        assert law.forces is not None
        (term,) = law.at(unit_joint("hinge")).forces(np.array([numbers]), context)  # type: ignore[misc]
        both(axes, along, 0 * along, evaluate(term, states, GRAVITY)[0, :, 0])
        labelled(axes, "speed [rad/s]" if over == "speed" else "angle [rad]", "torque [N m]")

    return draw


def on_table(law: Effect, numbers: Sequence[float], states: Floats) -> Floats:
    """(F, 2) forces on a puck of 1 kg in (F, 6) states."""
    context = Context((Site("table", ("puck",)),), {"puck": SLIDING}, (), (), 1e-3)
    assert law.forces is not None
    (term,) = law.forces(np.array([numbers]), context)
    return np.asarray(evaluate(term, states[None], GRAVITY)[0])


def field(numbers: Sequence[float]) -> Draw:
    """Arrows where a puck is pushed."""

    def draw(axes: Axes, law: Effect) -> None:
        x, y = (grid.ravel() for grid in np.meshgrid(np.linspace(-0.4, 0.4, 13), np.linspace(-0.2, 0.2, 7)))
        states = np.column_stack([x, y, 0 * x, 0 * x, 1 + 0 * x, 0 * x])
        axes.quiver(x, y, *on_table(law, numbers, states).T, color=LIGHT["with_effects"], width=0.007, pivot="mid")
        axes.set_aspect("equal")
        labelled(axes, "x [m]", "y [m]")

    return draw


def friction_along(numbers: Sequence[float]) -> Draw:
    """Deceleration of a puck that slides along x."""

    def draw(axes: Axes, law: Effect) -> None:
        x = np.linspace(-0.4, 0.4, 201)
        own = np.full_like(x, 0.05 * GRAVITY)
        states = np.column_stack([x, 0 * x, 0.5 + 0 * x, 0 * x, 1 + 0 * x, 0 * x])
        both(axes, x, own, own - on_table(law, numbers, states)[:, 0])
        axes.set_ylim(bottom=0)
        labelled(axes, "x [m]", "slows by [m/s²]")

    return draw


def by_direction(numbers: Sequence[float]) -> Draw:
    """Deceleration in each direction of motion."""

    def draw(axes: Axes, law: Effect) -> None:
        turn = np.linspace(0, 2 * np.pi, 181)
        unit = np.column_stack([np.cos(turn), np.sin(turn)])
        states = np.column_stack([0 * unit, 0.5 * unit, 1 + 0 * turn, 0 * turn])
        own = 0.05 * GRAVITY
        slows = own - np.sum(on_table(law, numbers, states) * unit, axis=1)
        axes.plot(*(own * unit).T, **WITHOUT)
        axes.plot(*(slows[:, None] * unit).T, **WITH)
        axes.set_aspect("equal")
        labelled(axes, "slows along x", "along y [m/s²]")

    return draw


# Motions, simulated without the law and with it.

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


def command(numbers: Sequence[float], told: Callable[[Floats], Floats], unit: str = "command") -> Draw:
    """What a drive makes of what it is told."""

    def draw(axes: Axes, law: Effect) -> None:
        time = np.arange(0, 2, 0.01)
        given = told(time)[None, :, None]
        assert law.controls is not None
        followed = law.controls(given, np.array([numbers]), Context((), {}, (), (), 0.01))
        both(axes, time, given[0, :, 0], followed[0, :, 0])
        labelled(axes, "time [s]", unit)

    return draw


def heading(axes: Axes, law: Effect) -> None:
    """A push in the plane, as told and as done."""
    assert law.controls is not None
    told = np.tile([0.5, 0.1], (1, 2, 1))
    done = law.controls(told, np.array([[0.2]]), Context((), {}, (), (), 0.01))
    for one, style in ((told, WITHOUT), (done, WITH)):
        axes.plot([0, one[0, 0, 0]], [0, one[0, 0, 1]], **style)
    axes.set_aspect("equal", adjustable="datalim")
    labelled(axes, "vx [m/s]", "vy [m/s]")


def jitter(axes: Axes, law: Effect) -> None:
    """The same push in eight episodes."""
    assert law.controls is not None
    episodes = np.arange(1, 9)
    spread = np.random.default_rng(1).normal(0, 0.08, episodes.size)
    done = law.controls(np.full((episodes.size, 1, 1), 0.5), spread[:, None], Context((), {}, (), (), 0.01))
    axes.plot(episodes, 0.5 + 0 * episodes, **WITHOUT)
    axes.plot(episodes, done[:, 0, 0], "o", color=LIGHT["with_effects"], ms=3.5)
    labelled(axes, "episode", "speed [m/s]")


def swing(time: Floats) -> Floats:
    return np.asarray(np.sin(2 * np.pi * time / 1.1))


def steps(time: Floats) -> Floats:
    return np.where((time > 0.3) & (time < 1.2), 1.0, 0.0)


def sensed(
    law: Effect, numbers: Sequence[float], true: Callable[[Floats], Floats], time: Floats, sites: tuple[Site, ...] = ()
) -> Floats:
    """(F, C) what a sensor with the law says of a true motion, (B, F) times -> (B, F, C)."""
    assert law.sensing is not None
    columns = true(time[None]).shape[2]
    context = Context(sites, {}, (tuple(range(columns)),), ((),), 1e-3)
    return np.asarray(law.sensing(true, np.array([numbers]), context)(time[None])[0])


def signal(numbers: Sequence[float], amplitude: float = 1.0) -> Draw:
    """A joint that swings, as it is and as it is measured."""

    def draw(axes: Axes, law: Effect) -> None:
        time = np.linspace(0, 3, 301)

        def true(at: Floats) -> Floats:
            return amplitude * swing(at)[..., None]

        both(axes, time, true(time[None])[0, :, 0], sensed(law, numbers, true, time)[:, 0])
        labelled(axes, "time [s]", "angle [rad]")

    return draw


def standing(points: Floats) -> Callable[[Floats], Floats]:
    """(F, C) points that are the same at all times."""
    return lambda _: points[None]


def over_a_turn(axes: Axes, law: Effect) -> None:
    """Error of an encoder over the angle."""
    angle = np.linspace(0, 4 * np.pi, 201)
    seen = sensed(law, [0.01, 0.02], lambda at: at[..., None], angle)[:, 0]
    both(axes, angle, 0 * angle, 1e3 * (seen - angle))
    labelled(axes, "angle [rad]", "error [mrad]")


def camera(numbers: Sequence[float], sites: tuple[Site, ...] = (), three: bool = False) -> Draw:
    """A grid of points, as it is and as it is seen."""

    def draw(axes: Axes, law: Effect) -> None:
        across, up = np.linspace(-0.4, 0.4, 9), np.linspace(-0.2, 0.2, 5)
        lines = [np.column_stack([np.full(11, x), np.linspace(-0.2, 0.2, 11)]) for x in across]
        lines += [np.column_stack([np.linspace(-0.4, 0.4, 11), np.full(11, y)]) for y in up]
        for line in lines:
            points = np.column_stack([line, np.zeros(11)]) if three else line
            seen = sensed(law, numbers, standing(points), np.zeros(11), sites)
            axes.plot(*line.T, **{**WITHOUT, "lw": 0.6})
            axes.plot(seen[:, 0], seen[:, 1], **{**WITH, "lw": 0.9})
        axes.set_aspect("equal")
        labelled(axes, "x [m]", "y [m]")

    return draw


def moving(numbers: Sequence[float]) -> Draw:
    """A puck that circles, as it is and as it is seen at each moment."""

    def draw(axes: Axes, law: Effect) -> None:
        time = np.linspace(0, 1, 201)

        def true(at: Floats) -> Floats:
            return np.stack([0.3 * np.cos(2 * np.pi * at), 0.15 * np.sin(2 * np.pi * at)], axis=2)

        here, seen = true(time[None])[0], sensed(law, numbers, true, time)
        both(axes, time, 0 * time, 1e3 * np.hypot(*(seen - here).T))
        labelled(axes, "time [s]", "error [mm]")

    return draw


THERE_AND_BACK = [((-0.4, 0.0), (0.5, 0.0)), ((-0.12, 0.1), (-0.5, 0.0))]
AT_WALL = [((0.0, -0.1), (0.8, 0.3))]
FAN = [0.6, 0.05, 0.02, 0.12, 0.5]
DROP = (0, 0, 0.6)
LOW = (0, 0, 0.16)
PICTURES: dict[str, Picture] = {
    "table_tilt": Picture(
        puck([0.0, 0.02], THERE_AND_BACK), "paths bend to one side of the table, whichever way the puck goes"
    ),
    "viscous_drag": Picture(torque([0.16]), "resists in proportion to speed; nothing at rest"),
    "quadratic_drag": Picture(torque([0.05]), "hardly there when slow, dominates when fast"),
    "crosswind": Picture(
        puck([0.0, 0.2, 1.5], THERE_AND_BACK),
        "a steady push to one side, which a fast puck feels otherwise than a slow one",
    ),
    "fan_field": Picture(field(FAN), "pushes away from a point, most at one distance"),
    "swirl": Picture(field(FAN), "pushes around a point"),
    "point_attraction": Picture(field([0.6, 0.05, 0.02, 0.1]), "pulls towards a point, as a magnet under the table"),
    "friction_patch": Picture(friction_along([0.05, 0.1, 0.0, 0.1]), "slower in one place only"),
    "friction_gradient": Picture(friction_along([0.08, 0.0]), "slower on one side of the table than on the other"),
    "anisotropic_friction": Picture(by_direction([0.02, 0.0]), "slows more along one direction than across it"),
    "stribeck_friction": Picture(torque([0.15, 0.5]), "extra friction when slow: sticks, then jerks"),
    "coulomb_friction": Picture(torque([0.1]), "the same size at every speed, against the motion; small motions stall"),
    "magnus": Picture(
        puck([0.5], THERE_AND_BACK),
        "paths curve to the same hand of the motion, so that there and back bend to opposite sides",
    ),
    "pulsating_lift": Picture(
        puck([0.04, 0.0, 2.0], [((-0.4, 0.0), (0.5, 0.0))], show="speed"),
        "the friction beats with one frequency, whatever the speed",
    ),
    "spring": Picture(torque([0.5, 0.3, 0.0], "angle"), "pulls back to one angle"),
    "asymmetric_friction": Picture(torque([0.1]), "more friction forwards than backwards"),
    "load_dependent_friction": Picture(
        servo([0.6]), "friction grows with what the drive pushes: heavy moves lag, light ones do not"
    ),
    "cogging": Picture(torque([0.05, 0.03, 6.0], "angle"), "a torque that repeats as the motor turns"),
    "joint_elasticity": Picture(
        servo([0.15, 0.02, 0.8, 0.0], rotor=True), "rings after each step, and sags under load"
    ),
    "backlash": Picture(
        servo([0.12, 0.02, 0.8], rotor=True, told=wave, scene=SERVO.replace("<option", '<option gravity="0 0 0"')),
        "free play at each reversal: late first, then too far",
    ),
    "gravity_tilt": Picture(
        ball([0.15, 0.0], push=(1.0, 0, 2.0), axes_shown=(0, 2), seconds=0.7), "everything falls slightly to one side"
    ),
    "payload": Picture(
        pendulum([0.2, 0.0, 0.0, -0.03]),
        "swings at another pace, sags more where it is held: a weight that the scene lacks",
    ),
    "wind": Picture(
        ball([-3.0, 0.0, 0.0, 0.08], push=(2.0, 0, 2.5), axes_shown=(0, 2), seconds=0.8),
        "flight is carried along with the air",
    ),
    "buoyancy": Picture(
        ball([0.15], push=(1.5, 0, 2.0), axes_shown=(0, 2), seconds=0.7), "falls less fast than it should, at any speed"
    ),
    "pair_attraction": Picture(apart([0.5, 0.1]), "two bodies pull each other, most at one distance"),
    "tether": Picture(apart([3.0, 0.25]), "nothing until the cable is taut, then it pulls"),
    "parameter": Picture(
        heavier, "a number of the scene is wrong (here a length): the period is off and the phase runs away"
    ),
    "rate_dependent_restitution": Picture(
        ball([0.6], ("ball", "floor"), begin=DROP), "fast impacts lose more than slow ones"
    ),
    "tangential_impulse": Picture(
        puck([0.3], AT_WALL, 1.0, ("wall", "puck")),
        "loses speed along the wall: comes back more straight than it should",
    ),
    "local_wall": Picture(
        puck([0.02, 0.0], [((0.0, 0.0), (0.8, 0.0))], 0.9, ("wall",), show="x"),
        "bounces too early or too late at one wall alone",
    ),
    "off_centre_mass": Picture(
        puck([0.004, 0.006, 0.02], AT_WALL, 1.0), "wobbles after a bounce and leaves at another angle"
    ),
    "friction_cone": Picture(
        ball([1.0], (), (1.0, 0.35), (0, 1), 0.8, (0, 0, 0.05), BOX),
        "slides bend: friction is not the same along the axes and across them",
    ),
    "adhesion": Picture(ball([25.0], ("ball", "floor"), begin=LOW), "bounces less high, gentle ones above all"),
    "rolling_resistance": Picture(
        ball([0.002], ("ball", "floor"), (0.6, 0, 0, 0, 12.0, 0), (None, 0), 1.6, (0, 0, 0.0499)),
        "a rolling ball comes to rest",
    ),
    "actuation_delay": Picture(command([0.15], steps), "all of the command, later"),
    "first_order_lag": Picture(command([0.15], steps), "corners of the command are rounded"),
    "velocity_saturation": Picture(command([1.6, 8.0], swing, "speed"), "fast commands are cut off, slow ones are not"),
    "dead_band": Picture(
        command([0.25], swing, "speed"),
        "too slow by a fixed amount; small commands do nothing; a servo stops short of its target and stays there",
    ),
    "heading_bias": Picture(heading, "every push is turned by the same angle"),
    "stroke_jitter": Picture(jitter, "the same command comes out differently each time"),
    "torque_saturation": Picture(
        servo([1 / 1.0], ("servo",)), "hard moves take longer and overshoot, easy ones are right"
    ),
    "rate_limit": Picture(command([0.35], steps), "steps become ramps"),
    "gain_error": Picture(command([-0.2], swing), "every command is too small or too large by the same share"),
    "hysteresis": Picture(command([0.5], swing), "flat tops, and lost motion at each reversal"),
    "camera_latency": Picture(moving([0.03]), "wrong by speed times a delay; right at rest"),
    "camera_scale": Picture(camera([-0.08, 0.0, 0.0]), "every distance is too short or too long by the same share"),
    "camera_rotation": Picture(camera([0.08, 0.0, 0.0]), "the picture is turned about the camera's axis"),
    "lens_distortion": Picture(camera([-0.8, 0.0, 0.0, 0.0]), "straight lines bend towards the edge"),
    "rolling_shutter": Picture(moving([0.0, 0.2, 0.0, 0.0]), "an error that depends on speed and on the row"),
    "tracking_lag": Picture(moving([0.03, 0.7]), "a delay that also smooths: curves are cut"),
    "clock_drift": Picture(signal([0.06]), "right at first, later and later off"),
    "latency": Picture(signal([0.15]), "all of the signal, later"),
    "scale": Picture(signal([0.15]), "every value is too large or too small by the same share"),
    "offset": Picture(signal([0.2]), "off by the same amount everywhere"),
    "rotation": Picture(
        camera([0.0, 0.0, 0.1], (Site("sensor", ("s",), columns=(0, 1, 2)),), True),
        "what is along one axis leaks into the others",
    ),
    "eccentricity": Picture(over_a_turn, "an error that repeats once a turn"),
}


def drawn(axes: Axes, name: str) -> None:
    """One law on given axes."""
    PICTURES[name].draw(axes, effect(name))


def figure_of(name: str) -> Figure:
    """The small picture of one law."""
    with styled():
        figure = Figure(figsize=(2.5, 1.55), layout="constrained")
        axes = figure.add_subplot()
        small(axes)
        drawn(axes, name)
    return figure


def small(axes: Axes) -> None:
    axes.tick_params(labelsize=6.5)
    axes.xaxis.label.set_fontsize(7)
    axes.yaxis.label.set_fontsize(7)
    axes.locator_params(nbins=4)


def gallery() -> str:
    """Markdown: a table for each channel, one line a law."""
    lines = []
    for channel in ("dynamics", "contact", "actuation", "sensing"):
        lines += [
            f"## {channel}",
            "",
            "| law | what the simulator lacks | in data | what one sees |",
            "|---|---|---|---|",
        ]
        for name, law in EFFECTS.items():
            if law.channel == channel:
                seen, picture = PICTURES[name].seen, f"![{name}](images/laws/{name}.svg)"
                lines.append(f"| `{name}`:<br>{law.sentence} | {picture} | {seen} |")
        lines.append("")
    return "\n".join(lines)


def sheet(path: Path) -> None:
    """All of them as one PNG."""
    columns = 6
    rows = -(-len(PICTURES) // columns)
    with styled():
        figure = Figure(figsize=(2.6 * columns, 1.75 * rows), layout="constrained")
        for place, name in enumerate(PICTURES):
            axes = figure.add_subplot(rows, columns, place + 1)
            small(axes)
            drawn(axes, name)
            axes.set_title(name, fontsize=8)
        save(figure, path)


def main(words: Sequence[str]) -> None:
    """Draw the sheet, or all pictures and the page."""
    if words[:1] == ["--sheet"]:
        sheet(Path(words[1]))
        return
    FOLDER.mkdir(parents=True, exist_ok=True)
    with rc_context({"svg.fonttype": "none", "path.simplify_threshold": 0.5}):
        for name in PICTURES:
            save(figure_of(name), FOLDER / f"{name}.svg")
    replace_between(PAGE, BEGIN, END, gallery())


if __name__ == "__main__":
    main(sys.argv[1:])
