"""Effects on models that are not ours: the same motion to the last bit, and no trace when they are gone."""

from __future__ import annotations

import copy
import ctypes
import gc

import mujoco
import numpy as np
import pytest

from compass_ros.cells.dynamics import Sliding
from compass_ros.cells.registry import dynamics_of
from compass_ros.errors import ConfigError
from compass_ros.simulation import Simulator
from compass_ros.simulation.effects import EFFECTS, Exported, FittedEffect, attach, effect
from compass_ros.simulation.native import program
from compass_ros.types import Floats
from test.cells.written import DERIVED
from test.simulation.effects.scenes import exported, scene
from test.simulation.table import DESCRIBED, attached, cell, simulator

TABLE = {s.body: s for s in dynamics_of(cell()).sliding(cell().defaults[None])}
STEPS = 1500


def stepped(model: mujoco.MjModel) -> Floats:
    """(STEPS + 1, nq) the described shot, step by step."""
    data = mujoco.MjData(model)
    data.qpos[:2] = DESCRIBED[:2]
    commands = dynamics_of(cell()).controls(cell().defaults[None], DESCRIBED[None], STEPS)[0]
    rows = [data.qpos.copy()]
    for command in commands:
        data.ctrl[:] = command
        mujoco.mj_step(model, data)
        rows.append(data.qpos.copy())
    return np.array(rows)


def pucks(rows: Floats) -> Floats:
    """(..., 4) positions of the pucks on the table."""
    return np.asarray(rows[:, [2, 3, 5, 6]] + np.array([-0.15, 0, -0.075, -0.075]))


ACTING = ["fan_field", "friction_patch", "magnus", "rate_dependent_restitution", "local_wall", "off_centre_mass"]


@pytest.mark.parametrize("name", ACTING)
def test_a_plain_model_moves_as_the_simulator_does(name: str) -> None:
    kind = EFFECTS[name]
    numbers = [0.6 * q.high if q.amplitude else q.start for q in kind.quantities]
    on = attached(kind)
    ours = Simulator(cell(), [on], threads=1)
    expected = ours.motion(np.append(cell().defaults, numbers)[None], DESCRIBED[None], STEPS * 1e-3).positions[0]
    model = mujoco.MjModel.from_xml_path(str(cell().model_path))
    bare = stepped(model)
    with attach(model, mujoco.MjData(model), Exported((FittedEffect(on, tuple(numbers), ()),), TABLE)):
        found = stepped(model)
    assert (pucks(found) == expected).all()
    assert np.abs(found - bare).max() > 1e-3
    assert (stepped(model) == bare).all()


def test_every_array_of_the_model_is_as_before() -> None:
    model = copy.copy(simulator().physics.model)
    arrays = [n for n in dir(model) if isinstance(getattr(model, n), np.ndarray) and n not in DERIVED]
    before = {n: getattr(model, n).copy() for n in arrays}
    given = (
        exported("off_centre_mass", (0.002, 0.001, 0.01), ("puck1",)).effects
        + exported("local_wall", (0.01, -0.4), ("left_wall",)).effects
    )
    attachment = attach(model, mujoco.MjData(model), Exported(given, {}))
    assert any((getattr(model, n) != before[n]).any() for n in before)
    attachment.detach()
    attachment.detach()
    assert all((getattr(model, n) == before[n]).all() for n in before)


def test_two_models_at_once_and_a_third_without() -> None:
    models = [scene("planar") for _ in range(3)]
    rates = (1.0, 2.0)
    attached = [
        attach(model, mujoco.MjData(model), exported("viscous_drag", (rate,)))
        for model, rate in zip(models, rates, strict=False)
    ]
    speeds = []
    for model in models:
        data = mujoco.MjData(model)
        data.qvel[0] = 1.0
        mujoco.mj_step(model, data, nstep=5000)
        speeds.append(data.qvel[0])
    assert speeds == pytest.approx([np.exp(-1), np.exp(-2), 1.0], rel=1e-3)
    for one in attached:
        one.detach()


def test_a_dropped_attachment_ends() -> None:
    model = scene("planar")
    attach(model, mujoco.MjData(model), exported("viscous_drag", (1.0,)))
    gc.collect()
    data = mujoco.MjData(model)
    data.qvel[0] = 1.0
    mujoco.mj_step(model, data, nstep=100)
    assert data.qvel[0] == 1.0


