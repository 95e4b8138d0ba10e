"""Every law is asked on every site on which it can act, and first order sees it there; some by the whole discovery."""

from __future__ import annotations

from pathlib import Path

import pytest

from compass_ros.cells import Cell
from compass_ros.config import CalibrationConfig
from compass_ros.discovery.candidates import candidates
from compass_ros.discovery.first_order import FirstOrder, Ranked
from compass_ros.discovery.neighbours import rank
from compass_ros.pipeline import calibrate
from compass_ros.simulation import Simulator
from compass_ros.types import Floats
from test.discovery import asked
from test.discovery.test_first_order import plain
from test.simulation import robots


def ranked(cell: Cell, inputs: Floats, law: str, on: tuple[str, ...], sizes: dict[str, float]) -> list[Ranked]:
    """All laws about the true values of all else, where one law is planted on a site.

    `sizes`: its numbers, as in `asked.numbers`.
    """
    simulator = Simulator(cell, threads=1)
    one = asked.candidate(simulator, inputs, law, on)
    likelihood = robots.recorded(simulator, [one.attached], asked.numbers(one, sizes), inputs)
    found = candidates(simulator, simulator.defaults, inputs, likelihood.time_s)
    return rank(FirstOrder(plain(simulator, likelihood).response), found)


def near_the_top(found: list[Ranked], law: str, on: tuple[str, ...]) -> Ranked:
    names = [(r.candidate.name, r.candidate.objects) for r in found]
    assert (law, on) in names[:3], [(*n, round(r.gain, 1)) for n, r in zip(names, found, strict=True)][:6]
    return found[names.index((law, on))]


@pytest.mark.parametrize(
    ("law", "on", "sizes"),
    [
        ("cogging", "s", {"cosine": 2.0, "sine": -1.0, "periods": 17.3}),
        pytest.param("cogging", "e", {"cosine": 3.0, "periods": 61.0}, marks=pytest.mark.nightly),
        ("load_dependent_friction", "s", {"coefficient": 3.0}),
        pytest.param("load_dependent_friction", "e", {"coefficient": 5.0}, marks=pytest.mark.nightly),
        pytest.param("joint_elasticity", "s", {"compliance": 1.0}, marks=pytest.mark.nightly),
        ("joint_elasticity", "e", {"compliance": 2.0}),
        pytest.param("backlash", "s", {"play": 0.7}, marks=pytest.mark.nightly),
        ("backlash", "e", {"play": 1.5}),
        ("torque_saturation", "ds", {"inverse_limit": 5.0}),
        pytest.param("torque_saturation", "de", {"inverse_limit": 2.0}, marks=pytest.mark.nightly),
        ("scale", "joints.s", {"scale": 1.0}),
        pytest.param("scale", "joints.e", {"scale": -1.0}, marks=pytest.mark.nightly),
        ("offset", "joints.e", {"offset": 0.5}),
        ("eccentricity", "joints.s", {"cosine": 1.0, "sine": 3.0}),
        ("latency", "joints.e", {"latency": 1.0}),
        ("clock_drift", "", {"rate": 1.0}),
        pytest.param("payload", "fore", {"mass": 10.0}, marks=pytest.mark.nightly),
        ("payload", "fore", {"mass": 10.0, "moment_z": -5.0}),
        ("gravity_tilt", "upper+fore", {"tilt_x": 1.0}),
        ("spring", "e", {"stiffness": 2.0, "rest": -2.6}),
    ],
)
def test_a_law_on_one_joint_drive_or_encoder_is_seen_there(
    tmp_path: Path, law: str, on: str, sizes: dict[str, float]
) -> None:
    cell = asked.arm(tmp_path)
    at = tuple(on.split("+")) if on else ()
    found = near_the_top(ranked(cell, asked.steps(cell, 6), law, at, sizes), law, at)
    assert found.seen
    if law == "cogging":
        assert found.numbers[2] == pytest.approx(sizes["periods"], rel=0.05)
    if law == "spring":  # it rests where the arm never comes, a motion of 1 rad to either side
        assert found.numbers[1] == pytest.approx(sizes["rest"], abs=0.3)


