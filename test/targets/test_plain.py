"""Each target moves as the simulator does, and what it cannot say is said."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

from compass_ros.cells.rotors import add_rotors
from compass_ros.simulation.effects import Attached, Exported, FittedEffect, attach, effect
from compass_ros.simulation.rotors import carry
from compass_ros.simulation.sizes import unit_joint
from compass_ros.targets.plain_mjcf import Command, write_plain
from compass_ros.types import Floats

SCENE = """<mujoco><option timestep="0.0005" gravity="0 0 -9.81"/><worldbody>
<body name="upper"><joint name="shoulder" axis="0 1 0" damping="0.02"/>
  <inertial pos="0.01 0 -0.2" mass="1.5" diaginertia="0.02 0.02 0.01"/>
  <body name="lower" pos="0 0 -0.4"><joint name="elbow" axis="0 1 0" damping="0.01"/>
    <inertial pos="0.02 0 -0.15" mass="0.7" diaginertia="0.005 0.005 0.002"/></body></body></worldbody>
<actuator><position name="servo" joint="shoulder" kp="30" kv="1"/><motor name="motor" joint="elbow"/></actuator>
</mujoco>"""
STEPS = 3000
LAWS = [
    ("coulomb_friction", ("elbow",), (0.1, 0.0), 2e-2),
    ("coulomb_friction", ("elbow",), (0.1, 0.02), 1e-6),
    ("viscous_drag", ("shoulder", "elbow"), (0.2,), 5e-3),
    ("spring", ("elbow",), (1.5, 0.2, 0.0, 0.0), 1e-6),
    ("gravity_tilt", ("upper", "lower"), (0.05, -0.03), 1e-6),
    ("payload", ("lower",), (0.4, 0.008, 0.004, -0.04), 1e-6),
    ("quadratic_drag", ("elbow",), (0.03,), 5e-3),
]
"""Sites, numbers, and how far the two may be apart in 1.5 s of free swing [rad]."""


def fitted(name: str, on: tuple[str, ...], values: tuple[float, ...]) -> FittedEffect:
    law = effect(name)
    if law.on_joint is not None and name in ("coulomb_friction", "viscous_drag", "quadratic_drag", "spring"):
        law = law.at(unit_joint("hinge"))
    return FittedEffect(Attached(law, on), values, tuple(np.nan for _ in values))


def exported(*given: FittedEffect) -> Exported:
    return Exported(given, {})


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    path = tmp_path / "scene.xml"
    path.write_text(SCENE, encoding="utf-8")
    return path


def swing(path: Path, controls: Floats, laws: Exported | None = None) -> Floats:
    """(T, nq) positions from a start away from rest."""
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    data.qpos[:2], out = (0.6, -0.4), np.zeros((len(controls), 2))
    carry(model, data)

    def play() -> Floats:
        for t, told in enumerate(controls):
            data.ctrl[:] = told
            mujoco.mj_step(model, data)
            out[t] = data.qpos[:2]
        return out

    if laws is None:
        return play()
    with attach(model, data, laws):
        return play()


@pytest.mark.parametrize(("name", "on", "values", "apart"), LAWS)
def test_plain_mjcf_moves_as_the_law_does(
    name: str, on: tuple[str, ...], values: tuple[float, ...], apart: float, scene: Path, tmp_path: Path
) -> None:
    laws, controls = exported(fitted(name, on, values)), np.zeros((STEPS, 2))
    (said,) = write_plain(scene, laws, (), tmp_path / "plain.xml")
    with_law, plain, bare = (
        swing(scene, controls, laws),
        swing(tmp_path / "plain.xml", controls),
        swing(scene, controls),
    )
    assert np.abs(with_law - plain).max() < apart
    assert np.abs(with_law - bare).max() > 5 * apart, "the law shows"
    assert said.fate == ("exact" if apart <= 1e-6 else "alike")


def commands() -> Floats:
    """(T, 2) a command in steps and a wave."""
    time_s = 0.0005 * np.arange(STEPS)
    return np.stack([0.3 * np.sign(np.sin(6 * time_s)), 0.2 * np.sin(9 * time_s)], axis=1)


@pytest.mark.parametrize(
    ("name", "numbers", "follow"),
    [
        ("gain_error", (0.2,), lambda told: told * 1.2),
        ("first_order_lag", (0.03,), lambda told: _lagged(told, 0.03)),
        ("actuation_delay", (0.04,), lambda told: np.concatenate([np.zeros(80), told[:-80]])),
    ],
)
def test_plain_mjcf_follows_commands_as_the_law_does(
    name: str, numbers: tuple[float, ...], follow: object, scene: Path, tmp_path: Path
) -> None:
    assert callable(follow)
    law = FittedEffect(Attached(effect(name), ("motor",)), numbers, (np.nan,))
    (said,) = write_plain(scene, exported(law), (), tmp_path / "plain.xml")
    assert said.fate == "exact"
    told, followed = commands(), commands()
    followed[:, 1] = follow(told[:, 1])
    assert np.abs(swing(tmp_path / "plain.xml", told) - swing(scene, followed)).max() < 1e-6
    assert np.abs(swing(scene, told) - swing(scene, followed)).max() > 1e-3


def _lagged(told: Floats, time: float) -> Floats:
    out, state, keep = np.zeros_like(told), 0.0, np.exp(-0.0005 / time)
    for t, one in enumerate(told):
        state = keep * state + (1 - keep) * one
        out[t] = state
    return out


def test_an_input_of_a_cell_that_is_late_scaled_and_shifted_is_said(scene: Path, tmp_path: Path) -> None:
    said = write_plain(scene, exported(), (Command("servo", 0.04, 1.1, 0.05),), tmp_path / "plain.xml")
    assert [one.fate for one in said] == ["alike", "exact", "exact"]
    told, followed = commands(), commands()
    followed[:, 0] = 1.1 * np.concatenate([np.zeros(80), told[:-80, 0]]) + 0.05
    assert np.abs(swing(tmp_path / "plain.xml", told) - swing(scene, followed)).max() < 1e-6


def test_what_mjcf_has_no_word_for_is_left_out_and_said(scene: Path, tmp_path: Path) -> None:
    law = FittedEffect(Attached(effect("gravity_tilt"), ("lower",)), (0.1, 0.0), (np.nan, np.nan))
    (said,) = write_plain(scene, exported(law), (), tmp_path / "plain.xml")
    assert said.fate == "left out"
    assert "gravity_tilt on lower: left out" in said.line()
    assert (swing(tmp_path / "plain.xml", np.zeros((9, 2))) == swing(scene, np.zeros((9, 2)))).all()


@pytest.mark.parametrize(
    ("name", "numbers", "fate"),
    [
        ("backlash", (0.05, 0.02, 0.7), "exact"),
        ("joint_elasticity", (0.004, 0.02, 0.7, 0.0, 0.0, 0.0), "exact"),
        ("joint_elasticity", (0.004, 0.02, 0.7, 0.0, 0.0, 0.2), "exact"),
        ("joint_elasticity", (0.004, 0.02, 0.7, 0.5, 0.2, 0.0), "alike"),
    ],
)
def test_what_is_between_a_motor_and_its_joint_is_plain_mjcf(
    name: str, numbers: tuple[float, ...], fate: str, tmp_path: Path
) -> None:
    spec = mujoco.MjSpec.from_string(SCENE)
    spec.joint("shoulder").armature = 0.05
    add_rotors(spec, ["shoulder"])
    spec.compile()
    (tmp_path / "scene.xml").write_text(spec.to_xml(), encoding="utf-8")
    laws = exported(fitted(name, ("shoulder",), numbers))
    (said,) = write_plain(tmp_path / "scene.xml", laws, (), tmp_path / "plain.xml")
    assert said.fate == fate
    with_law = swing(tmp_path / "scene.xml", commands(), laws)
    apart = np.abs(with_law - swing(tmp_path / "plain.xml", commands())).max()
    assert apart < 1e-6 if fate == "exact" else 1e-6 < apart < 3e-2
    assert np.abs(with_law - swing(tmp_path / "scene.xml", commands())).max() > 1e-3


def test_without_a_motor_s_side_play_is_left_out(scene: Path, tmp_path: Path) -> None:
    (said,) = write_plain(
        scene, exported(fitted("backlash", ("shoulder",), (0.05, 0.02, 0.7))), (), tmp_path / "plain.xml"
    )
    assert said.fate == "left out"
