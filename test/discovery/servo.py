"""A servo with a load, recorded as step responses with physics that its model lacks, in any unit of force."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from compass_ros.cells import Cell
from compass_ros.simulation import Simulator
from compass_ros.simulation.effects import Attached, effect
from compass_ros.simulation.sizes import unit_joint
from compass_ros.types import Episode, Floats, Ints, Track
from test.cells.written import content, parameter, written

START = 1_700_000_000_000_000_000
NOISE = 5e-4
TRUTH = {"axis@dyna@damping": 0.12, "axis@dyna@armature": 0.02}


def servo(folder: Path, force: float = 1.0, dry: float = 0.0) -> Cell:
    """A bar on a hinge under a position servo; `force`: newton metres in units of force; `dry` friction [N m]."""
    scene = f"""<mujoco><option timestep="0.002" integrator="implicitfast"/><worldbody>
        <body name="horn"><joint name="axis" axis="0 1 0" damping="{0.1 * force}" armature="{0.018 * force}"
        frictionloss="{dry * force}"/>
        <geom type="box" size="0.1 0.01 0.005" pos="0.1 0 0" mass="{0.1 * force}"/></body></worldbody>
        <actuator><position name="motor" joint="axis" kp="{6 * force}" kv="{0.1 * force}"/></actuator></mujoco>"""
    action = [
        {"name": "start", "unit": "rad", "low": -1.5, "high": 1.5, "field": "qpos", "of": "axis"},
        {"name": "goal", "unit": "rad", "low": -1.5, "high": 1.5, "field": "ctrl", "of": "motor"},
    ]
    tuned = [
        parameter("axis@dyna@damping", "dof_damping", "axis", 0.1 * force, 0.03 * force),
        parameter("axis@dyna@armature", "dof_armature", "axis", 0.018 * force, 0.004 * force),
    ]
    for one in tuned:
        one["bounds"] = [0.0, 10 * float(str(one["default"]))]
    made = content([{"name": "axis", "quantity": "joint"}], tuned, action=action, noise_m=2 * NOISE, horizon=60)
    return written(folder, scene, made)


def on_axis(name: str) -> Attached:
    """A law on the servo's joint."""
    return Attached(effect(name).at(unit_joint("hinge")), ("axis",))


def recorded(
    cell: Cell, laws: Sequence[Attached], numbers: Sequence[float], force: float = 1.0, count: int = 12, seed: int = 5
) -> list[Episode]:
    """Steps of the command at 60 Hz, from a servo that has laws with numbers in units of `force`."""
    steps = np.random.default_rng(seed).uniform(-1.2, 1.2, (count, 2))
    truth = cell.values({name: force * value for name, value in TRUTH.items()})
    return noisy(Simulator(cell, laws, threads=1), [*truth, *numbers], steps, 1.2, NOISE, seed)


def noisy(
    simulator: Simulator, values: Sequence[float], inputs: Floats, seconds: float, noise: float, seed: int
) -> list[Episode]:
    """Episodes of joints at 60 Hz with white noise, from a cell whose inputs are its action."""
    cell, count = simulator.cell, len(inputs)
    stamps = START + np.round(np.arange(0, seconds, 1 / 60) * 1e9).astype(np.int64)
    time = np.tile((stamps - START) * 1e-9, (count, 1))
    seen = simulator.observe(np.tile(values, (count, 1)), inputs, time)
    return as_episodes(cell, inputs, stamps, seen + np.random.default_rng(seed).normal(0, noise, seen.shape), "step")


def as_episodes(cell: Cell, inputs: Floats, stamps: Ints, seen: Floats, name: str) -> list[Episode]:
    """Episodes `name`00, `name`01, ... of (E, A) actions, with (E, F, C) of all signals seen at (F,) stamps [ns]."""
    return [
        Episode(
            name=f"{name}{i:02d}",
            cell=cell.name,
            cell_hash=cell.hash,
            action={a.name: float(x) for a, x in zip(cell.action, inputs[i], strict=True)},
            start_ns=START,
            tracks=tuple(Track(s.name, s.quantity, stamps, seen[i][:, s.columns]) for s in cell.signals),
        )
        for i in range(len(inputs))
    ]
