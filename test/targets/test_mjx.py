"""`laws_mjx.py` moves a scene in MJX as `attach` moves it in MuJoCo; what it cannot say is said.

What needs jax and mujoco-mjx runs in an environment of its own: `make mjx`.
"""

from __future__ import annotations

import importlib.util
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import mujoco
import numpy as np
import pytest

from compass_ros.cells import load
from compass_ros.cells.dynamics import Sliding
from compass_ros.simulation.effects import Attached, Exported, FittedEffect, attach, effect
from compass_ros.simulation.extents import unit_body
from compass_ros.simulation.native.program import Kind
from compass_ros.simulation.sizes import DriveSize, unit_joint
from compass_ros.targets.mjx import SOURCE, write_mjx
from compass_ros.types import Floats

ARM = """<mujoco><option timestep="0.001" integrator="implicitfast" gravity="0 0 -9.81"/><worldbody>
<body name="upper"><joint name="shoulder" axis="0 1 0" damping="0.02"/>
  <inertial pos="0.01 0 -0.2" mass="1.5" diaginertia="0.02 0.02 0.01"/>
  <body name="lower" pos="0 0 -0.4"><joint name="elbow" axis="0 1 0" damping="0.01"/>
    <inertial pos="0.02 0 -0.15" mass="0.7" diaginertia="0.005 0.005 0.002"/></body></body></worldbody>
<actuator><position name="servo" joint="shoulder" kp="30" kv="1"/><motor name="motor" joint="elbow"/></actuator>
</mujoco>"""
BALLS = """<mujoco><option timestep="0.001" gravity="0 0 -9.81"/><worldbody>
<body name="one" pos="0 0 1"><freejoint/><inertial pos="0.001 0 0" mass="0.1" diaginertia="1e-4 1.1e-4 1.2e-4"/></body>
<body name="two" pos="0.3 0 1"><freejoint/><inertial pos="0 0 0" mass="0.2" diaginertia="1e-4 1.1e-4 1.2e-4"/></body>
</worldbody></mujoco>"""
SMOOTH: tuple[tuple[str, tuple[str, ...], tuple[float, ...]], ...] = (
    ("viscous_drag", ("shoulder", "elbow"), (0.2,)),
    ("quadratic_drag", ("elbow",), (0.1,)),
    ("spring", ("elbow",), (1.5, 0.2, 0.7, 0.8)),
    ("spring", ("shoulder",), (0.5, -0.2, -0.4, 0.8)),
    ("cogging", ("shoulder",), (0.2, -0.1, 6.0, 0.05, 0.1, -0.03, 0.06)),
    ("gravity_tilt", ("upper", "lower"), (0.05, -0.03)),
    ("payload", ("lower",), (0.4, 0.008, 0.004, -0.04)),
)
DRY: tuple[tuple[str, tuple[str, ...], tuple[float, ...]], ...] = (
    ("coulomb_friction", ("elbow",), (0.1,)),
    ("stribeck_friction", ("shoulder",), (0.1, 0.3, 0.0)),
    ("asymmetric_friction", ("elbow",), (0.05,)),
    ("load_dependent_friction", ("shoulder",), (0.05, 0.03, 0.4)),
)
TABLE: tuple[tuple[str, tuple[str, ...], tuple[float, ...]], ...] = (
    ("fan_field", ("puck1", "puck2"), (0.4, -0.1, 0.05, 0.12, 0.5)),
    ("swirl", ("puck1",), (-0.3, -0.2, 0.0, 0.1, 0.9)),
    ("point_attraction", ("puck2",), (0.2, 0.0, 0.0, 0.1)),
    ("crosswind", ("puck1", "puck2"), (0.05, -0.03, 1.5)),
    ("table_tilt", ("puck1",), (0.01, -0.005)),
    ("viscous_drag", ("puck2",), (0.3,)),
    ("quadratic_drag", ("puck1",), (0.5,)),
    ("magnus", ("puck1",), (0.4,)),
    ("friction_patch", ("puck1", "puck2"), (0.05, -0.1, 0.0, 0.1)),
    ("friction_gradient", ("puck1",), (0.02, 0.03)),
    ("anisotropic_friction", ("puck1",), (0.01, 0.005)),
    ("stribeck_friction", ("puck2",), (0.03, 0.1)),
    ("pulsating_lift", ("puck1",), (0.02, 0.01, 2.0)),
)
SPACE: tuple[tuple[str, tuple[str, ...], tuple[float, ...]], ...] = (
    ("wind", ("one",), (1.0, -0.5, 0.2, 0.05)),
    ("buoyancy", ("two",), (0.1,)),
    ("quadratic_drag", ("one", "two"), (0.2,)),
    ("magnus", ("two",), (0.05,)),
    ("pair_attraction", ("one", "two"), (0.2, 0.1)),
)


