"""Small scenes for laws on gears, drives, sensors and pairs: an arm on servos, two balls, a foot on a pad."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from compass_ros.cells import Cell
from compass_ros.discovery.candidates import Candidate, candidates
from compass_ros.simulation import Simulator
from compass_ros.types import Episode, Floats
from test.cells.written import content, parameter, written
from test.discovery.servo import START, as_episodes


def arm(folder: Path) -> Cell:
    """Two links on geared position servos, one message of encoders; friction, rotors and gains are tuned."""
    scene = """<mujoco><option timestep="0.002" integrator="implicitfast"/><worldbody>
      <body name="upper"><joint name="s" axis="0 1 0" damping="0.1" armature="0.02" frictionloss="0.02"/>
        <inertial pos="0 0 -0.15" mass="0.8" diaginertia="4e-3 4e-3 1e-3"/>
        <body name="fore" pos="0 0 -0.3">
          <joint name="e" axis="0 1 0" damping="0.05" armature="0.01" frictionloss="0.01"/>
          <inertial pos="0.02 0 -0.12" mass="0.5" diaginertia="2e-3 2e-3 1e-3"/></body></body></worldbody>
      <actuator><position name="ds" joint="s" kp="12" kv="0.4"/>
      <position name="de" joint="e" kp="5" kv="0.2"/></actuator>
      </mujoco>"""
    action = [
        {"name": f"{what}_{joint}", "unit": "rad", "low": -1.2, "high": 1.2, "field": field, "of": of + joint}
        for joint in "se"
        for what, field, of in (("from", "qpos", ""), ("to", "ctrl", "d"))
    ]
    tuned = [
        parameter(f"{j}@dyna@{what}", f"dof_{what}", j, size, 0.1 * size)
        for j, sizes in (("s", (0.1, 0.02, 0.02)), ("e", (0.05, 0.01, 0.01)))
        for what, size in zip(("damping", "armature", "frictionloss"), sizes, strict=True)
    ]
    signals = [{"name": "joints", "quantity": "joint_position", "of": ["s", "e"], "noise": 1e-3}]
    made = content([], tuned, action=action, noise_m=1e-3, signals=signals, horizon=60, factors=[])
    return written(folder, scene, made)


def steps(cell: Cell, count: int, seed: int = 2) -> Floats:
    """(count, A) steps of the command, each its own way."""
    return np.random.default_rng(seed).uniform(-1.0, 1.0, (count, len(cell.input_names)))


def balls(folder: Path) -> Cell:
    """Two balls in the air without weight, seen by a camera."""
    body = '<body name="{0}"><freejoint name="{0}"/><geom name="{0}" size=".03" mass="{1}"/></body>'
    scene = f"""<mujoco><option timestep="0.002" gravity="0 0 0"/><worldbody>{body.format("red", 0.2)}
      {body.format("blue", 0.3)}</worldbody></mujoco>"""
    objects = [{"name": name, "quantity": "xyz"} for name in ("red", "blue")]
    return written(folder, scene, content(objects, start=[{"object": n} for n in ("red", "blue")], noise_m=1e-3))


def passing(count: int, seed: int = 3) -> Floats:
    """(count, 12) ways in which they pass each other."""
    rng = np.random.default_rng(seed)
    rows = []
    for _ in range(count):
        at, speed = rng.uniform(-0.3, 0.3, (2, 3)), rng.uniform(-0.4, 0.4, (2, 3))
        at[:, 0] += [-0.2, 0.2]
        rows.append(np.concatenate([at[0], speed[0], at[1], speed[1]]))
    return np.array(rows)


def bowl(folder: Path) -> Cell:
    """A ball that rolls on a floor, slow enough to roll without slip."""
    scene = """<mujoco><option timestep="0.002"/><worldbody><geom name="floor" type="plane" size="9 9 1"/>
      <body name="ball" pos="0 0 0.05"><freejoint name="ball"/>
      <geom name="ball" size=".05" mass=".2" friction="1"/></body></worldbody></mujoco>"""
    objects = [{"name": "ball", "quantity": "xyz"}]
    return written(folder, scene, content(objects, start=[{"object": "ball"}], noise_m=1e-3))


def rolling(count: int, seed: int = 3) -> Floats:
    """(count, 6) positions and speeds on the floor."""
    rng = np.random.default_rng(seed)
    flat = np.zeros((count, 6))
    flat[:, 2], flat[:, 3:5] = 0.0499, rng.uniform(-1, 1, (count, 2))
    return flat


def sled(folder: Path) -> Cell:
    """A box that slides on a floor until it stands; its friction is tuned."""
    scene = """<mujoco><option timestep="0.002" cone="elliptic"/><worldbody>
      <geom name="floor" type="plane" size="9 9 1"/>
      <body name="sled" pos="0 0 0.02"><freejoint name="sled"/>
      <geom name="sled" type="box" size=".05 .04 .02" mass=".5" friction="0.3"/></body></worldbody>
      <contact><pair name="rub" geom1="floor" geom2="sled" condim="3" friction="0.3 0.3 0.005 0.0001 0.0001"/></contact>
      </mujoco>"""
    tuned = [parameter("rub@contact@friction", "pair_friction", "rub", 0.3, 0.05)]
    objects = [{"name": "sled", "quantity": "xyz"}]
    return written(folder, scene, content(objects, tuned, start=[{"object": "sled"}], noise_m=5e-4))


def pushes(count: int, seed: int = 5) -> Floats:
    """(count, 6) positions and speeds on the floor."""
    rng = np.random.default_rng(seed)
    flat, towards = np.zeros((count, 6)), rng.uniform(0, 2 * np.pi, count)
    speed = rng.uniform(0.4, 1.2, count)
    flat[:, 2], flat[:, 3], flat[:, 4] = 0.0199, speed * np.cos(towards), speed * np.sin(towards)
    return flat


def foot(folder: Path) -> Cell:
    """A foot on a pad that a servo lifts, slower or faster; its friction and mass are tuned."""
    scene = """<mujoco><option timestep="0.002"/><worldbody>
      <geom name="pad" type="box" size=".2 .2 .02" pos="0 0 -.02"/>
      <body name="leg" pos="0 0 .05"><joint name="lift" type="slide" axis="0 0 1" damping="1"/>
      <geom name="foot" size=".05" mass=".3"/></body></worldbody>
      <actuator><intvelocity name="motor" joint="lift" kp="200" actrange="-1 1"/></actuator></mujoco>"""
    action = [
        {"name": "start", "unit": "m", "low": -0.002, "high": 0.05, "field": "qpos", "of": "lift"},
        {"name": "rate", "unit": "m/s", "low": -0.4, "high": 0.4, "field": "ctrl", "of": "motor"},
    ]
    tuned = [
        parameter("lift@dyna@damping", "dof_damping", "lift", 1.0, 0.3),
        parameter("leg@dyna@mass", "body_mass", "leg", 0.3, 0.02),
    ]
    objects = [{"name": "lift", "quantity": "joint"}]
    return written(folder, scene, content(objects, tuned, action=action, noise_m=2e-4))


def lifts(count: int, seed: int = 4) -> Floats:
    """(count, 2) most from the pad, upwards."""
    rng = np.random.default_rng(seed)
    return np.stack([np.where(np.arange(count) % 3, -0.0005, 0.02), rng.uniform(0.03, 0.15, count)], axis=1)


def candidate(simulator: Simulator, inputs: Floats, law: str, on: tuple[str, ...]) -> Candidate:
    """A law as it is asked on a site. Raises StopIteration where it is not."""
    time_s = np.tile(np.arange(0, simulator.cell.duration, 0.01), (len(inputs), 1))
    found = candidates(simulator, simulator.defaults, inputs, time_s)
    return next(c for c in found if c.name == law and c.attached.objects == on)


def numbers(one: Candidate, sizes: dict[str, float]) -> list[float]:
    """Of a law: amplitudes in modest ones beyond where it begins, shapes as given or where a search begins."""
    return [
        q.begins + sizes.get(q.name, 0.0) * q.scale if q.amplitude else sizes.get(q.name, q.start)
        for q in one.attached.effect.quantities
    ]


def episodes(cell: Cell, inputs: Floats, one: Candidate, sizes: list[float], seed: int = 1) -> list[Episode]:
    """Recordings at 60 Hz of a cell whose numbers are a tenth off and that has a law."""
    rng, count = np.random.default_rng(seed), len(inputs)
    simulator = Simulator(cell, [one.attached], threads=1)
    values = np.append(cell.defaults * (1 + 0.1 * rng.standard_normal(len(cell.defaults))), sizes)
    stamps = START + np.round(np.arange(0, cell.duration, 1 / 60) * 1e9).astype(np.int64)
    seen = simulator.observe(np.tile(values, (count, 1)), inputs, np.tile((stamps - START) * 1e-9, (count, 1)))
    return as_episodes(cell, inputs, stamps, seen + rng.normal(0, 0.5 * cell.spec.noise_m, seen.shape), "episode")
