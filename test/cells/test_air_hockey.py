"""All 64 parameters of the table: which fields of the model each one moves, and that each one acts."""

from __future__ import annotations

import copy
from collections.abc import Mapping

import mujoco
import numpy as np
import pytest

from compass_ros.cells.air_hockey import AirHockey
from compass_ros.types import Floats
from test.cells.written import DERIVED
from test.simulation.table import DESCRIBED, WIDE, cell, simulator, values

CONTACT = {
    "damping": {"pair_solref"},
    "impedance": {"pair_solimp"},
    "impedance_width": {"pair_solimp"},
    "impedance_power": {"pair_solimp"},
}
INERTIA = {"body_mass", "body_subtreemass", "body_inertia", "body_invweight0", "dof_invweight0", "dof_M0"}
RIM = {"geom_size", "geom_rbound"}
WEIGHTS = {"body_invweight0", "dof_invweight0", "dof_M0"}
FIELDS: Mapping[str, set[str]] = {
    "pusher@shape@radius": RIM,
    "puck1@shape@radius": RIM | {"dof_length"},
    "puck2@shape@radius": RIM | {"dof_length"},
    "pose@yaw": {"geom_quat"},
    "obstacle@pose@x": {"geom_pos"},
    "obstacle@pose@y": {"geom_pos"},
    "obstacle@shape@length": RIM,
    "obstacle@shape@width": RIM,
    "dyna@friction_sliding": {"geom_friction"},
    "puck1@dyna@mass": INERTIA,
    "puck2@dyna@mass": INERTIA,
    "pusher@dyna@mass": INERTIA | {"actuator_acc0"},
    "puck1@dyna@armature": WEIGHTS | {"dof_armature"},
    "puck2@dyna@armature": WEIGHTS | {"dof_armature"},
    "pusher@dyna@armature": {"dof_M0", "dof_armature", "actuator_acc0"},
    "joint_damping": {"dof_damping"},
    "servo_gain": {"actuator_gainprm", "actuator_biasprm"},
    "env@dyna@gravity": {"opt.gravity"},
}
"""End of a parameter's name -> fields that it moves, those included that MuJoCo derives. Others move none."""
NO_FIELD = ("friction_creep", "vel_discount", "ramp_time", "stroke", "settle_time", "bias_x", "bias_y", "lift")


def fields_of(model: mujoco.MjModel) -> dict[str, Floats]:
    """Every array of a model and of its options."""
    found = {f"opt.{n}": getattr(model.opt, n) for n in dir(model.opt) if not n.startswith("_")}
    found |= {n: getattr(model, n) for n in dir(model) if not n.startswith("_")}
    return {n: v.copy() for n, v in found.items() if isinstance(v, np.ndarray) and n not in DERIVED}


def written(given: Floats) -> dict[str, Floats]:
    dynamics = AirHockey(cell())
    model = copy.copy(dynamics.model)
    dynamics.apply([model], given[None])
    mujoco.mj_setConst(model, mujoco.MjData(model))
    return fields_of(model)


def other_value(index: int) -> Floats:
    """The defaults with one parameter at a bound."""
    parameter = cell().parameters[index]
    given = cell().defaults.copy()
    given[index] = parameter.high if parameter.high != parameter.default else parameter.low
    return given


NAMES = [p.name for p in cell().parameters]


def test_there_are_64_of_which_the_paper_names_11() -> None:
    assert len(NAMES) == 64
    targets = [p for p in cell().spec.parameters if p.target is not None and "damping" not in p.name]
    assert {p.name for p in targets} >= {"pusher@actuation@vel_discount", "env@camera@bias_x", "env@camera@bias_y"}


def test_the_defaults_are_the_scene_as_it_is_drawn() -> None:
    drawn, applied = fields_of(AirHockey(cell()).model), written(cell().defaults)
    different = {name for name in drawn if not np.allclose(drawn[name], applied[name], rtol=1e-12, atol=0)}
    assert different == set()


@pytest.mark.parametrize("name", NAMES)
def test_a_parameter_moves_its_fields_and_no_others(name: str) -> None:
    before, after = written(cell().defaults), written(other_value(NAMES.index(name)))
    moved = {field for field in before if not np.array_equal(before[field], after[field])}
    if name.endswith(NO_FIELD):
        assert moved == set()
        return
    rules = {**FIELDS, **{f"@dyna@{contact}": fields for contact, fields in CONTACT.items()}}
    (expected,) = [fields for end, fields in rules.items() if name.endswith(end)]
    assert moved == expected


