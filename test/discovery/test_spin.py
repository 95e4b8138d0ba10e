"""Balls that are thrown with a spin that nobody measures: another one in each throw, or the same in all."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from compass_ros.config import CalibrationConfig
from compass_ros.pipeline import calibrate
from compass_ros.simulation import Simulator
from compass_ros.simulation.effects import Attached, effect
from compass_ros.simulation.effects.exported import FittedEffect, read_effects, write_effects
from compass_ros.simulation.extents import unit_body
from compass_ros.types import Episode, Floats, Track
from test.cells.written import content, parameter, written

SCENE = """
<mujoco>
  <option timestep="0.002" density="1.2"/>
  <worldbody>
    <body name="ball">
      <freejoint/>
      <geom name="felt" type="sphere" size="0.033" mass="0.058" fluidshape="ellipsoid" fluidcoef="0.25 0.25 1.5 1 1"/>
    </body>
  </worldbody>
</mujoco>
"""
START = {"object": "ball", "velocity": "track", "frames": 9, "noise": {"position": 0.002, "velocity": 0.1}}
GRAVITY = parameter("world@gravity@z", "opt.gravity[2]", "", -9.81, 0.01) | {"bounds": [-9.9, -9.7]}
CELL = content(
    [{"name": "ball", "quantity": "xyz"}], [GRAVITY], start=[START], noise_m=0.002, control_dt_s=0.05, horizon=20
)
MAGNUS = Attached(effect("magnus").at(unit_body(turns=False)), ("ball",))
NOISE_M = 0.002


def thrown(rates: Floats) -> list[Episode]:
    """In air of drag coefficient 0.5 (MuJoCo has the half as `fluidcoef`), with (E, 3) [1/s] across the way."""
    rng, out = np.random.default_rng(3), []
    drag = 1.2 * np.pi * 0.033**2 * 0.25 / 0.058
    times = np.arange(0, 1.0, 1 / 100)
    for n, rate in enumerate(rates):
        up, aside, speed = rng.uniform(0.35, 1.05), rng.uniform(-0.5, 0.5), rng.uniform(5.5, 10)
        level = np.cos(up) * np.array([np.cos(aside), np.sin(aside)])
        first = np.concatenate([rng.uniform([-0.1, -0.1, 1.0], [0.1, 0.1, 1.4]), speed * np.append(level, np.sin(up))])

        def change(t: float, y: Floats, rate: Floats = rate) -> Floats:
            pull = np.array([0, 0, -9.81]) - drag * np.linalg.norm(y[3:]) * y[3:] + np.cross(rate, y[3:])
            return np.concatenate([y[3:], pull])

        path = solve_ivp(change, (0, 1.1), first, t_eval=times, rtol=1e-9, atol=1e-11).y[:3].T
        seen = path + rng.normal(0, NOISE_M, path.shape)
        track = Track("ball", "xyz", np.round(times * 1e9).astype(np.int64), seen)
        out.append(Episode(f"throw{n}", "written", "", {}, 0, (track,)))
    return out


def test_each_rollout_has_its_own_spin_and_a_file_keeps_that(tmp_path: Path) -> None:
    cell = written(tmp_path, SCENE, CELL)
    simulator = Simulator(cell, [MAGNUS], threads=1)
    commanded = np.tile([0, 0, 1.0, 6, 1, 4], (2, 1)).astype(float)
    inputs, times = simulator.inputs(commanded), np.tile(np.linspace(0, 0.9, 10), (2, 1))
    values = np.tile(simulator.defaults, (2, 1))
    values[:, -3:] = 0.02, 0.01, 0.03
    assert simulator.launch_std(values[0])[-3:] == pytest.approx([0.02, 0.01, 0.03])
    inputs[1, -3:] = 0.1, -0.2, 0.3
    still, spun = simulator.observe(values, inputs, times)
    ballistic = Simulator(cell, threads=1).observe(values[:1, :-3], commanded[:1], times[:1])[0]
    np.testing.assert_array_equal(still, ballistic)
    push = np.cross([0.1, -0.2, 0.3], [6, 1, 4])
    assert (spun - still)[1] == pytest.approx(push * 0.1**2 / 2, rel=0.1)

    write_effects([FittedEffect(MAGNUS, (0.02, 0.01, 0.03), (0.001,) * 3)], {}, tmp_path / "effects.yaml")
    (read,) = read_effects(tmp_path / "effects.yaml").effects
    assert read.attached == MAGNUS
    assert read.attached.drawn == 3


@pytest.mark.nightly
@pytest.mark.parametrize("spins", ["another", "same", "none"])
def test_throws_with_spin_are_told_from_those_without(tmp_path: Path, spins: str) -> None:
    """Gravity is right, and is not what a fit of throws with spin but without Magnus's force would make of it."""
    rng = np.random.default_rng(5)
    each = {"another": rng.uniform(0.006, 0.03, (10, 1)), "same": np.full((10, 1), 0.02), "none": np.zeros((10, 1))}
    result, _ = calibrate(
        thrown(each[spins] * [0.0, 1.0, 0.3]), written(tmp_path, SCENE, CELL), CalibrationConfig(threads=1)
    )
    found = result.mismatch
    (gravity,) = result.parameters
    assert gravity.value == pytest.approx(-9.81, abs=max(4 * gravity.std, 0.003))
    if spins == "none":
        assert found.verdict == "none", found.sentence
        return
    assert (found.verdict, [e.name for e in found.effects]) == ("named", ["magnus"]), found.sentence
    assert "standard deviations over episodes" in found.sentence
    rate = found.effects[0].parameters["rate_y"]
    assert rate.value == pytest.approx(np.sqrt(np.mean(each[spins] ** 2)), abs=3 * rate.std)
