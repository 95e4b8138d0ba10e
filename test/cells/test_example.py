"""The cell of the documentation: its bags give back the numbers that they were made with."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import yaml

from compass_ros.cells import load
from compass_ros.cells.fields import parse
from compass_ros.config import calibration_config
from compass_ros.episodes import Source, read_episodes
from compass_ros.pipeline import calibrate
from compass_ros.simulation import Simulator
from compass_ros.simulation.effects import EFFECTS
from compass_ros.simulation.replay import Replay, recordings
from compass_ros.types import Episode

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "examples" / "own_cell"
CELL = load(FOLDER / "pendulum.yaml")
TRUTH = {"arm@dyna@damping": 0.009, "arm@dyna@centre": -0.371, "encoder@sensing@offset": 0.03}


def episodes() -> tuple[Episode, ...]:
    sources = [Source(o.topic, o.name, o.quantity) for o in CELL.objects]
    return read_episodes([FOLDER / "bags"], sources, CELL.name, CELL.hash)


def test_with_its_true_numbers_the_cell_says_what_the_bags_hold() -> None:
    replay = Replay(Simulator(CELL, threads=1), recordings(CELL, episodes()))
    nominal, true = (replay.gap(CELL.values(values)).rmse_m for values in ({}, TRUTH))
    assert nominal > 0.05
    assert true < 0.015, "what the first velocity from nine frames leaves"


def test_the_calibration_finds_them() -> None:
    result, _ = calibrate(episodes(), CELL, calibration_config({"discover": False, "held_out_share": 0.0}))
    found = {row.name: row for row in result.parameters}
    for name, value in TRUTH.items():
        assert found[name].identifiable
        assert found[name].value == pytest.approx(value, rel=0.02), name
    assert not found["env@dyna@gravity"].identifiable


@pytest.mark.slow
def test_nothing_is_missing_and_the_sentence_says_what_the_table_says() -> None:
    """The first velocity is fitted to each held-out swing, for both."""
    result, _ = calibrate(episodes(), CELL, calibration_config({}))
    assert result.mismatch.verdict == "none"
    held_out = result.gap["calibrated"]["held_out"].rmse_m
    assert f"held-out error {1e3 * held_out:.2f} mrad" in result.mismatch.sentence


def test_every_effect_says_whether_it_can_act_on_a_joint_that_no_body_is_named_after() -> None:
    simulator = Simulator(CELL, threads=1)
    able = {name for name, effect in EFFECTS.items() if effect.moves and simulator.accepts(effect, ["swing"])}
    assert {"coulomb_friction", "viscous_drag"} <= able
    assert "off_centre_mass" not in able


def test_the_documentation_names_fields_that_exist() -> None:
    text = (ROOT / "docs" / "your-own-cell.md").read_text(encoding="utf-8")
    table = text[text.index("| kind |") : text.index("A choice is taken")]
    named = re.findall(r"`((?:opt\.)?[a-z_]+)(?:\[[a-z0-9]+\])?`", table)
    assert len(named) > 40
    for field in set(named) - {"of", "kind", "fields"}:
        parse(field, "docs/your-own-cell.md")


def test_the_smallest_yaml_of_the_documentation_works(tmp_path: Path) -> None:
    text = (ROOT / "docs" / "your-own-cell.md").read_text(encoding="utf-8")
    content = re.search(r"```yaml\n(name: pendulum.*?)```", text, re.DOTALL)
    assert content is not None
    (tmp_path / "pendulum.yaml").write_text(content[1], encoding="utf-8")
    (tmp_path / "pendulum.xml").write_text((FOLDER / "pendulum.xml").read_text(encoding="utf-8"), encoding="utf-8")
    cell = load(tmp_path / "pendulum.yaml")
    assert len(cell.parameters) > 20
    assert yaml.safe_load(content[1])["auto"]
    seen = Simulator(cell, threads=1).observe(cell.defaults[None], np.array([[1.0, 0.0]]), np.array([[0.5]]))
    assert np.isfinite(seen).all()
