"""A body's inertia as a whole: any values are a real body, zero is the scene, and derivatives are sane."""

from __future__ import annotations

import copy
from collections.abc import Callable
from pathlib import Path

import mujoco
import numpy as np
import pytest
import yaml

from compass_ros.cells import load
from compass_ros.cells.made_inertias import NUMBERS
from compass_ros.cells.registry import dynamics_of
from compass_ros.errors import ConfigError
from compass_ros.types import Floats
from test.cells.test_inertials import SCENES
from test.cells.written import content, parameter

BODIES = [*SCENES]


def bound(folder: Path, inertial: str) -> tuple[mujoco.MjModel, Callable[[Floats], mujoco.MjModel]]:
    """A scene, and what gives the same with ten numbers of its arm."""
    name = "scene.urdf" if "URDF" in inertial else "scene.xml"
    (folder / name).write_text(SCENES[inertial])
    tuned = [parameter(f"arm@dyna@{n}", f"inertia_log_cholesky[{i}]", "arm", 0.0) for i, n in enumerate(NUMBERS)]
    for one in tuned:
        one |= {"bounds": [-5, 5], "half_width": 0.05}
    path = folder / "cell.yaml"
    path.write_text(yaml.safe_dump(content([{"name": "arm", "quantity": "pose"}], tuned, model=name)))
    dynamics = dynamics_of(load(path))

    def written(values: Floats) -> mujoco.MjModel:
        model = copy.copy(dynamics.model)
        dynamics.apply([model], values[None])
        return model

    return mujoco.MjModel.from_xml_path(str(folder / name)), written


def pseudo_inertia(model: mujoco.MjModel) -> Floats:
    """(4, 4) of the arm, in the frame of the body, from what MuJoCo holds of it."""
    body = model.body("arm")
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, body.iquat)
    axes = turn.reshape(3, 3)
    second = axes @ np.diag(0.5 * body.inertia.sum() - body.inertia) @ axes.T
    out = np.zeros((4, 4))
    out[:3, :3] = second + body.mass * np.outer(body.ipos, body.ipos)
    out[:3, 3] = out[3, :3] = body.mass * body.ipos
    out[3, 3] = body.mass[0]
    return out


@pytest.mark.parametrize("inertial", BODIES)
def test_zero_is_the_scene_bit_for_bit(tmp_path: Path, inertial: str) -> None:
    model, write = bound(tmp_path, inertial)
    write(np.full(10, 0.1))
    written = write(np.zeros(10))
    for array in ("body_mass", "body_inertia", "body_ipos", "body_iquat"):
        np.testing.assert_array_equal(getattr(written, array), getattr(model, array), array)


@pytest.mark.parametrize("inertial", BODIES)
def test_any_values_are_a_real_body(tmp_path: Path, inertial: str) -> None:
    rng = np.random.default_rng(3)
    _, write = bound(tmp_path, inertial)
    for scale in (0.1, 1.0, 3.0):
        body = write(scale * rng.normal(size=10)).body("arm")
        assert body.mass[0] > 0
        assert (body.inertia > 0).all()
        assert (body.inertia.sum() - 2 * body.inertia >= -1e-12 * body.inertia.max()).all(), "triangle inequalities"
        assert abs(np.linalg.norm(body.iquat) - 1) < 1e-12


@pytest.mark.parametrize("inertial", BODIES)
def test_the_body_is_the_deformed_one(tmp_path: Path, inertial: str) -> None:
    """exp(2 alpha) A J A^T, with A in the frame of the scene's own principal axes."""
    values = np.random.default_rng(4).normal(0, 0.3, 10)
    model, write = bound(tmp_path, inertial)
    alpha, d1, d2, d3, s12, s23, s13, *shift = values
    upper = np.array([[np.exp(d1), s12, s13], [0, np.exp(d2), s23], [0, 0, np.exp(d3)]])
    body, turn = model.body("arm"), np.zeros(9)
    mujoco.mju_quat2Mat(turn, body.iquat)
    frame, deform = np.eye(4), np.eye(4)
    frame[:3, :3], frame[:3, 3] = turn.reshape(3, 3), body.ipos
    deform[:3, :3], deform[:3, 3] = upper, shift
    whole = frame @ deform @ np.linalg.inv(frame)
    expected = np.exp(2 * alpha) * whole @ pseudo_inertia(model) @ whole.T
    np.testing.assert_allclose(pseudo_inertia(write(values)), expected, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("inertial", BODIES)
def test_derivatives_do_not_depend_on_the_step(tmp_path: Path, inertial: str) -> None:
    """Principal axes may change places under a small deformation; the pseudo-inertia moves smoothly all the same."""
    _, write = bound(tmp_path, inertial)
    for i in range(10):
        slopes = []
        for step in (1e-3, 1e-5):
            ends = [pseudo_inertia(write(sign * step * np.eye(10)[i])) for sign in (1, -1)]
            slopes.append((ends[0] - ends[1]) / (2 * step))
        assert np.linalg.norm(slopes[0]) > 1e-5 or inertial == "flat", NUMBERS[i]  # which has no extent to stretch
        np.testing.assert_allclose(slopes[0], slopes[1], atol=1e-5, err_msg=NUMBERS[i])


@pytest.mark.parametrize("part", ["body_mass", "body_ipos[0]", "body_inertia[1]", "inertia_turn[2]", "body_moment[0]"])
def test_a_body_is_tuned_as_a_whole_or_in_parts(tmp_path: Path, part: str) -> None:
    (tmp_path / "scene.xml").write_text(SCENES["full"])
    tuned = [parameter("arm@dyna@whole", "inertia_log_cholesky[0]", "arm", 0.0), parameter("b", part, "arm", 0.5)]
    path = tmp_path / "cell.yaml"
    path.write_text(yaml.safe_dump(content([{"name": "arm", "quantity": "pose"}], tuned, model="scene.xml")))
    with pytest.raises(ConfigError, match="as well; use one of them"):
        load(path)
