"""Friction of a body in space with what stands: against scenes of MuJoCo that have this friction themselves."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from compass_ros.simulation.effects import effect
from compass_ros.simulation.native.program import Kind, Programs, Term
from compass_ros.simulation.sites import Places
from compass_ros.types import Floats

_AXES = "".join(f'<joint type="slide" axis="{axis}"/>' for axis in ("1 0 0", "0 1 0", "0 0 1"))
BOX = '<freejoint/><geom type="box" size=".05 .04 .02" mass="1" {}/>'
ON_FEET = '<freejoint/><body name="foot"><geom type="box" size=".05 .04 .02" mass="1" {}/></body>'
BALL = _AXES + '<geom type="sphere" size=".02" mass="1" {}/>'


def scene(
    friction: float, cone: str, jacobian: str = "dense", dim: int = 3, flags: str = "", body: str = BOX
) -> mujoco.MjModel:
    rubs = f'condim="{dim}" friction="{friction} 0.005 0.0001"'
    return mujoco.MjModel.from_xml_string(f"""
        <mujoco><option cone="{cone}" jacobian="{jacobian}"><flag {flags}/></option><worldbody>
          <geom name="floor" type="plane" size="9 9 .1" {rubs}/>
          <body name="box" pos="0 0 .02">{body.format(rubs)}</body>
          <body name="other" pos="1 1 .02"><freejoint/><geom type="box" size=".05 .04 .02" mass="1"/></body>
        </worldbody></mujoco>""")


def slid(model: mujoco.MjModel, velocity: tuple[float, ...], steps: int, *terms: tuple[Kind, list[float]]) -> Floats:
    """(T, v) velocities."""
    data, site = mujoco.MjData(model), Places(model).body("box")
    data.qvel[: len(velocity)] = velocity
    with Programs([model], [Term(kind, site, np.array([numbers])) for kind, numbers in terms]):
        out = []
        for _ in range(steps):
            mujoco.mj_step(model, data)
            out.append(data.qvel.copy())
    return np.array(out)


@pytest.mark.parametrize("cone", ["elliptic", "pyramidal"])
@pytest.mark.parametrize("jacobian", ["dense", "sparse"])
@pytest.mark.parametrize("dim", [3, 4, 6])
@pytest.mark.parametrize("flags", ["", 'island="disable"'])
def test_a_patch_as_large_as_the_world_is_another_coefficient(cone: str, jacobian: str, dim: int, flags: str) -> None:
    """A box that tumbles and comes to rest; another body is in an island of its own."""
    tumbling, everywhere = (1.0, 0.5, 0.0, 0.0, 0.0, 1.0), [-0.2 * (1 + np.exp(-10)), 0.0, 0.0, 1e9, 0.0, 1.0]
    wanted = slid(scene(0.2, cone, jacobian, dim, flags), tumbling, 250)
    given = slid(scene(0.4, cone, jacobian, dim, flags), tumbling, 250, (Kind.FRICTION_PATCH, everywhere))
    np.testing.assert_allclose(given, wanted, atol=2e-8)
    assert np.abs(slid(scene(0.4, cone, jacobian, dim, flags), tumbling, 250) - wanted).max() > 0.1


def test_a_body_slides_on_what_is_fixed_to_it() -> None:
    everywhere = [-0.2 * (1 + np.exp(-10)), 0.0, 0.0, 1e9, 0.0, 1.0]
    given, wanted = (scene(friction, "elliptic", body=ON_FEET) for friction in (0.4, 0.2))
    site = Places(given).body("box")
    assert site is not None
    assert effect("friction_patch").takes(given, site)
    slides = slid(given, (1.0, 0.5), 250, (Kind.FRICTION_PATCH, everywhere))
    np.testing.assert_allclose(slides, slid(wanted, (1.0, 0.5), 250), atol=1e-9)


@pytest.mark.parametrize("towards", [0.0, 0.4, 1.0, 2.0, 3.0])
def test_a_tensor_of_friction(towards: float) -> None:
    """Zmitrowicz's force -g (f + A) u, to first order in A."""
    model, tensor = scene(0.03, "elliptic", body=BALL), np.array([[0.0015, 0.001], [0.001, -0.0015]])
    velocity = slid(model, (np.cos(towards), np.sin(towards)), 750, (Kind.ANISOTROPIC, [0.0015, 0.001, 0.0, 1.0]))
    first, last = velocity[499, :2], velocity[749, :2]
    along = (first + last) / np.linalg.norm(first + last)
    expected = -9.81 * (0.03 * along + tensor @ along)
    np.testing.assert_allclose((last - first) / 0.5, expected, atol=0.06 * 9.81 * 0.0015)


def test_friction_that_falls_with_the_slip() -> None:
    """d v / d t = -g (f + extra exp(-(v / s)^2)), by small steps."""
    model = scene(0.05, "elliptic", body=BALL)
    velocity = slid(model, (0.3,), 400, (Kind.STRIBECK, [0.04, 0.0, 1.0, 0.1]))[:, 0]
    v, expected = velocity[99], []
    for _ in range(300 * 20):
        v -= 1e-4 * 9.81 * (0.05 + 0.04 * np.exp(-((v / 0.1) ** 2)))
        expected.append(v)
    moving = np.array(expected[19::20]) > 0.01
    np.testing.assert_allclose(velocity[100:][moving], np.array(expected[19::20])[moving], atol=1e-3)


def test_friction_never_pushes() -> None:
    model = scene(0.1, "elliptic", body=BALL)
    speed = np.abs(slid(model, (0.2,), 200, (Kind.STRIBECK, [-0.5, 0.0, 1.0, 1.0]))[:, 0])
    assert np.all(np.diff(speed[20:]) <= 1e-9)


@pytest.mark.parametrize("name", ["stribeck_friction", "friction_patch", "friction_gradient", "anisotropic_friction"])
def test_what_cannot_slide_is_not_asked(name: str) -> None:
    """A body that touches nothing that stands, or without friction; a pyramid has directions of its own."""
    law = effect(name)
    for model, able in ((scene(0.3, "elliptic"), True), (scene(0.3, "elliptic", dim=1), False),
                        (scene(0.3, "pyramidal"), name != "anisotropic_friction")):  # fmt: skip
        site = Places(model).body("box")
        assert site is not None
        assert law.takes(model, site) == able
