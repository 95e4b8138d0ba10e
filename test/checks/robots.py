"""Seven small robots of many sizes, and clean recordings of them: simulated truth with a sensor's noise."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import mujoco
import numpy as np

from compass_ros.cells import Cell, load
from compass_ros.types import QUANTITY_SIZE, Episode, Floats, Quantity, Track

FIRST_NS = 1_700_000_000_000_000_000
SECONDS = 3.2

_HEAD = '<mujoco><option timestep="0.002" integrator="implicitfast"/><worldbody>{}</worldbody>{}</mujoco>'
_LINK = (
    '<body name="{name}" pos="0 0 {z}"><joint name="{name}" axis="0 1 0" damping="{d}"{more}/>'
    '<geom type="capsule" fromto="0 0 0 0 0 -{l}" size=".02" mass="{m}"/>{inner}</body>'
)


@dataclass(frozen=True)
class Robot:
    """A scene of a size, and how it moves by itself."""

    scene: str
    objects: tuple[tuple[str, Quantity], ...]
    qpos: Floats
    """(2, nq) least and largest first state."""
    qvel: Floats
    """(2, nv)."""
    noise: float
    """Of one number [m or rad]."""
    parameter: str
    """Field of the scene, and of what, that a cell may tune."""
    action: str = ""
    """The actuator's joint, where it has one."""


def pendulum(rng: np.random.Generator) -> Robot:
    length = rng.uniform(0.1, 1.0)
    link = _LINK.format(name="swing", z=2, d=0.02 * length**2, l=length, m=rng.uniform(0.2, 2), more="", inner="")
    first = np.array([[0.4], [1.4]])
    return Robot(_HEAD.format(link, ""), (("swing", "joint"),), first, np.zeros((2, 1)), 1e-3, "dof_damping/swing")


def rotor(rng: np.random.Generator) -> Robot:
    """A disc that spins down: a continuous joint."""
    mass = rng.uniform(0.2, 3)
    disc = (
        f'<body name="disc" pos="0 0 1"><joint name="spin" axis="0 0 1" damping="{0.004 * mass}"/>'
        f'<geom type="cylinder" size=".1 .01" mass="{mass}"/></body>'
    )
    first, speed = np.array([[-3.0], [3.0]]), np.array([[3.0], [9.0]])
    return Robot(_HEAD.format(disc, ""), (("spin", "joint"),), first, speed, 1e-3, "dof_damping/spin")


def slider(rng: np.random.Generator) -> Robot:
    """A carriage on a rail between springs."""
    mass, reach = rng.uniform(0.5, 5), rng.uniform(0.1, 1.0)
    body = (
        f'<body name="cart"><joint name="rail" type="slide" axis="1 0 0" range="{-reach} {reach}" limited="true" '
        f'stiffness="{30 * mass}" damping="{0.6 * mass}"/><geom type="box" size=".05 .05 .05" mass="{mass}"/></body>'
    )
    first = reach * np.array([[0.3], [0.9]])
    return Robot(_HEAD.format(body, ""), (("rail", "joint"),), first, np.zeros((2, 1)), 5e-4, "dof_damping/rail")


def arm(rng: np.random.Generator) -> Robot:
    """Two links; the elbow has a range."""
    length, mass = rng.uniform(0.15, 0.5), rng.uniform(0.2, 1.0)
    damping = 0.15 * mass * length**2
    more = ' range="-2.8 2.8" limited="true"'
    inner = _LINK.format(name="elbow", z=-length, d=damping, l=length, m=mass, more=more, inner="")
    links = _LINK.format(name="shoulder", z=2, d=2 * damping, l=length, m=mass, more="", inner=inner)
    first = np.array([[0.3, -0.9], [1.2, 0.9]])
    objects: tuple[tuple[str, Quantity], ...] = (("shoulder", "joint"), ("elbow", "joint"))
    return Robot(_HEAD.format(links, ""), objects, first, np.zeros((2, 2)), 1e-3, "dof_damping/elbow")


def cube(rng: np.random.Generator) -> Robot:
    """A box that is thrown and tumbles; it falls for the whole recording."""
    half = rng.uniform(0.02, 0.1)
    body = f'<body name="cube" pos="0 0 1"><freejoint/><geom type="box" size="{half} {half} {half}" mass="0.2"/></body>'
    first = np.array([[-0.2, -0.2, 1, -1, -1, -1, -1], [0.2, 0.2, 1.5, 1, 1, 1, 1]])
    speed = np.array([[-2, -2, 6, -6, -6, -6], [2, 2, 9, 6, 6, 6]], float)
    return Robot(_HEAD.format(body, ""), (("cube", "pose"),), first, speed, 1e-3, "opt.gravity[2]/")


def puck(rng: np.random.Generator) -> Robot:
    """It slides on a table between two walls."""
    wide = rng.uniform(0.4, 1.0)
    walls = "".join(
        f'<geom type="box" size=".02 2 .1" pos="{side * wide} 0 0" solref="0.01 0.2"/>' for side in (-1.0, 1.0)
    )
    body = (
        '<body name="puck"><joint type="slide" axis="1 0 0" damping=".05"/><joint type="slide" axis="0 1 0" '
        'damping=".05"/><geom type="cylinder" size=".03 .02" mass=".2"/></body>'
    )
    first, speed = np.array([[-0.1, -0.1], [0.1, 0.1]]), np.array([[-1.2, -0.6], [1.2, 0.6]])
    return Robot(_HEAD.format(walls + body, ""), (("puck", "xy"),), first, speed, 1e-3, "body_mass/puck")


