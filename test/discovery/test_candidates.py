"""What is asked about in a cell follows from what it has: every law where it can act, and nowhere else."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from compass_ros.cells import Cell, load
from compass_ros.discovery.candidates import Candidate, candidates
from compass_ros.simulation import Simulator
from compass_ros.simulation.effects import EFFECTS
from compass_ros.types import Floats
from test.cells.written import content, written
from test.simulation.robots import robot, shots
from test.simulation.table import cell as table
from test.simulation.table import on_table
from test.simulation.table import simulator as table_simulator

ON_JOINTS = ["viscous_drag", "quadratic_drag", "stribeck_friction", "coulomb_friction", "spring"]
OF_TABLE = {"table_tilt", "crosswind", "fan_field", "swirl", "point_attraction", "magnus", "off_centre_mass"} | {
    *("friction_patch", "friction_gradient", "anisotropic_friction", "pulsating_lift", "local_wall", "heading_bias")
}
OF_CAMERA = {name for name in EFFECTS if name.startswith("camera_")} | {
    *("lens_distortion", "rolling_shutter", "tracking_lag")
}


def asked(simulator: Simulator, inputs: Floats) -> tuple[Candidate, ...]:
    return candidates(simulator, simulator.defaults, inputs, np.tile(np.linspace(0, 0.5, 20), (len(inputs), 1)))


def cell_signals(cell: Cell) -> list[str]:
    return [signal.name for signal in cell.signals]


def named(found: Sequence[Candidate], name: str) -> list[tuple[str, ...]]:
    return [c.attached.objects for c in found if c.name == name]


ROBOTS = [
    (("hinge",), ()),
    (("hinge",), ("position",)),
    (("slide",), ("motor",)),
    (("slide", "hinge"), ("position", "position")),
    (("hinge", "hinge", "slide"), ("position", "velocity", "motor")),
    (("hinge",) * 4, ("velocity",) * 4),
    (("slide",) * 2 + ("hinge",) * 3, ("intvelocity", "muscle", "general")),
    (("hinge",) * 6, ("position",) * 6),
    (("hinge",) * 7, ("motor",) * 2),
    (
        ("hinge", "slide") * 4,
        ("position", "motor", "velocity", "intvelocity", "general", "muscle", "position", "motor"),
    ),
]
"""Chains of 1 to 8 joints with 0 to 8 drives of every kind."""


@pytest.fixture(params=ROBOTS, ids=lambda p: f"{len(p[0])} joints, {len(p[1])} drives")
def arm(request: pytest.FixtureRequest, tmp_path: Path) -> tuple[Cell, tuple[str, ...], tuple[str, ...]]:
    joints, drives = request.param
    return robot(tmp_path, joints, drives), joints, drives


def test_laws_on_joints_are_asked_of_all_of_a_kind_and_of_each(
    arm: tuple[Cell, tuple[str, ...], tuple[str, ...]],
) -> None:
    cell, joints, _ = arm
    found = asked(Simulator(cell, threads=1), shots(cell, 2))
    expected = []
    for kind in ("hinge", "slide"):
        own = [f"j{i}" for i, k in enumerate(joints) if k == kind]
        expected += ([tuple(own)] if len(own) > 1 else []) + [(name,) for name in own]
    for name in ON_JOINTS:
        assert named(found, name) == expected
    assert not {c.name for c in found} & (OF_TABLE | OF_CAMERA)
    numbers = [(name,) for name in cell_signals(cell)]
    assert named(found, "latency") == named(found, "clock_drift") == [(), *(numbers if len(joints) > 1 else [])]
    assert named(found, "scale") == named(found, "offset") == numbers
    assert named(found, "eccentricity") == [(f"j{i}",) for i, kind in enumerate(joints) if kind == "hinge"]


def test_laws_on_drives_are_asked_of_all_of_a_kind_and_of_each(
    arm: tuple[Cell, tuple[str, ...], tuple[str, ...]],
) -> None:
    cell, _, drives = arm
    simulator, inputs = Simulator(cell, threads=1), shots(cell, 2)
    found = asked(simulator, inputs)
    of_kind = {"position": "p", "velocity": "v", "intvelocity": "v", "motor": "e", "muscle": "o", "general": "o"}
    kinds = [of_kind[drive] for drive in drives]
    for name, able in {
        "actuation_delay": "pveo",
        "first_order_lag": "pveo",
        "velocity_saturation": "v",
        "dead_band": "pve",
    }.items():
        own = [i for i, kind in enumerate(kinds) if kind in able]
        expected = set()
        for kind in {kinds[i] for i in own}:
            same = [i for i in own if kinds[i] == kind]
            together = () if same == own else tuple(f"d{i}" for i in same)
            expected |= {together} | ({(f"d{i}",) for i in same} if len(same) > 1 else set())
        assert sorted(named(found, name)) == sorted(expected)
    assert bool(named(found, "stroke_jitter")) is any(kind in "ve" for kind in kinds)


def test_every_candidate_runs_and_those_that_push_do(arm: tuple[Cell, tuple[str, ...], tuple[str, ...]]) -> None:
    """At its start nothing changes; at half of its range all is finite, and a force or a drive is felt.

    In a shot or in its opposite: some laws act in one direction.
    """
    cell, _, _ = arm
    simulator, inputs = Simulator(cell, threads=1), shots(cell, 1) * np.array([[1.0], [-1.0]])
    time = np.tile(np.linspace(0, 0.5, 15), (2, 1))
    plain = simulator.observe(np.tile(simulator.defaults, (2, 1)), inputs, time)
    for candidate in asked(simulator, inputs):
        quantities = candidate.attached.effect.quantities
        there = np.array([q.begins + 2 * q.scale if q.amplitude else q.start for q in quantities])
        absent = np.array([0.0 if q.amplitude else q.start for q in quantities])
        wider = simulator.with_effects([candidate.attached])
        values = np.repeat([np.append(simulator.defaults, numbers) for numbers in (absent, there)], 2, axis=0)
        seen = wider.observe(values, np.tile(inputs, (2, 1)), np.tile(time, (2, 1)))
        assert (seen[:2] == plain).all(), candidate
        assert np.isfinite(seen).all(), candidate
        if candidate.by_force or candidate.attached.effect.channel in ("actuation", "sensing"):
            moved = np.abs(seen[2:] - plain).max()
            assert moved > 0, candidate


TOUCH = [("pusher", "puck1"), ("puck1", "puck2")]
PAIRED = {
    "adhesion": TOUCH,
    "rolling_resistance": [],
    **{name: [*TOUCH, ()] for name in ("rate_dependent_restitution", "tangential_impulse")},
    **{name: [("puck1", "puck2")] for name in ("pair_attraction", "tether")},
}
"""Of what stays upright on a plane none rolls."""


@pytest.mark.parametrize("name", EFFECTS)
def test_on_the_table_every_law_is_asked_as_ever(name: str) -> None:
    found = named(asked(table_simulator(), np.array([[-0.225, 0.075, 0.0, 0.45]])), name)
    if EFFECTS[name].paired:
        assert found == PAIRED[name]
        return
    pucks = [("puck1", "puck2"), ("puck1",), ("puck2",)]
    walls = [("front_wall",), ("back_wall",), ("left_wall",), ("right_wall",), ("obstacle",)]
    kind = EFFECTS[name]
    absent = not on_table(kind)
    assert found == ([] if absent else pucks if kind.moves else walls if kind.on_walls else [()])


def test_alike_bodies_meet_a_geom_alike() -> None:
    """What both pucks touch is one site, whichever puck it is; two pucks are another one."""
    simulator, rng = table_simulator(), np.random.default_rng(0)
    ranges = [(-0.25, 0.25), (0.0, 0.1), (-0.8, 0.8), (0.4, 1.2)]
    inputs = np.column_stack([rng.uniform(low, high, 8) for low, high in ranges])
    asked_of = candidates(simulator, simulator.defaults, inputs, np.tile(np.linspace(0, 2.5, 60), (8, 1)))
    found = [c for c in asked_of if c.name == "rate_dependent_restitution" and c.objects]
    of_both = [c for c in found if {"puck1", "puck2"} < set(c.objects)]
    assert {c.objects[0] for c in of_both} > {"pusher"}
    assert all(c.alone and len(c.attached.named) == 2 for c in of_both)
    geoms = [(set(c.objects) - {"puck1", "puck2"} or {"pucks"}).pop() for c in found]
    assert len(geoms) == len(set(geoms))


@pytest.mark.parametrize(
    ("gravity", "load", "on_table", "lying"),
    [
        (-9.81, True, True, True),
        (-9.81, False, False, True),
        (0.0, True, False, False),
        (0.0, False, False, False),
        (9.81, True, False, False),
    ],
)
def test_friction_on_a_plane_is_asked_where_something_presses_on_it(
    tmp_path: Path, gravity: float, load: bool, on_table: bool, lying: bool
) -> None:
    scene = f"""<mujoco><option gravity="0 0 {gravity}"/><worldbody><body name="puck">
      <joint name="x" type="slide" axis="1 0 0"/><joint name="y" type="slide" axis="0 1 0"/>
      <geom size="0.03" mass="0.1" contype="0" conaffinity="0"/></body></worldbody></mujoco>"""
    friction = {"name": "friction", "default": 0.1, "bounds": [0, 1], "unit": "1", "half_width": 0.1}
    objects, parameters = [{"name": "puck", "quantity": "xy"}], [friction | {"field": "table_friction", "of": "puck"}]
    made = content(objects, parameters if load else (), start=[{"object": "puck"}])
    simulator = Simulator(written(tmp_path, scene, made), threads=1)
    names = {c.name for c in asked(simulator, np.array([[0.0, 0.0, 0.3, 0.1]]))}
    assert ("friction_patch" in names) is on_table
    assert ({"coulomb_friction", "stribeck_friction", "table_tilt"} <= names) is lying
    assert {"viscous_drag", "magnus", "swirl"} <= names
    assert "spring" not in names
    assert not names & {"rate_dependent_restitution", "latency", "actuation_delay"}


BALL = '<body name="ball" pos="0 0 1"><freejoint name="ball"/><geom size="0.05" mass="1"/></body>'
AXIS = '<joint name="pole" type="hinge" axis="0 1 0"/>'
POLE = f'<body name="pole" pos="1 0 1">{AXIS}<geom size="0.05" pos=".1 0 .3" mass="1"/></body>'


@pytest.mark.parametrize(
    ("objects", "movers"),
    [
        ([{"name": "ball", "quantity": "xyz"}], ()),
        ([{"name": "ball", "quantity": "pose"}], ()),
        ([{"name": "pole", "quantity": "joint"}], ("pole",)),
        ([{"name": "pole", "quantity": "xyz"}], ()),
        ([{"name": "ball", "quantity": "xyz"}, {"name": "pole", "quantity": "joint"}], ("pole",)),
        (
            [{"name": "tip", "quantity": "xyz", "body": "pole"}, {"name": "axis", "quantity": "joint", "body": "pole"}],
            ("pole",),
        ),
    ],
)
def test_a_free_body_is_not_taken_for_its_joint(
    tmp_path: Path, objects: list[dict[str, str]], movers: tuple[str, ...]
) -> None:
    scene = f"<mujoco><worldbody>{BALL}{POLE}</worldbody></mujoco>"
    simulator = Simulator(written(tmp_path, scene, content(objects)), threads=1)
    assert simulator.movers() == movers
    found = asked(simulator, np.zeros((1, 0)))
    assert {o for c in found if c.by_force for o in c.attached.objects} == set(movers)
    cameras = any(o["quantity"] != "joint" for o in objects)
    assert ("camera_scale" in {c.name for c in found}) is cameras
    assert ("latency" in {c.name for c in found}) is any(o["quantity"] == "joint" for o in objects)


def test_a_camera_sees_bodies_and_an_encoder_joints(tmp_path: Path) -> None:
    objects = [{"name": "pole", "quantity": "joint"}, {"name": "ball", "quantity": "xyz"}]
    scene = f"<mujoco><worldbody>{BALL}{POLE}</worldbody></mujoco>"
    simulator = Simulator(written(tmp_path, scene, content(objects)), threads=1)
    time, none = np.linspace(0, 0.3, 10)[None], np.zeros((1, 0))
    plain = simulator.observe(np.zeros((1, 0)), none, time)[0]
    for name, own in (
        ("camera_scale", [1, 2, 3]),
        ("camera_latency", [1, 2, 3]),
        ("latency", [0]),
        ("clock_drift", [0, 1, 2, 3]),
    ):
        candidate, *alone = [c for c in asked(simulator, none) if c.name == name]
        assert [c.attached.objects for c in alone] == ([("pole",), ("ball",)] if name == "clock_drift" else [])
        numbers = np.array([[0.05 if q.amplitude else q.start for q in candidate.quantities]])
        seen = simulator.with_effects([candidate.attached]).observe(numbers, none, time)[0]
        changed = np.abs(seen - plain).max(axis=0) > 0
        others = np.isin(np.arange(4), own, invert=True)
        assert not changed[others].any()
        assert changed[own].any()


def test_a_table_that_is_loaded_again_is_asked_the_same() -> None:
    again = Simulator(load("air_hockey"), threads=1)
    one, other = (asked(s, np.array([[-0.225, 0.075, 0.0, 0.45]])) for s in (again, table_simulator()))
    assert [(c.name, c.attached.objects) for c in one] == [(c.name, c.attached.objects) for c in other]
    assert len(one) > 60
    assert table().name == "air_hockey"


def test_a_gear_is_asked_of_a_joint_that_has_a_rotor(tmp_path: Path) -> None:
    """A motor without current still turns behind its gear; a bare hinge has none."""
    arm, bare = Simulator(load("two_joint_arm"), threads=1), Simulator(robot(tmp_path, ("hinge",)), threads=1)
    of_arm = asked(arm, np.array([[0.5, 0.3, 0.0, 0.0], [1.0, -0.4, 0.0, 0.0]]))  # first angles and rates
    of_bare = asked(bare, shots(bare.cell, 2))
    for name in ("backlash", "joint_elasticity"):
        assert named(of_arm, name) == [("shoulder",), ("elbow",)]
        assert not named(of_bare, name)
