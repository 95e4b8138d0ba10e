"""A measured path drives joints: they begin on it, follow it, and no law of actuation is asked of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from compass_ros.cells import load
from compass_ros.cells.drives import Drive
from compass_ros.errors import ConfigError
from compass_ros.simulation import Simulator
from compass_ros.simulation.effects import EFFECTS
from compass_ros.simulation.site_kinds import DRIVES

LAG_S = {"velocity": 0.002, "position": 0.0028284 - 0.0005}
"""Mass over gain of a velocity servo; damping over stiffness of a position servo, which is told the mean of a step and
answers at its end."""
ACTUATOR = {
    "velocity": '<velocity name="drive" joint="axis" kv="500"/>',
    "position": '<position name="drive" joint="axis" kp="250000" kv="707.1"/>',
    "motor": '<motor name="drive" joint="axis"/>',
    "general": '<general name="drive" joint="axis" gainprm="3" biastype="affine" biasprm="0.5 0 0"/>',
}
CELL = """\
name: slider
dynamics: mjcf
model: slider.xml
control_dt_s: 0.05
horizon: 20
inputs:
  - {{name: path, quantity: {quantity}, of: [{of}], actuators: [drive], hold: linear, measured: true{more}}}
objects:
  - {{name: axis, quantity: joint}}
"""


def written(
    folder: Path, servo: str, joint: str = "slide", quantity: str = "joint_position", of: str = "axis", more: str = ""
) -> Path:
    """A body of 1 kg (or 1 kg m^2) on one joint."""
    (folder / "slider.xml").write_text(
        f"""<mujoco><option timestep="0.001" integrator="implicitfast" gravity="0 0 0"/><worldbody><body>
        <joint name="axis" type="{joint}" axis="0 0 1"/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
        <geom size="0.01"/></body><body name="dummy" pos="1 0 0"><geom size="0.01"/></body></worldbody>
        <actuator>{ACTUATOR[servo]}</actuator></mujoco>"""
    )
    path = folder / "slider.yaml"
    path.write_text(CELL.format(quantity=quantity, of=of, more=more))
    return path


@pytest.mark.parametrize("servo", ["velocity", "position"])
@pytest.mark.parametrize("joint", ["slide", "hinge"])
@pytest.mark.parametrize(("scale", "offset"), [(1.0, 0.0), (2.0, 0.3), (-1.0, 0.1)])
def test_a_joint_is_where_it_was_measured(tmp_path: Path, servo: str, joint: str, scale: float, offset: float) -> None:
    """Beside the path itself, once the lag of the servo is taken off; it begins anywhere."""
    path = written(tmp_path, servo, joint, more=f", scale: {scale}, offset: {offset}, delay_s: {-LAG_S[servo]}")
    simulator = Simulator(load(path), threads=1)
    stamps = np.arange(-0.2, 1.2, 1 / 250)
    measured = 0.4 + 0.1 * np.sin(2 * np.pi * np.maximum(stamps, 0.0)) ** 2
    driven = simulator.driven([Drive((stamps,), (measured[:, None],))])
    time = np.arange(0, 1.0, 0.01)
    found = driven.observe(simulator.defaults[None], np.zeros((1, 1)), time[None])[0, :, 0]
    true = offset + scale * np.interp(time, stamps, measured)
    assert found[0] == pytest.approx(true[0], abs=1e-12), "it begins on the path"
    assert np.abs(found - true).max() < 1e-4 * abs(scale)
    still = simulator.observe(simulator.defaults[None], np.zeros((1, 1)), time[None])
    assert not still.any(), "without recordings it rests where the scene has it"


def test_each_row_follows_its_own_recording(tmp_path: Path) -> None:
    simulator = Simulator(load(written(tmp_path, "velocity", more=", delay_s: -0.002")), threads=1)
    stamps = np.linspace(0, 1, 101)
    paths = [np.sin(speed * stamps)[:, None] + speed for speed in (0.1, 0.2, 0.3, 0.4, 0.5)]
    driven = simulator.driven([Drive((stamps,), (path,)) for path in paths])
    order = np.array([3, 0, 4, 4, 1, 2])
    time = np.tile(stamps[None, ::10], (len(order), 1))
    found = driven.observe(np.tile(simulator.defaults, (len(order), 1)), order[:, None].astype(float), time)[:, :, 0]
    assert np.abs(found - np.stack([paths[i][::10, 0] for i in order])).max() < 2e-3
    assert np.array_equal(found[2], found[3])


@pytest.mark.parametrize("servo", ["velocity", "position"])
def test_it_is_no_drive_and_so_no_law_of_actuation_acts_on_it(tmp_path: Path, servo: str) -> None:
    measured, told = written(tmp_path, servo), tmp_path / "told.yaml"
    told.write_text(measured.read_text().replace(", measured: true", ""))
    follows, commanded = (Simulator(load(path), threads=1) for path in (measured, told))
    assert follows.places.drives == ()
    assert len(commanded.places.drives) == 1
    laws = [law for law in EFFECTS.values() if set(law.on) <= set(DRIVES)]
    assert len([law for law in laws if commanded.accepts(law, ())]) >= 2
    assert not [law for law in laws if follows.accepts(law, ())]


@pytest.mark.parametrize(
    ("servo", "changes", "says"),
    [
        ("motor", {}, "actuator 'drive': expected a position or velocity servo of a hinge or slide"),
        ("general", {}, "actuator 'drive': expected a position or velocity servo"),
        ("velocity", {"quantity": "joint_velocity"}, "measured: expected positions"),
        ("velocity", {"quantity": "scalar"}, "measured: expected positions"),
        ("velocity", {"more": ", to: qfrc, at: [axis]"}, "measured: expected positions"),
    ],
)
def test_what_cannot_be_followed_is_refused(tmp_path: Path, servo: str, changes: dict[str, str], says: str) -> None:
    with pytest.raises(ConfigError, match=says) as refused:
        load(written(tmp_path, servo, **changes))
    assert "inputs: path" in str(refused.value)


def test_a_held_path_is_refused(tmp_path: Path) -> None:
    path = written(tmp_path, "velocity")
    path.write_text(path.read_text().replace("hold: linear", "hold: zero"))
    with pytest.raises(ConfigError, match="hold linear"):
        load(path)