@pytest.mark.parametrize("partner", ["pusher", "puck1", "puck2", "front_wall", "obstacle"])
def test_a_contact_takes_the_mean_of_its_partners(partner: str) -> None:
    dynamics = AirHockey(cell())
    model = copy.copy(dynamics.model)
    dynamics.apply([model], values({f"{partner}@dyna@damping": -20.0}))
    for i in range(model.npair):
        pair = {model.geom(model.pair_geom1[i]).name, model.geom(model.pair_geom2[i]).name}
        assert model.pair_solref[i, 1] == (-15.0 if partner in pair else -10.0)


def test_every_parameter_acts_on_shots_that_reach_it() -> None:
    """In one batch, at the bounds: over 0.05 mm in one of three shots, and over 0.3 mm for what is to be found."""
    batch = np.concatenate([cell().defaults[None], [other_value(i) for i in range(64)]])
    tiled, shots = np.repeat(batch, len(WIDE), axis=0), np.tile(WIDE, (len(batch), 1))
    moved = simulator().motion(tiled, shots, 2.5).positions.reshape(len(batch), len(WIDE), -1)
    effect = np.abs(moved[1:] - moved[0]).max(axis=(1, 2))
    still = [name for name, e in zip(NAMES, effect, strict=True) if e < 5e-5]
    assert still == []
    assert all(effect[NAMES.index(name)] > 3e-4 for name in cell().spec.causal)


@pytest.mark.parametrize("partner", ["back_wall", "obstacle"])
def test_what_is_not_touched_changes_nothing(partner: str) -> None:
    own = [i for i, name in enumerate(NAMES) if name.startswith(f"{partner}@")]
    batch = np.stack([cell().defaults, *(other_value(i) for i in own)])
    positions = simulator().motion(batch, np.tile(DESCRIBED, (len(batch), 1)), 2.5).positions
    assert (positions == positions[0]).all()


def test_a_camera_bias_shifts_what_is_seen_and_not_what_happens() -> None:
    biased = values({"env@camera@bias_x": 0.03, "env@camera@bias_y": -0.02})
    plain, seen = (simulator().motion(v, DESCRIBED[None], 2.5).positions for v in (values(), biased))
    np.testing.assert_allclose(seen - plain, np.tile([0.03, -0.02], 2) + 0 * plain, atol=1e-12)


def test_the_described_shot_works_with_the_target_values() -> None:
    """Pusher, puck 1, puck 2, right wall, goal: in that order, and nothing in between."""
    target = {p.name: p.target for p in cell().spec.parameters if p.target is not None and "bias" not in p.name}
    time = np.arange(0, 2.5, 0.001)
    bodies = simulator().bodies(values(target)[0], DESCRIBED, time)
    gap1 = np.linalg.norm(bodies["pusher"][:, :2] - bodies["puck1"][:, :2], axis=1) - 0.0555
    gap2 = np.linalg.norm(bodies["puck1"][:, :2] - bodies["puck2"][:, :2], axis=1) - 0.051
    wall = bodies["puck2"][:, 1] + 0.225 - 0.0255
    goal = np.linalg.norm(bodies["puck2"][:, :2] - [0.43, 0.0], axis=1) - 0.15
    first = [int(np.argmax(gap < 0)) for gap in (gap1, gap2, wall, goal)]
    assert min(first) > 0
    assert first == sorted(first)
    assert np.abs(bodies["puck1"][:, 1]).max() < 0.1  # puck 1 keeps off the walls


def test_a_shot_follows_the_commanded_heading_speed_and_stroke() -> None:
    dynamics = AirHockey(cell())
    controls = dynamics.controls(values(), np.array([[-0.23, 0.08, 0.1, 0.4]]), 2500)[0]
    speed = np.linalg.norm(controls, axis=1)
    assert speed.max() == pytest.approx(0.75 * 0.4)
    heading = np.arctan2(controls[100, 1], controls[100, 0])
    assert heading == pytest.approx(np.arctan2(-0.08, 0.08) + 0.1)
    along = controls @ [np.cos(heading), np.sin(heading)] * 0.001
    assert along[along > 0].sum() == pytest.approx(0.75 * (0.09 + 0.4 * (0.05 / 2 + 0.06 / 4)), rel=2e-3)
    assert abs(along.sum()) < 2e-4  # and back to where it came from
