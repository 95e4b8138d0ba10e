"""Robots for tests: chains of hinges and slides with any drives, in any units, that swing where nothing drives them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from compass_ros.calibration.cost import start
from compass_ros.calibration.differences import linearise
from compass_ros.calibration.least_squares import Fit
from compass_ros.calibration.likelihood import Likelihood
from compass_ros.cells import Cell
from compass_ros.discovery.response import Response, respond
from compass_ros.planning.planned import perfect
from compass_ros.simulation import Simulator
from compass_ros.simulation.effects import Attached
from compass_ros.types import Floats
from test.cells.written import content, parameter, written

DRIVES = {
    "position": '<position name="{name}" joint="{joint}" kp="{kp}" kv="{kv}"/>',
    "velocity": '<velocity name="{name}" joint="{joint}" kv="{kv}"/>',
    "motor": '<motor name="{name}" joint="{joint}" gear="{force}"/>',
    "intvelocity": '<intvelocity name="{name}" joint="{joint}" kp="{kp}" actrange="-3 3"/>',
    "muscle": '<muscle name="{name}" joint="{joint}" force="{force}" lengthrange="-2 2"/>',
    "general": '<general name="{name}" joint="{joint}" gaintype="affine" gainprm="{force} 0 0"/>',
}
"""What can drive a joint."""


def robot(
    folder: Path,
    joints: Sequence[str] = ("hinge",),
    drives: Sequence[str] = (),
    force: float = 1.0,
    length: float = 1.0,
    gravity: bool = True,
    tracked: int | None = None,
    step_ms: float = 1.0,
) -> Cell:
    """A chain of `hinge`s and `slide`s, each joint j0, j1, ... of a body of its own; drive d0 on j0, ...

    `force`, `length`: size of the units, so 1024 has the same robot in kilonewtons upside down: numbers 1024 as large.
    All joints are tracked, or the first ones.
    """
    mass, arm = force / length, 0.2 * length
    links, ends = "", ""
    for i, kind in enumerate(joints):
        axis = "0 1 0" if kind == "hinge" else ("1 0 0.3", "0 0 1")[i % 2]
        inertia = " ".join(f"{x * mass * length**2:g}" for x in (4e-3, 4e-3, 1e-3))
        damping = (0.02 if kind == "hinge" else 0.3 / length) * force * (length if kind == "hinge" else 1)
        links += f'<body name="b{i}" pos="0 0 {-arm if i else 0:g}">'
        links += f'<joint name="j{i}" type="{kind}" axis="{axis}" damping="{damping:g}"/>'
        links += f'<inertial pos="{0.02 * length:g} 0 {-0.5 * arm:g}" mass="{0.4 * mass:g}" diaginertia="{inertia}"/>'
        ends += "</body>"
    sizes = [force * (length if kind == "hinge" else 1 / length) for kind in joints]
    filled = [
        DRIVES[drive].format(name=f"d{i}", joint=f"j{i}", kp=3 * sizes[i], kv=0.3 * sizes[i], force=0.5 * sizes[i])
        for i, drive in enumerate(drives)
    ]
    g = -9.81 * length if gravity else 0.0
    scene = f"""<mujoco><option timestep="{1e-3 * step_ms:g}" integrator="implicitfast" gravity="0 0 {g:g}"/>
        <worldbody>{links}{ends}</worldbody><actuator>{"".join(filled)}</actuator></mujoco>"""
    names = [f"j{i}" for i in range(len(joints) if tracked is None else tracked)]
    objects = [{"name": name, "quantity": "joint"} for name in names]
    action = [
        {"name": f"u{i}", "unit": "1", "low": -1.0, "high": 1.0, "field": "ctrl", "of": f"d{i}"}
        for i in range(len(drives))
    ]
    action += [
        {"name": f"q{i}", "unit": "1", "low": -1.0, "high": 1.0, "field": "qpos", "of": name}
        for i, name in enumerate(names)
    ]
    action += [
        {"name": f"v{i}", "unit": "1", "low": -9.0, "high": 9.0, "field": "qvel", "of": name}
        for i, name in enumerate(names)
    ]
    first = [parameter("j0@dyna@damping", "dof_damping", "j0", 0.02 * sizes[0], 0.004 * sizes[0])]
    noise = 1e-3 * (length if joints[0] == "slide" else 1.0)
    return written(folder, scene, content(objects, first, action=action, noise_m=noise))


def shots(cell: Cell, count: int = 6, seed: int = 0, length: float = 1.0) -> Floats:
    """(count, A) commands from 0.2 to 1, positions up to 0.6 and speeds up to 2 of each joint, in units of `length`."""
    rng = np.random.default_rng(seed)
    of = {"u": (0.2, 1.0), "q": (-0.6, 0.6), "v": (-2.0, 2.0)}
    return np.stack([length * rng.uniform(*of[a.name[0]], count) for a in cell.action], axis=1)


def recorded(simulator: Simulator, laws: Sequence[Attached], numbers: Sequence[float], inputs: Floats) -> Likelihood:
    """Perfect recordings of a robot that has some laws, for the simulator that lacks them."""
    plain = perfect(simulator, inputs, 100.0, simulator.cell.spec.noise_m)
    wider = simulator.with_effects(laws)
    values = np.tile([*simulator.defaults, *numbers], (len(inputs), 1))
    return replace(plain, measured=wider.observe(values, inputs, plain.time_s))


def noisy(likelihood: Likelihood, noise: Floats) -> Likelihood:
    """The same recordings with (E, F, C) noise."""
    return replace(likelihood, measured=likelihood.measured + noise)


def response_of(simulator: Simulator, likelihood: Likelihood) -> Response:
    """Tangents at the defaults; no parameter is free to take anything."""
    point, free = start(likelihood, simulator.defaults), np.empty(0, np.int64)
    fit = Fit(point, linearise(likelihood, point, free, np.empty(0)), free, 1e6, 0, True)
    return respond(simulator, likelihood, fit)
