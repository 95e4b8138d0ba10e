"""Several units of one robot: mean and spread of a published example, planted odd units, priors for the next one."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import yaml

from compass_ros.cells import load
from compass_ros.operation.fleet import Next, dersimonian_laird, fleet, spread
from compass_ros.operation.several import BY_CHANCE, Number, read_runs
from test.conftest import Run as Command
from test.operation.many_results import result, units, write

PENDULUM = Path(__file__).parents[2] / "examples" / "own_cell"


def said(values: list[float], stds: list[float]) -> list[Number]:
    return [Number(v, s, "") for v, s in zip(values, stds, strict=True)]


def test_mean_and_spread_of_the_eight_schools() -> None:
    """Rubin (1981): the spread by moments is zero, the mean 7.69 +- 4.07 (Bayesian Data Analysis, section 5.5)."""
    schools = said([28, 8, -3, 7, -1, 1, 18, 12], [15, 10, 16, 11, 9, 11, 10, 18])
    mean, tau = dersimonian_laird(schools)
    assert (mean.value, mean.std, tau) == pytest.approx((7.69, 4.07, 0.0), abs=0.005)


def test_mean_and_spread_by_hand() -> None:
    """0, 2, 4 with error bars of 1: q 8, q - 2 over 3 - 1 = 3, so tau^2 3, and the mean 2 +- sqrt(4 / 3)."""
    mean, tau = dersimonian_laird(said([0, 2, 4], [1, 1, 1]))
    assert (mean.value, mean.std, tau) == pytest.approx((2.0, (4 / 3) ** 0.5, 3**0.5))
    shrunk = spread("x", dict(zip("abc", said([0, 2, 4], [1, 1, 1]), strict=True))).shrunk
    assert shrunk["a"].value == pytest.approx(0.5), "a quarter of the way, error bar^2 over error bar^2 + tau^2"


def test_shrunk_values_are_nearer_to_the_truth() -> None:
    rng, own, shrunk = np.random.default_rng(2), 0.0, 0.0
    for _ in range(100):
        true = rng.normal(1.0, 0.5, 6)
        measured = said((true + rng.normal(0.0, 0.5, 6)).tolist(), [0.5] * 6)
        found = spread("x", {str(i): one for i, one in enumerate(measured)}).shrunk
        own += float(sum((one.value - t) ** 2 for one, t in zip(measured, true, strict=True)))
        shrunk += float(sum((found[str(i)].value - t) ** 2 for i, t in enumerate(true)))
    assert shrunk < 0.75 * own


@pytest.mark.parametrize(("tau", "most"), [(0.0, 0.004), (1.0, 0.006), (30.0, 0.012)])
def test_units_that_are_alike_are_seldom_called_odd(tau: float, most: float) -> None:
    rng, found = np.random.default_rng(4), 0
    for _ in range(800):
        measured = said((rng.normal(0, tau, 6) + rng.normal(0, 1, 6)).tolist(), [1.0] * 6)
        found += Next(measured[1:]).chance(measured[0]) < BY_CHANCE
    assert found / 800 <= most


def test_the_next_unit_is_within_its_width_two_times_in_three() -> None:
    rng, inside = np.random.default_rng(6), 0
    for _ in range(200):
        true = rng.normal(3.0, 2.0, 7)
        number = Next(said((true[1:] + rng.normal(0, 0.5, 6)).tolist(), [0.5] * 6)).number
        inside += abs(true[0] - number.value) < number.std
    assert 0.58 < inside / 200 < 0.8


def test_planted_odd_units_are_named_and_the_others_are_not(tmp_path: Path) -> None:
    found = fleet(read_runs(units(tmp_path))[0])
    assert {one.name: [*one.odd] for one in found.spreads if one.odd} == {"shoulder@dyna@damping": ["unit5"]}
    by_name = {one.name: one for one in found.spreads}
    assert by_name["shoulder@dyna@damping"].mean.value == pytest.approx(0.6, abs=0.08), "without the odd one"
    assert by_name["elbow@dyna@damping"].tau == pytest.approx(0.1, abs=0.06)
    assert found.sentences[0] == ("backlash on elbow: unit3 (0.97); in every other unit its probability is below 0.001")
    assert found.sentences[1].startswith("unit5 differs in shoulder@dyna@damping: 2.1")
    assert [*found.alone] == ["backlash on elbow: width"]
    assert found.shared_laws == []


def test_the_command_says_it_in_words_json_and_page(tmp_path: Path, run: Command) -> None:
    units(tmp_path / "units")
    status, out, err = run("fleet", tmp_path / "units", "--out", tmp_path / "fleet.html")
    assert (status, err) == (0, "")
    text = " ".join(out.split())
    assert "unit5 differs in shoulder@dyna@damping" in text
    assert "unit3, unit5 differ from the others." in text
    status, out, _ = run("fleet", tmp_path / "units", "--json")
    content = json.loads(out)
    assert status == 0
    assert content["laws"]["backlash on elbow"]["unit3"] == 0.97
    assert [*content["numbers"]["shoulder@dyna@damping"]["odd"]] == ["unit5"]
    assert all(sentence.split(":")[0] in (tmp_path / "fleet.html").read_text() for sentence in content["differences"])


def test_priors_are_a_cell_that_the_suite_reads(tmp_path: Path, run: Command) -> None:
    names = ("arm@dyna@damping", "arm@dyna@centre")
    folders = []
    for i, (damping, centre) in enumerate([(0.008, -0.37), (0.0085, -0.371), (0.0095, -0.37), (0.009, -0.372)]):
        one = result({"elbow@dyna@damping": 1.0})
        rows = tuple(
            type(one.parameters[0])(n, unit, 0.0, v, s, (-1.0, 1.0), True, True)
            for n, unit, v, s in zip(names, ("N m s/rad", "m"), (damping, centre), (1e-4, 2e-4), strict=True)
        )
        folders += write(
            tmp_path / "r", {f"u{i}": type(one)(**{**one.__dict__, "cell": "pendulum", "parameters": rows})}
        )
    priors = tmp_path / "next" / "unit.yaml"
    status, out, err = run("fleet", *folders, "--priors", priors, "--cell", PENDULUM / "pendulum.yaml")
    assert (status, err) == (0, "")
    assert "priors of 2 parameters" in out
    before, after = load(PENDULUM / "pendulum.yaml"), load(priors)
    assert after.name == before.name
    for old, new in zip(before.parameters, after.parameters, strict=True):
        if old.name in names:
            continue
        assert old == new
    prior = next(p for p in after.parameters if p.name == "arm@dyna@damping")
    assert prior.default == pytest.approx(0.00875, rel=0.02)
    assert 0.0005 < prior.half_width < 0.0015, "about the spread between units, 0.00065, which four hardly tell"
    assert "extends" in yaml.safe_load(priors.read_text())
    status, _, err = run(
        "fleet", *folders, "--priors", PENDULUM / "pendulum.yaml", "--cell", PENDULUM / "pendulum.yaml"
    )
    assert (status, err.count("\n")) == (1, 1)
    assert "is the cell itself" in err


@pytest.mark.slow
def test_from_recordings_to_the_priors_of_the_next_unit(tmp_path: Path, run: Command) -> None:
    """Three calibrations of one pendulum are three units that do not differ; the fourth begins where they ended."""
    cell, bags = PENDULUM / "pendulum.yaml", PENDULUM / "bags"
    for name, swings in (("a", (1,)), ("b", (3,)), ("c", (5,))):
        words = ("--no-discover", "--held-out", "0", "--progress", "none")
        folders = [bags / f"swing_{i}" for i in swings]
        assert run("calibrate", "--cell", cell, "--out", tmp_path / "units" / name, *words, *folders)[0] == 0
    status, out, err = run("history", tmp_path / "units")
    assert (status, err) == (0, "")
    status, out, err = run("fleet", tmp_path / "units", "--priors", tmp_path / "next.yaml")
    assert (status, err) == (0, "")
    assert "No unit differs from the others" in " ".join(out.split())
    words = ("--no-discover", "--held-out", "0", "--progress", "none")
    status, _, err = run(
        "calibrate", "--cell", tmp_path / "next.yaml", "--out", tmp_path / "d", *words, bags / "swing_1"
    )
    assert (status, err.count("Traceback")) == (0, 0)
    rows = {row["name"]: row for row in json.loads((tmp_path / "d" / "result.json").read_text())["parameters"]}
    assert rows["arm@dyna@damping"]["default"] == pytest.approx(0.009, rel=0.02)
    assert rows["arm@dyna@damping"]["value"] == pytest.approx(0.009, rel=0.02)
