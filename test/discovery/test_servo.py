"""Verdicts on joints, from recordings to a name: laws planted on a servo and on arms, in any unit of force."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pytest

from compass_ros.config import CalibrationConfig
from compass_ros.pipeline import calibrate
from compass_ros.simulation import Simulator
from compass_ros.simulation.effects import Attached, effect
from compass_ros.simulation.sizes import unit_joint
from compass_ros.types import Episode, Mismatch
from test.discovery.servo import noisy, on_axis, recorded, servo
from test.simulation import robots

pytestmark = pytest.mark.slow


def said(cell_of: Path, laws: Sequence[str], numbers: Sequence[float], force: float = 1.0) -> Mismatch:
    """The verdict on a servo; numbers in N m, of which those of a force are in units of `force`."""
    cell = servo(cell_of, force)
    attached = [on_axis(name) if effect(name).moves else Attached(effect(name), ()) for name in laws]
    quantities = [q for a in attached for q in a.effect.quantities]
    scaled = [n * (force if q.unit.startswith("N") else 1.0) for n, q in zip(numbers, quantities, strict=True)]
    return calibrate(recorded(cell, attached, scaled, force), cell, CalibrationConfig(threads=1))[0].mismatch


@pytest.mark.parametrize(
    ("law", "numbers", "force"),
    [
        pytest.param("coulomb_friction", [0.08, 0.0], 1.0, marks=pytest.mark.nightly),
        pytest.param("coulomb_friction", [0.08, 0.0], 1e-3, marks=pytest.mark.nightly),
        pytest.param("coulomb_friction", [0.08, 0.0], 4096.0, marks=pytest.mark.nightly),
        pytest.param("stribeck_friction", [0.15, 1.0, 0.002], 1.0, marks=pytest.mark.nightly),
        pytest.param("stribeck_friction", [0.15, 1.0, 0.0], 1.0, marks=pytest.mark.nightly),
        pytest.param("stribeck_friction", [0.15, 3.0, 0.0], 1e-3, marks=pytest.mark.nightly),
        pytest.param("quadratic_drag", [0.02], 1.0, marks=pytest.mark.nightly),
        pytest.param("spring", [1.0, 0.4, 0.0, 0.0], 1.0, marks=pytest.mark.nightly),
        ("actuation_delay", [0.03], 1.0),
    ],
)
def test_a_law_on_a_servo_is_named_with_its_size(tmp_path: Path, law: str, numbers: list[float], force: float) -> None:
    mismatch = said(tmp_path, [law], numbers, force)
    assert mismatch.verdict == "named", mismatch.sentence
    assert [e.name for e in mismatch.effects] == [law]
    for planted, (name, found) in zip(numbers, mismatch.effects[0].parameters.items(), strict=True):
        if name in ("softening", "slack", "softness") or not planted:
            continue  # a short way says nothing of the one, and friction that holds has none of the other
        unit = force if found.unit.startswith("N") else 1.0
        assert found.value / unit == pytest.approx(planted, rel=0.05), name
        assert abs(found.value) > 2 * found.std
    assert mismatch.where is not None
    at = ("joint", "axis", "free") if effect(law).moves else ("actuator", "all", "start")
    assert (mismatch.where.site_kind, mismatch.where.site, mismatch.where.phase) == at
    opened(mismatch)
    errors = mismatch.explanations[0].held_out
    assert errors is not None
    assert errors.removed == pytest.approx(1.0, abs=0.1)


def opened(mismatch: Mismatch) -> None:
    """Each explanation with a simulator has its error on the held-out episodes; that of nothing has no other."""
    listed = [tuple(law.name for law in one.laws) for one in mismatch.explanations]
    assert {(), ("unknown",)} <= set(listed)
    for one in mismatch.explanations:
        names = [law.name for law in one.laws]
        assert (one.held_out is None) is (names == ["unknown"])
        if one.held_out is not None:
            assert (one.held_out.after == one.held_out.before) is (not names)
            assert one.held_out.floor > 0


def test_nothing_is_missing_from_a_servo_that_has_wrong_numbers(tmp_path: Path) -> None:
    mismatch = said(tmp_path, [], [])
    assert (mismatch.verdict, mismatch.explanations[0].laws) == ("none", ())
    opened(mismatch)


def test_two_laws_on_a_servo_are_both_named(tmp_path: Path) -> None:
    mismatch = said(tmp_path, ["coulomb_friction", "spring"], [0.08, 0.0, 1.0, 0.4, 0.0, 0.0])
    assert {e.name for e in mismatch.effects} == {"coulomb_friction", "spring"}, mismatch.sentence


@pytest.mark.parametrize(
    ("joints", "drives", "law", "on", "numbers"),
    [
        (("hinge", "hinge"), (), "", "", []),
        (("hinge", "hinge"), (), "stribeck_friction", "j1", [0.028, 0.8, 0.0]),
        pytest.param(("hinge", "slide"), ("motor", "motor"), "spring", "j1", [0.34, -1.0], marks=pytest.mark.nightly),
        pytest.param(
            *(("hinge", "slide", "hinge"), ("intvelocity", "muscle", "general"), "coulomb_friction", "j2", [0.07, 0.0]),
            marks=pytest.mark.nightly,
        ),
        pytest.param(("hinge",) * 3, ("position",) * 3, "viscous_drag", "j1", [0.16], marks=pytest.mark.nightly),
    ],
)
def test_a_law_on_one_joint_of_an_arm_is_named_on_that_joint(
    tmp_path: Path, joints: tuple[str, ...], drives: tuple[str, ...], law: str, on: str, numbers: list[float]
) -> None:
    cell = robots.robot(tmp_path, joints, drives, step_ms=2.0)
    kind = joints[int(on[1:])] if on else "hinge"
    laws = [Attached(effect(law).at(unit_joint(kind)), (on,))] if law else []  # type: ignore[arg-type]
    slow = [0.3 if a.name[0] == "v" else 1.0 for a in cell.action]
    wrong = Simulator(cell, laws, threads=1)
    values = [*(1.1 * cell.defaults), *numbers]
    episodes: list[Episode] = noisy(wrong, values, robots.shots(cell, 10) * slow, 1.0, cell.spec.noise_m / 2, 3)
    mismatch = calibrate(episodes, cell, CalibrationConfig(threads=1))[0].mismatch
    if not law:
        assert mismatch.verdict == "none"
        return
    assert mismatch.verdict == "named", mismatch.sentence
    assert [e.name for e in mismatch.effects] == [law]
    assert mismatch.where is not None
    assert mismatch.where.object == on
    found = list(mismatch.effects[0].parameters.values())
    assert found[0].value == pytest.approx(numbers[0], rel=0.05)
