"""A calibrated scene with a fitted effect in plain MuJoCo: the same motion as in the simulator that was calibrated.

python examples/attach_effect.py
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import mujoco
import numpy as np

from compass_ros.cells import load
from compass_ros.cells.registry import dynamics_of
from compass_ros.simulation import Simulator
from compass_ros.simulation.effects import Attached, attach, effect, read_effects
from compass_ros.simulation.export import write_effects_of, write_scene

# What a calibration leaves behind: a scene and its effects. Here a fan that nobody had modelled.
cell = load("air_hockey")
fan = Attached(effect("fan_field"), ("puck1", "puck2"))
simulator = Simulator(cell, [fan], threads=1)
values = np.append(cell.values({"puck2@dyna@friction_sliding": 0.03}), [0.3, 0.2, -0.05, 0.1, 0.5])
shot = np.array([-0.225, 0.075, 0.0, 0.45])  # start x, y [m], angle [rad], speed [m/s]
folder = Path(tempfile.mkdtemp())
write_scene(cell, values[:64], folder / "scene.xml")
write_effects_of(simulator, values, None, cell, values[:64], folder / "effects.yaml")

# Somebody else's program: ten lines of MuJoCo.
model = mujoco.MjModel.from_xml_path(str(folder / "scene.xml"))
data = mujoco.MjData(model)
data.qpos[:2] = shot[:2]
commands = dynamics_of(cell).controls(values[None, :64], shot[None], 2500)[0]
path = []
with attach(model, data, read_effects(folder / "effects.yaml")):
    for command in commands:
        data.ctrl[:] = command
        mujoco.mj_step(model, data)
        path.append(data.body("puck2").xpos[:2].copy())  # where it was before this step

ours = simulator.motion(values[None], shot[None], 2.5).positions[0, :-1, 2:]
apart = float(np.abs(np.array(path) - ours).max())
print(f"puck 2 comes to rest at {path[-1]} m; plain MuJoCo and the simulator differ by {1e3 * apart:.2g} mm at most")
