"""Laws off a table, all alike: absent at zero, felt beyond, branched off midway, attached and read back; refused."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

from compass_ros.errors import ConfigError
from compass_ros.simulation import Simulator
from compass_ros.simulation.effects import (
    EFFECTS,
    Attached,
    Exported,
    FittedEffect,
    attach,
    effect,
    read_effects,
    write_effects,
)
from compass_ros.simulation.export import write_scene
from test.simulation.effects.yard import INPUTS, NEW, TIME, amounts, plain, sized, yard


@pytest.fixture(scope="module")
def simulator(tmp_path_factory: pytest.TempPathFactory) -> Simulator:
    return Simulator(yard(tmp_path_factory.mktemp("yard")), threads=1)


@pytest.mark.parametrize("name", NEW)
def test_a_law_is_absent_at_zero_to_the_bit_and_felt_beyond(simulator: Simulator, name: str) -> None:
    """Also beside a rollout that has it."""
    law = sized(simulator, name)
    assert all(q.low <= q.start <= q.high and 0 < q.scale <= q.high - q.low for q in law.effect.quantities)
    none, some = amounts(law)
    wider, before = simulator.with_effects([law]), plain(simulator)
    values = np.repeat([np.append(simulator.defaults, numbers) for numbers in (none, some)], 2, axis=0)
    seen = wider.observe(values, np.tile(INPUTS, (2, 1)), np.tile(TIME, (2, 1)))
    assert (seen[:2] == before).all()
    assert (wider.observe(values[:2], INPUTS, TIME) == before).all()
    assert np.isfinite(seen).all()
    assert np.abs(seen[2:] - before).max() > 1e-4


@pytest.mark.parametrize("name", [n for n in NEW if n not in ("scale", "offset", "rotation", "eccentricity")])
def test_a_rollout_that_branches_off_midway_is_the_same_to_the_bit(simulator: Simulator, name: str) -> None:
    law = sized(simulator, name)
    wider, (_, some) = simulator.with_effects([law]), amounts(law)
    rows = np.tile(np.append(simulator.defaults, some), (4, 1))
    rows[3, 0] *= 1.5  # another damping: it differs from the first step on
    inputs, times, like = np.tile(INPUTS, (2, 1)), np.tile(TIME, (2, 1)), np.array([0, 1, 0, 1])
    expected = wider.observe(rows, inputs, times)
    found, _ = wider.observe_alike(rows, inputs, times, like, np.array([0.5, 0.5, 0.3, 0.3]))
    assert (found == expected).all()


@pytest.mark.parametrize("name", [n for n in NEW if EFFECTS[n].forces or EFFECTS[n].model])
def test_a_plain_model_with_a_law_from_its_file_moves_as_the_simulator_does(
    simulator: Simulator, name: str, tmp_path: Path
) -> None:
    law = sized(simulator, name)
    numbers = tuple(amounts(law)[1].tolist())
    write_effects([FittedEffect(law, numbers, numbers)], {}, tmp_path / "effects.yaml")
    given = read_effects(tmp_path / "effects.yaml")
    assert given.effects[0].values == numbers
    wider = simulator.with_effects([law])
    told = wider.inputs(INPUTS[:1])  # without own numbers of what differs by chance
    expected = wider.motion(np.append(simulator.defaults, numbers)[None], told, 0.3).positions[0]
    write_scene(wider.cell, simulator.defaults, tmp_path / "written.xml")
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "written.xml"))
    data, rows = mujoco.MjData(model), []
    data.qpos[7:9], data.ctrl[:] = INPUTS[0, 2:], INPUTS[0, :2]
    with attach(model, data, given):
        data.qacc_warmstart[:] = 0  # of the look at the first state that `attach` takes
        for _ in range(300):
            mujoco.mj_step(model, data)
            rows.append(np.array([*data.qpos[:3], *data.qpos[7:9]]))
    assert (np.array(rows) == expected[1:301]).all()


@pytest.mark.parametrize("name", NEW)
def test_a_law_comes_back_from_its_file_with_sites_and_units(simulator: Simulator, name: str, tmp_path: Path) -> None:
    law = sized(simulator, name)
    numbers = tuple(amounts(law)[1].tolist())
    write_effects([FittedEffect(law, numbers, numbers)], {}, tmp_path / "effects.yaml")
    (back,) = read_effects(tmp_path / "effects.yaml").effects
    assert (back.values, back.std, back.attached.objects) == (numbers, numbers, law.objects)
    assert [(q.name, q.unit) for q in back.attached.effect.quantities] == [
        (q.name, q.unit) for q in law.effect.quantities
    ]
    assert back.attached.sites(simulator.places) == law.sites(simulator.places)


@pytest.mark.parametrize("name", [n for n in NEW if not (EFFECTS[n].forces or EFFECTS[n].model)])
def test_what_acts_outside_a_model_is_said_so(simulator: Simulator, name: str) -> None:
    model = mujoco.MjModel.from_xml_path(str(simulator.cell.model_path))
    law = sized(simulator, name)
    with pytest.raises(ConfigError, match=f"'{name}' belongs to the .*, outside the model") as refused:
        attach(model, mujoco.MjData(model), Exported((FittedEffect(law, tuple(amounts(law)[1]), ()),), {}))
    assert "\n" not in str(refused.value)


UNITS = {"1": (0, 0), "s": (0, 0), "rad": (0, 0), "m": (0, 1), "N": (1, 0), "kg": (1, -1)}
"""Powers of the units of force and length."""


def in_units(unit: str, force: float, length: float) -> float:
    """A number of a unit such as `N m s/rad` or `1/m`, in units of other sizes."""
    above, _, below = unit.partition("/")
    out = 1.0
    for part, sign in ((above, 1), (below, -1)):
        for factor in part.split():
            name, _, power = factor.partition("^")
            of_force, of_length = UNITS[name]
            out *= (force**of_force * length**of_length) ** (sign * int(power or 1))
    return out


@pytest.mark.parametrize(
    ("force", "length"), [(1024.0, 1.0), (1.0, 1024.0), (1 / 1024, 1 / 64), (0.5, 32.0), (8.0, 0.25)]
)
def test_sizes_are_those_of_the_scene_in_its_own_units(
    simulator: Simulator, tmp_path: Path, force: float, length: float
) -> None:
    """A scene in kilonewtons or millimetres is asked the same: bounds and steps of every law, by their units."""
    other = Simulator(yard(tmp_path, force, length), threads=1)
    for name in NEW:
        there = sized(other, name).effect.quantities
        for here, quantity in zip(sized(simulator, name).effect.quantities, there, strict=True):
            unit = in_units(here.unit, force, length)
            if here.name == "inverse_limit" and name == "torque_saturation":  # of a servo: one over its force
                unit = 1 / (force * length)
            numbers = [(q.low, q.high, q.scale, q.start) for q in (here, quantity)]
            np.testing.assert_allclose(numbers[1], np.array(numbers[0]) * unit, rtol=0.02, err_msg=name)


@pytest.mark.parametrize(
    ("name", "objects", "says"),
    [
        ("cogging", ("ball",), "the scene has no hinge 'ball'; it has .*'shoulder'"),
        ("asymmetric_friction", (), "acts on at least one object, found none"),
        ("wind", ("post",), "the scene has no moving body 'post'"),
        ("payload", ("lowr",), "no moving body 'lowr'.*did you mean 'lower'"),
        ("tether", ("ball",), r"acts between two bodies, found \['ball'\]"),
        ("tether", ("post", "world"), "neither moves against the other"),
        ("adhesion", ("ball", "flor"), "the scene has no geom 'flor'.*did you mean 'floor'"),
        ("rolling_resistance", (), "acts between two geoms, found none"),
        ("dead_band", ("shoulder",), "the scene has no .*drive.* 'shoulder'"),
        ("rate_limit", ("shoulder",), "no drive of one actuator 'shoulder'"),
        ("scale", (), "acts on at least one object, found none"),
        ("offset", ("ball",), "no measured joint or other sensor 'ball'"),
        ("eccentricity", ("elbw",), "no measured joint 'elbw'.*did you mean 'elbow'"),
        ("rotation", ("ball.x",), "cannot act on 'ball.x': it is no vector in space"),
    ],
)
def test_another_site_is_refused_in_one_line(
    simulator: Simulator, name: str, objects: tuple[str, ...], says: str
) -> None:
    with pytest.raises(ConfigError, match=says) as refused:
        Attached(effect(name), objects).sites(simulator.places)
    assert "\n" not in str(refused.value)


def test_a_law_on_one_signal_leaves_the_others_alone(simulator: Simulator) -> None:
    """By its name, and by that of one of its numbers."""
    before = plain(simulator)
    for objects, own in (
        (("shoulder",), [3]),
        (("shoulder", "elbow"), [3, 4]),
        (("ball",), [0, 1, 2]),
        (("ball.y",), [1]),
    ):
        late = simulator.with_effects([Attached(effect("clock_drift"), objects)])
        seen = late.observe(np.tile(np.append(simulator.defaults, 0.05), (2, 1)), INPUTS, TIME)
        assert np.flatnonzero(np.abs(seen - before).max(axis=(0, 1)) > 0).tolist() == own