def fitted(name: str, on: tuple[str, ...], values: tuple[float, ...]) -> FittedEffect:
    law = effect(name)
    if law.on_joint is not None and on[0] in ("shoulder", "elbow"):
        law = law.at(unit_joint("hinge"))
    if law.on_body is not None and on[0] in ("one", "two", "upper", "lower"):
        law = law.at(unit_body())
    if law.on_drive is not None and on == ("servo",):
        law = law.at(DriveSize("position_drive", 1.0, "rad"))
    return FittedEffect(Attached(law, on), values, tuple(np.nan for _ in values))


def exported(laws: tuple[tuple[str, tuple[str, ...], tuple[float, ...]], ...], table: bool = False) -> Exported:
    slides = {name: Sliding(name, np.array([0.05]), np.array([0.002]), np.array([0.2])) for name in ("puck1", "puck2")}
    return Exported(tuple(fitted(*law) for law in laws), slides if table else {})


@pytest.fixture
def scene(tmp_path: Path) -> Callable[[str], Path]:
    def write(text: str) -> Path:
        path = tmp_path / "scene.xml"
        path.write_text(text, encoding="utf-8")
        return path

    return write


def test_what_mjx_has_no_place_for_is_left_out_and_said(scene: Callable[[str], Path], tmp_path: Path) -> None:
    laws = exported((("gain_error", ("motor",), (0.1,)), ("dead_band", ("servo",), (0.01, 0.0))))
    said = write_mjx(scene(ARM), laws, tmp_path / "laws_mjx.py")
    assert [one.fate for one in said] == ["left out", "left out"]
    assert "outside of the model" in said[0].line()
    assert "TERMS: tuple[Term, ...] = ()" in (tmp_path / "laws_mjx.py").read_text(encoding="utf-8")


def test_friction_of_a_body_in_space_is_left_out(scene: Callable[[str], Path], tmp_path: Path) -> None:
    floor = '<geom type="plane" size="9 9 1"/><body name="one" pos="0 0 .1"><freejoint/><geom size=".1"/></body>'
    slides = Attached(effect("stribeck_friction").on_kinds(("body",)), ("one",))
    laws = Exported((FittedEffect(slides, (0.1, 0.3), (0.0, 0.0)),), {})
    (said,) = write_mjx(scene(f"<mujoco><worldbody>{floor}</worldbody></mujoco>"), laws, tmp_path / "laws_mjx.py")
    assert (said.fate, "contacts" in said.line()) == ("left out", True)


def test_every_kind_of_force_is_written_or_said(scene: Callable[[str], Path], tmp_path: Path) -> None:
    """A kind that is new in fields.c has to be decided on here too."""
    source = SOURCE.read_text(encoding="utf-8")
    inner = {Kind.LIBRARY, Kind.HAT}  # of the search for laws, not of any law
    others = {
        Kind.RATE_RESTITUTION,
        Kind.TANGENTIAL,
        Kind.ROLLING,
        Kind.ADHESION,
        Kind.SERVO_DEAD_BAND,
        Kind.WINDUP,
        Kind.TORQUE_SPEED,
    }
    unknown = {kind for kind in Kind if f'"{kind.name.lower()}"' not in source}
    assert unknown == inner | others
    said = write_mjx(scene(ARM), exported(SMOOTH + DRY), tmp_path / "laws_mjx.py")
    assert {one.name for one in said if one.fate == "alike"} == {name for name, _, _ in DRY}
    assert all(one.fate != "left out" for one in said)
    compile((tmp_path / "laws_mjx.py").read_text(encoding="utf-8"), "laws_mjx.py", "exec")


@pytest.fixture(scope="module")
def jax() -> Iterator[Any]:
    module = pytest.importorskip("jax", reason="jax and mujoco-mjx are no part of the tested environment: `make mjx`")
    pytest.importorskip("mujoco.mjx", reason="mujoco-mjx is no part of the tested environment: `make mjx`")
    module.config.update("jax_enable_x64", True)
    yield module
    module.config.update("jax_enable_x64", False)


