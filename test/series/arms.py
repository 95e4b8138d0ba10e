"""Driven scenes small enough to be simulated by hand, and recordings of them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import mujoco
import numpy as np

from compass_ros.types import Episode, Floats, Track

ARM = """<mujoco model="arm"><option timestep="0.002" integrator="implicitfast"/><worldbody>
<body name="upper" pos="0 0 1"><joint name="shoulder" axis="0 1 0" damping="{shoulder_damping}" frictionloss="{loss}"/>
<geom name="upper" type="capsule" fromto="0 0 0 0.3 0 0" size="0.03" mass="1.2"/>
<body name="lower" pos="0.3 0 0"><joint name="elbow" axis="0 1 0" damping="0.4"/>
<geom name="lower" type="capsule" fromto="0 0 0 0.25 0 0" size="0.025" mass="0.7"/>
<site name="tool" pos="0.25 0 0"/></body></body>
<body name="hand" mocap="true" pos="1 0 0">
<geom name="hand" type="sphere" size="0.01" contype="0" conaffinity="0"/></body>
<body name="puck" pos="2 0 0"><freejoint name="loose"/>
<geom name="puck" type="box" size="0.03 0.02 0.01" mass="0.2"/></body>
</worldbody><actuator>
<position name="shoulder" joint="shoulder" kp="{kp}" kv="2"/><position name="elbow" joint="elbow" kp="40" kv="1"/>
</actuator></mujoco>"""
TRUE: Mapping[str, float] = {"shoulder_damping": 0.8, "loss": 0.0, "kp": 80.0}
START_NS = 1_700_000_000_000_000_000
CELL = """\
name: arm
dynamics: mjcf
model: arm.xml
windows: {length_s: 2.0}
inputs:
  - {name: target, topic: /joint_commands, quantity: joint_position, of: [shoulder, elbow]}
signals:
  - {name: joints, topic: /joint_states, quantity: joint_position, of: [shoulder, elbow], noise: 0.001}
"""
PARAMETERS = """\
parameters:
  - {name: shoulder@dyna@damping, field: dof_damping, of: shoulder, unit: N m s/rad,
     default: 0.5, bounds: [0, 5], half_width: 0.5}
  - {name: shoulder@actuation@gain, field: servo_gain, of: shoulder, unit: N m/rad,
     default: 60, bounds: [5, 500], half_width: 30}
  - {name: elbow@actuation@delay, field: 'input_delay_s[1]', of: target, unit: s,
     default: 0.0, bounds: [0, 0.2], half_width: 0.02}
"""


def write_cell(folder: Path, text: str = CELL + PARAMETERS, name: str = "arm", **scene: float) -> Path:
    """The YAML of a cell beside its scene."""
    (folder / "arm.xml").write_text(ARM.format(**{**TRUE, **scene}))
    path = folder / f"{name}.yaml"
    path.write_text(text)
    return path


def command(seconds: float, seed: int, rate_hz: float = 50.0) -> tuple[Floats, Floats]:
    """(n,) times [s] and (n, 2) targets [rad]: a few sines with random phases."""
    rng = np.random.default_rng(seed)
    time = np.arange(0, seconds, 1 / rate_hz)
    frequency, phase = rng.uniform(0.2, 1.5, (3, 2)), rng.uniform(0, 6.28, (3, 2))
    waves = np.sin(2 * np.pi * frequency * time[:, None, None] + phase)
    return time, np.asarray(0.25 * waves.sum(axis=1))


def play(model: mujoco.MjModel, time: Floats, target: Floats, delay_s: float = 0.0, settled_s: float = 0.0) -> Floats:
    """(n, 2) joint positions at the times of the commands; MuJoCo's own loop, targets held until the next one.

    The elbow's are late. The arm has held the first one for some time.
    """
    data, out = mujoco.MjData(model), np.zeros(target.shape)
    while data.time < settled_s:
        data.ctrl[:] = target[0]
        mujoco.mj_step(model, data)
    data.time = 0.0
    for i, now in enumerate(time):
        while data.time < now - 1e-9:
            late = np.searchsorted(time, data.time - delay_s + 1e-9, side="right") - 1
            fresh = np.searchsorted(time, data.time + 1e-9, side="right") - 1
            data.ctrl[:] = target[max(fresh, 0), 0], target[max(late, 0), 1]
            mujoco.mj_step(model, data)
        out[i] = data.qpos[:2]
    return out


def episode(name: str, time: Floats, target: Floats, measured: Floats, start_ns: int = START_NS) -> Episode:
    stamps = start_ns + np.round(time * 1e9).astype(np.int64)
    track = Track("joints", "joint_position", stamps, measured)
    return Episode(name, "arm", "", {}, start_ns, (track,), inputs=(Track("target", "joint_position", stamps, target),))


def recorded(seconds: float, seed: int, noise: float = 0.001, delay_s: float = 0.0, **scene: float) -> Episode:
    """A recording of the arm as it truly is."""
    model = mujoco.MjModel.from_xml_string(ARM.format(**{**TRUE, **scene}))
    time, target = command(seconds, seed)
    measured = play(model, time, target, delay_s, 1.0)
    measured = measured + np.random.default_rng(seed + 1000).normal(0, noise, measured.shape)
    return episode(f"run{seed}", time, target, measured, START_NS + seed * 10**12)