def servo(rng: np.random.Generator) -> Robot:
    """A joint that is driven to a goal."""
    mass = rng.uniform(0.05, 0.5)
    body = (
        '<body name="horn"><joint name="axis" axis="0 0 1" armature="0.005"/>'
        f'<geom type="box" size=".1 .01 .005" pos=".1 0 0" mass="{mass}"/></body>'
    )
    gain = 80 * (mass * 0.0133 + 0.005)
    drive = f'<actuator><position name="xm" joint="axis" kp="{gain}" kv="{gain / 9}"/></actuator>'
    first = np.array([[-1.2], [1.2]])
    return Robot(
        _HEAD.format(body, drive), (("axis", "joint"),), first, np.zeros((2, 1)), 1e-3, "servo_gain/xm", action="axis"
    )


ROBOTS = {one.__name__: one for one in (pendulum, rotor, slider, arm, cube, puck, servo)}
PASSIVE = tuple(name for name in ROBOTS if name != "servo")


def make(name: str, seed: int = 0) -> Robot:
    """A robot of some size."""
    return ROBOTS[name](np.random.default_rng(seed))


def cell(name: str, folder: Path, seed: int = 0, horizon: int = 60) -> Cell:
    """Its cell, written into a folder and loaded."""
    robot = make(name, seed)
    (folder / f"{name}.xml").write_text(robot.scene)
    field, _, of = robot.parameter.partition("/")
    model = mujoco.MjModel.from_xml_string(robot.scene)
    true = {
        "dof_damping": lambda: 0.6 * float(model.joint(of).damping[0]),
        "servo_gain": lambda: float(model.actuator_gainprm[0, 0]),
        "body_mass": lambda: 0.2,
        "opt.gravity[2]": lambda: -9.81,
    }
    value = true[field]()
    low, high = sorted((0.2 * value, 3 * value))
    lines = [
        f"name: {name}",
        "dynamics: mjcf",
        f"model: {name}.xml",
        "control_dt_s: 0.05",
        f"horizon: {horizon}",
        "objects:",
        *(f"  - {{name: {o}, quantity: {q}}}" for o, q in robot.objects),
        f"factors: [{', '.join(o for o, _ in robot.objects)}]",
        "parameters:",
        f"  - {{name: a@dyna@b, field: '{field}', of: '{of}', unit: '1', default: {value},",
        f"     bounds: [{low}, {high}], half_width: {abs(value) / 5}}}",
    ]
    if robot.action:
        lines += [
            "action:",
            "  - {name: start, unit: rad, low: -1.5, high: 1.5, field: qpos, of: axis}",
            "  - {name: goal, unit: rad, low: -1.5, high: 1.5, field: ctrl, of: xm}",
        ]
    else:
        noise = "{position: 0.002, velocity: 0.05}"
        lines += ["start:", *(f"  - {{object: {o}, velocity: track, noise: {noise}}}" for o, _ in robot.objects)]
    (folder / f"{name}.yaml").write_text("\n".join(lines) + "\n")
    return load(folder / f"{name}.yaml")


def record(
    name: str, seed: int = 0, episodes: int = 8, rate: float = 60.0, noise: float = 1.0, step: float = 0.0
) -> list[Episode]:
    """Clean recordings; `noise` in parts of the robot's own, `step` [rad or m] of an encoder of joints."""
    robot, rng = make(name, seed), np.random.default_rng(seed + 1000)
    model = mujoco.MjModel.from_xml_string(robot.scene)
    return [_episode(robot, model, i, rng, rate, noise, step) for i in range(episodes)]


def _episode(
    robot: Robot, model: mujoco.MjModel, index: int, rng: np.random.Generator, rate: float, noise: float, step: float
) -> Episode:
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = rng.uniform(*robot.qpos), rng.uniform(*robot.qvel)
    if model.nq == 7:
        data.qpos[3:] /= np.linalg.norm(data.qpos[3:])
    action = {}
    if robot.action:
        data.ctrl[0] = rng.uniform(-1.2, 1.2)
        action = {"start": float(data.qpos[0]), "goal": float(data.ctrl[0])}
    time = np.arange(0, SECONDS, 1 / rate)
    rows = np.zeros((len(time), model.nq))
    for row, moment in zip(rows, time, strict=True):
        while data.time < moment - 1e-9:
            mujoco.mj_step(model, data)
        row[:] = data.qpos
    start_ns = FIRST_NS + index * 10**11
    stamps = np.asarray(start_ns + np.round(time * 1e9), np.int64)
    tracks, column = [], 0
    for object_name, quantity in robot.objects:
        size = QUANTITY_SIZE[quantity]
        value = rows[:, column : column + size] + noise * robot.noise * rng.normal(size=(len(time), size))
        if quantity == "pose":
            value[:, 3:] /= np.linalg.norm(value[:, 3:], axis=1, keepdims=True)
        if step and quantity == "joint":
            value = step * np.round(value / step)
        tracks.append(Track(object_name, quantity, stamps, value))
        column += size
    return Episode(f"{index:02d}", "", "", action, start_ns, tuple(tracks))


def changed(episode: Episode, index: int = 0, **fields: object) -> Episode:
    """The episode with one of its tracks changed."""
    tracks = list(episode.tracks)
    tracks[index] = replace(tracks[index], **fields)  # type: ignore[arg-type]
    return replace(episode, tracks=tuple(tracks))