def test_a_simulator_runs_beside_an_attached_model() -> None:
    before = simulator().motion(cell().defaults[None], DESCRIBED[None], 0.5).positions
    model = scene("planar")
    with attach(model, mujoco.MjData(model), exported("viscous_drag", (1.0,))):
        assert (simulator().motion(cell().defaults[None], DESCRIBED[None], 0.5).positions == before).all()
        data = mujoco.MjData(model)
        data.qvel[0] = 1.0
        mujoco.mj_step(model, data)
        assert data.qvel[0] < 1.0


@pytest.mark.parametrize("name", [n for n, e in EFFECTS.items() if not (e.forces or e.model)])
def test_what_acts_outside_the_model_is_refused_in_one_line(name: str) -> None:
    model = scene("planar")
    numbers = tuple(q.start for q in effect(name).quantities)
    with pytest.raises(ConfigError, match=f"'{name}' belongs to the {effect(name).channel}, outside") as refused:
        attach(model, mujoco.MjData(model), exported(name, numbers, ()))
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("given", "says"),
    [
        (
            exported("viscous_drag", (1.0,), ("pick",)),
            "the scene has no joint or moving body 'pick'.*did you mean 'puck'",
        ),
        (exported("viscous_drag", (1.0,), ("world",)), "no joint or moving body 'world'"),
        (
            exported("friction_patch", (0.1, 0.0, 0.0, 0.1)),
            "'friction_patch': the scene has no body on the cell's table or moving body 'puck'",
        ),
        (Exported((), {"ball": Sliding("ball", np.ones(1), np.ones(1), np.ones(1))}), "no moving body 'ball'"),
    ],
)
def test_what_cannot_act_is_refused(given: Exported, says: str) -> None:
    model = scene("planar")
    with pytest.raises(ConfigError, match=says):
        attach(model, mujoco.MjData(model), given)


def test_a_second_attachment_to_one_model_is_refused_and_the_first_goes_on() -> None:
    model = copy.copy(simulator().physics.model)
    with attach(model, mujoco.MjData(model), exported("viscous_drag", (1.0,), ("puck1",))):
        place = model.geom_pos.copy()
        second = Exported(
            exported("local_wall", (0.01, 0.0), ("left_wall",)).effects
            + exported("viscous_drag", (3.0,), ("puck1",)).effects,
            {},
        )
        with pytest.raises(ConfigError, match="has forces already"):
            attach(model, mujoco.MjData(model), second)
        assert (model.geom_pos == place).all()
        data = mujoco.MjData(model)
        data.qvel[2] = 0.1
        mujoco.mj_step(model, data, nstep=100)
        assert data.qvel[2] == pytest.approx(0.1 * np.exp(-0.1), rel=1e-3)


def test_seventy_thousand_registrations_do_not_fill_the_table() -> None:
    """One after the other, with a program alive all the time; the addresses are made up and never read."""
    library = program._library()
    model = scene("planar")
    nothing = ctypes.create_string_buffer(16)
    with attach(model, mujoco.MjData(model), exported("viscous_drag", (1.0,))):
        for i in range(70_000):
            address = (1 << 40) + 64 * 7 * i
            assert library.compass_register(address, ctypes.addressof(nothing)) == 1
            library.compass_forget(address)
        data = mujoco.MjData(model)
        data.qvel[0] = 1.0
        mujoco.mj_step(model, data)
        assert data.qvel[0] < 1.0


def test_a_full_table_says_so_and_empties_again() -> None:
    library = program._library()
    nothing = ctypes.create_string_buffer(16)
    addresses = [(1 << 40) + 64 * 5 * i for i in range(50_000)]
    taken = [a for a in addresses if library.compass_register(a, ctypes.addressof(nothing))]
    model = scene("planar")
    try:
        assert 40_000 < len(taken) < 50_000
        with pytest.raises(ConfigError, match="too many models"):
            attach(model, mujoco.MjData(model), exported("viscous_drag", (1.0,)))
    finally:
        for address in taken[::-1]:
            library.compass_forget(address)
    attach(model, mujoco.MjData(model), exported("viscous_drag", (1.0,))).detach()