def loaded(path: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location("laws_mjx", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def in_mjx(jax: Any, scene: Path, laws: Path, start: mujoco.MjData, steps: int) -> Floats:
    """(T, nq) positions after each step."""
    from mujoco import mjx

    own = loaded(laws)
    model = mjx.put_model(own.prepare(mujoco.MjModel.from_xml_path(str(scene))))
    data = mjx.make_data(model)
    data = data.replace(**{name: jax.numpy.array(getattr(start, name)) for name in ("qpos", "qvel", "ctrl")})

    def one(data: Any, _: None) -> tuple[Any, Any]:
        data = own.step(model, data)
        return data, data.qpos

    return np.asarray(jax.jit(lambda data: jax.lax.scan(one, data, None, length=steps)[1])(data))


def in_mujoco(scene: Path, laws: Exported | None, start: mujoco.MjData, steps: int) -> Floats:
    model = mujoco.MjModel.from_xml_path(str(scene))
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:], data.ctrl[:] = start.qpos, start.qvel, start.ctrl
    out = np.zeros((steps, model.nq))

    def play() -> Floats:
        for t in range(steps):
            mujoco.mj_step(model, data)
            out[t] = data.qpos
        return out

    if laws is None:
        return play()
    with attach(model, data, laws):
        return play()


def begun(scene: Path, **state: Floats) -> mujoco.MjData:
    model = mujoco.MjModel.from_xml_path(str(scene))
    data = mujoco.MjData(model)
    for name, value in state.items():
        getattr(data, name)[:] = value
    return data


def compared(jax: Any, scene: Path, laws: Exported, start: mujoco.MjData, steps: int) -> tuple[float, float]:
    """Largest difference of the two, and what the laws do to the motion."""
    path = scene.with_name("laws_mjx.py")
    write_mjx(scene, laws, path)
    ours, theirs = in_mujoco(scene, laws, start, steps), in_mjx(jax, scene, path, start, steps)
    return float(np.abs(ours - theirs).max()), float(np.abs(ours - in_mujoco(scene, None, start, steps)).max())


def test_smooth_laws_of_joints_are_the_same(jax: Any, scene: Callable[[str], Path]) -> None:
    path = scene(ARM)
    start = begun(path, qpos=np.array([0.6, -0.4]), qvel=np.array([0.5, -2.0]), ctrl=np.array([0.3, 0.2]))
    apart, shown = compared(jax, path, exported(SMOOTH), start, 800)
    assert apart < 1e-7
    assert shown > 0.1


def test_dry_frictions_of_joints_are_alike(jax: Any, scene: Callable[[str], Path]) -> None:
    path = scene(ARM)
    start = begun(path, qpos=np.array([0.6, -0.4]), qvel=np.array([0.5, -2.0]), ctrl=np.array([0.3, 0.0]))
    apart, shown = compared(jax, path, exported(DRY), start, 1500)
    assert apart < 0.02 * shown
    assert shown > 0.1


def test_forces_on_pucks_are_the_same(jax: Any, scene: Callable[[str], Path]) -> None:
    """Before the pucks touch anything: beyond that, contacts amplify what the last digit says."""
    path = scene(Path(load("air_hockey").model_path).read_text(encoding="utf-8"))
    qvel = np.array([0.0, 0.0, 0.3, -0.1, 2.0, -0.1, -0.15, -1.0])
    start = begun(path, qpos=np.array([-0.4, 0.15, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]), qvel=qvel)
    apart, shown = compared(jax, path, exported(TABLE, table=True), start, 300)
    assert apart < 1e-7
    assert shown > 0.003


def test_laws_of_bodies_in_space_are_the_same(jax: Any, scene: Callable[[str], Path]) -> None:
    path = scene(BALLS)
    qvel = np.array([0.5, 1.0, 3.0, 1.0, 5.0, -2.0, -0.5, 0.0, 3.0, 0.0, 4.0, 1.0])
    apart, shown = compared(jax, path, exported(SPACE), begun(path, qvel=qvel), 400)
    assert apart < 1e-7
    assert shown > 0.01


def test_gradients_go_through_at_rest(jax: Any, scene: Callable[[str], Path]) -> None:
    """Where every speed is zero, no derivative may be undefined."""
    from mujoco import mjx

    path = scene(ARM)
    write_mjx(path, exported(SMOOTH[:-1] + DRY[:3]), path.with_name("laws_mjx.py"))
    own = loaded(path.with_name("laws_mjx.py"))
    model = mjx.put_model(mujoco.MjModel.from_xml_path(str(path)))
    data = mjx.make_data(model)
    slopes = jax.jacfwd(lambda v: own.force(model, data.replace(qvel=v)))(data.qvel)
    assert np.isfinite(slopes).all()
    assert np.diag(slopes).max() < 0
