"""A scene with a site of every kind off a table: a ball that falls, rolls and spins, a post, an arm with a servo."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from compass_ros.cells import Cell
from compass_ros.simulation import Simulator
from compass_ros.simulation.effects import Attached, effect
from compass_ros.simulation.extents import pair_size, signal_size
from compass_ros.simulation.visited import Visited
from compass_ros.types import Floats
from test.cells.written import content, parameter, written

SCENE = """<mujoco><option timestep="0.001" gravity="{g[0]} {g[1]} {g[2]}" integrator="implicitfast"/><worldbody>
  <geom name="floor" type="plane" size="9 9 1" solref="-4000 -20"/>
  <body name="post" pos="{p[0]} {p[1]} {p[2]}"><geom name="post" size="{r}" contype="0" conaffinity="0"/></body>
  <body name="ball" pos="0 0 {z}"><freejoint name="ball"/>
    <geom name="ball" size="{r}" mass="{m}" solref="-4000 -20"/></body>
  <body name="upper" pos="0 {up} {up}"><joint name="shoulder" type="hinge" axis="0 1 0" damping="{d}"/>
    <inertial pos="{x} 0 -{half}" mass="{m}" diaginertia="{i} {i} {i}"/>
    <body name="lower" pos="0 0 -{link}"><joint name="elbow" type="hinge" axis="0 1 0" damping="{d}"/>
      <inertial pos="{x} 0 -{half}" mass="{m}" diaginertia="{i} {i} {i}"/></body></body></worldbody>
  <actuator><position name="servo" joint="shoulder" kp="{kp}" kv="{kv}"/>
    <motor name="motor" joint="elbow" gear="{gear}"/></actuator></mujoco>"""
"""Gravity is askew, so that the ball rolls and no law can take z for up."""
NEW: dict[str, tuple[str, ...]] = {
    "asymmetric_friction": ("shoulder", "elbow"),
    "load_dependent_friction": ("shoulder",),
    "cogging": ("elbow",),
    "joint_elasticity": ("shoulder",),
    "backlash": ("shoulder", "elbow"),
    "gravity_tilt": ("ball", "upper", "lower"),
    "payload": ("lower",),
    "viscous_drag": ("ball",),
    "quadratic_drag": ("ball",),
    "wind": ("ball",),
    "magnus": ("ball",),
    "buoyancy": ("ball",),
    "pair_attraction": ("ball", "post"),
    "tether": ("post", "ball"),
    "adhesion": ("ball", "floor"),
    "rolling_resistance": ("floor", "ball"),
    "torque_saturation": ("servo",),
    "rate_limit": ("servo",),
    "gain_error": ("motor",),
    "hysteresis": ("servo",),
    "dead_band": ("servo",),
    "scale": ("elbow",),
    "offset": ("shoulder",),
    "rotation": ("ball",),
    "eccentricity": ("elbow",),
    "latency": ("shoulder",),
    "clock_drift": ("ball",),
    "parameter": ("lower@dyna@mass",),
}
"""A site here for each law off a table, and for those that can have one signal."""
INPUTS = np.array([[0.7, 0.05, 0.4, -0.3], [-0.5, 0.08, -0.2, 0.6]])
TIME = np.tile(np.linspace(0, 0.5, 26), (2, 1))


def yard(folder: Path, force: float = 1.0, length: float = 1.0) -> Cell:
    """The cell: told a position and a torque; it starts at the arm's first angles.

    `force`, `length`: size of the units, as in `test.simulation.robots`.
    """
    torque, mass = force * length, 0.4 * force / length
    lengths = {"z": 0.06, "r": 0.05, "up": 1.0, "x": 0.02, "half": 0.1, "link": 0.2}
    scene = SCENE.format(
        g=[length * g for g in (1.2, 0.4, -9.81)],
        p=[length * p for p in (0.3, 0.2, 0.2)],
        m=mass,
        i=3e-3 * torque,
        d=0.02 * torque,
        kp=3.0 * torque,
        kv=0.3 * torque,
        gear=torque,
        **{name: length * value for name, value in lengths.items()},
    )
    action = [
        {"name": name, "unit": "1", "low": -1.0, "high": 1.0, "field": field, "of": of}
        for name, field, of in (
            ("told", "ctrl", "servo"),
            ("torque", "ctrl", "motor"),
            ("q0", "qpos", "shoulder"),
            ("q1", "qpos", "elbow"),
        )
    ]
    objects = [{"name": "ball", "quantity": "xyz"}] + [{"name": n, "quantity": "joint"} for n in ("shoulder", "elbow")]
    damping = parameter("shoulder@dyna@damping", "dof_damping", "shoulder", 0.02 * torque, 0.004 * torque)
    return written(folder, scene, content(objects, [damping], action=action, noise_m=1e-6))


def sized(simulator: Simulator, name: str) -> Attached:
    """A law on its site, as large as it can be there by what the plain simulator shows."""
    objects, law = NEW[name], effect(name)
    visited = Visited(simulator, simulator.defaults, INPUTS, TIME)
    site = Attached(law, objects).sites(simulator.places)[0]
    if site.kind in ("hinge", "slide"):
        return Attached(law.at(visited.joint_sizes()[objects[0]]), objects)
    if site.kind in ("body", "geom_pair", "body_pair"):
        sizes, paths = visited.paths_in_space([{"floor": "world"}.get(n, n) for n in objects])
        if site.kind == "body":
            return Attached(law.at(sizes[objects[0]]), objects)
        one, other = ((sizes[name], paths[name]) for name in sizes)
        return Attached(law.at(pair_size(site.kind, one, other)), objects)
    if law.on_drive is not None:
        return Attached(law.at(visited.drive_size([site])), objects)
    if law.on_signal is not None:
        return Attached(law.at(signal_size(site, plain(simulator))), objects)
    return Attached(law, objects)


def plain(simulator: Simulator) -> Floats:
    """(2, F, C) what is measured without any law."""
    return simulator.observe(np.tile(simulator.defaults, (2, 1)), INPUTS, TIME)


def amounts(law: Attached, share: float = 0.3) -> tuple[Floats, Floats]:
    """(q,) numbers where it is absent, and at a share of its bounds."""
    none = np.array([0.0 if q.amplitude else q.start for q in law.effect.quantities])
    some = np.array([share * q.high if q.amplitude else q.start for q in law.effect.quantities])
    return none, some