@pytest.mark.parametrize(("law", "sizes"), [("pair_attraction", {"strength": 2.0}), ("tether", {"stiffness": 3.0})])
def test_a_law_between_two_bodies_is_seen_between_them(tmp_path: Path, law: str, sizes: dict[str, float]) -> None:
    pair = ("red", "blue")
    near_the_top(ranked(asked.balls(tmp_path), asked.passing(6), law, pair, sizes), law, pair)


def test_rolling_resistance_is_seen_where_a_ball_rolls(tmp_path: Path) -> None:
    pair = ("floor", "ball")
    found = ranked(asked.bowl(tmp_path), asked.rolling(6), "rolling_resistance", pair, {"lever": 3.0})
    near_the_top(found, "rolling_resistance", pair)


@pytest.mark.parametrize(
    ("law", "sizes"),
    [
        ("stribeck_friction", {"extra": 5.0, "speed": 0.2}),
        pytest.param("anisotropic_friction", {"along_x": 2.0, "diagonal": -1.0}, marks=pytest.mark.nightly),
        pytest.param("friction_gradient", {"along_x": 2.0}, marks=pytest.mark.nightly),
        ("friction_patch", {"extra": 5.0, "centre_x": 0.1, "radius": 0.1}),
    ],
)
def test_friction_is_seen_where_a_body_slides(tmp_path: Path, law: str, sizes: dict[str, float]) -> None:
    near_the_top(ranked(asked.sled(tmp_path), asked.pushes(8), law, ("sled",), sizes), law, ("sled",))


def test_adhesion_is_seen_where_a_foot_sticks(tmp_path: Path) -> None:
    pair = ("pad", "foot")
    near_the_top(ranked(asked.foot(tmp_path), asked.lifts(6), "adhesion", pair, {"force": 10.0}), "adhesion", pair)


FAINT = ("share", "hysteresis", "windup", "windup_force", "speed")
"""Numbers of which such motions say little; nothing of the speed at which what is not there fades."""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("law", "on", "sizes"),
    [
        pytest.param("cogging", "s", {"cosine": 2.0, "sine": -1.0, "periods": 17.3}, marks=pytest.mark.nightly),
        pytest.param("load_dependent_friction", "s", {"coefficient": 3.0}, marks=pytest.mark.nightly),
        pytest.param("joint_elasticity", "e", {"compliance": 2.0}, marks=pytest.mark.nightly),
        pytest.param("backlash", "e", {"play": 1.0}, marks=pytest.mark.nightly),
        pytest.param("torque_saturation", "ds", {"inverse_limit": 15.0}, marks=pytest.mark.nightly),
        pytest.param("payload", "fore", {"mass": 15.0, "moment_x": 3.0, "moment_z": -8.0}, marks=pytest.mark.nightly),
        pytest.param("gravity_tilt", "upper+fore", {"tilt_x": 2.0}, marks=pytest.mark.nightly),
        pytest.param("adhesion", "pad+foot", {"force": 10.0}, marks=pytest.mark.nightly),
    ],
)
def test_such_a_law_is_named_with_its_site_and_its_numbers(
    tmp_path: Path, law: str, on: str, sizes: dict[str, float]
) -> None:
    """Of the limit only some steps of twelve tell; all other numbers of the cell are a tenth off."""
    cell = asked.foot(tmp_path) if law == "adhesion" else asked.arm(tmp_path)
    inputs = asked.lifts(12) if law == "adhesion" else asked.steps(cell, 12)
    one = asked.candidate(Simulator(cell, threads=1), inputs, law, tuple(on.split("+")))
    planted = asked.numbers(one, sizes)
    mismatch = calibrate(asked.episodes(cell, inputs, one, planted), cell, CalibrationConfig(threads=1))[0].mismatch
    assert mismatch.verdict == "named", mismatch.sentence
    (found,) = mismatch.explanations[0].laws
    assert (found.name, found.sites) == (law, tuple(on.split("+")))
    for name, quantity, number in zip(found.quantities, found.quantities.values(), planted, strict=True):
        little = 4 * quantity.std if name in FAINT else 0.0  # of a play's these are short: see docs/discovery.md
        assert quantity.value == pytest.approx(number, rel=0.05, abs=max(little, 0.0 if number else 0.01))
