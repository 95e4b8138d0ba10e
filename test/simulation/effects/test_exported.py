"""Fitted effects in YAML: what is written comes back, and what is wrong is refused in one line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import yaml

from compass_ros.cells.dynamics import Sliding
from compass_ros.errors import ConfigError
from compass_ros.simulation.effects import EFFECTS, Attached, FittedEffect, read_effects, write_effects

TABLE = {"puck1": Sliding("puck1", np.array([0.04]), np.array([0.002]), np.array([0.2]))}


def fitted(name: str, *objects: str) -> FittedEffect:
    kind = EFFECTS[name]
    rng = np.random.default_rng(len(name))
    values = tuple(float(rng.uniform(q.low, q.high)) for q in kind.quantities)
    return FittedEffect(Attached(kind, objects), values, tuple(0.1 * abs(v) for v in values))


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "effects.yaml"


def test_what_is_written_comes_back(path: Path) -> None:
    effects = (fitted("swirl", "puck1", "puck2"), fitted("local_wall", "left_wall"), fitted("camera_latency"))
    write_effects(effects, TABLE, path)
    back = read_effects(path)
    assert back.effects == effects
    assert {n: [float(x[0]) for x in (s.friction, s.creep, s.load)] for n, s in back.sliding.items()} == {
        "puck1": [0.04, 0.002, 0.2]
    }


def test_values_carry_their_units(path: Path) -> None:
    write_effects([fitted("swirl", "puck1")], {}, path)
    values = yaml.safe_load(path.read_text())["effects"][0]["values"]
    assert {name: value["unit"] for name, value in values.items()} == {
        "strength": "m/s^2",
        "centre_x": "m",
        "centre_y": "m",
        "radius": "m",
        "tail": "1",
    }


def test_an_unknown_standard_deviation_stays_unknown(path: Path) -> None:
    write_effects([FittedEffect(Attached(EFFECTS["magnus"], ("puck1",)), (0.3,), (float("nan"),))], {}, path)
    assert ".nan" not in path.read_text()
    assert np.isnan(read_effects(path).effects[0].std[0])


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("name: magnus", "name: magnet", "unknown effect 'magnet'.*did you mean 'magnus'"),
        ("unit: 1/s", "unit: rad/s", r"magnus: expected values with units \{'rate': '1/s'\}"),
        ("rate:", "spin:", r"expected values with units .*found \{'spin': '1/s'\}, and no rate"),
        ("value: 0.3", "value: fast", r"effects\.0\.values\.rate\.value.*'fast'"),
        ("value: 0.3", "value: .inf", "finite"),
        ("effects:", "effect:", "effect"),
        ("load: 0.2", "lead: 0.2", "sliding"),
    ],
)
def test_a_wrong_file_is_refused_in_one_line(path: Path, old: str, new: str, says: str) -> None:
    write_effects([FittedEffect(Attached(EFFECTS["magnus"], ("puck1",)), (0.3,), (0.01,))], TABLE, path)
    text = path.read_text()
    assert text.count(old) == 1
    path.write_text(text.replace(old, new))
    with pytest.raises(ConfigError, match=says) as refused:
        read_effects(path)
    assert "\n" not in str(refused.value)
    assert str(path) in str(refused.value) or "unknown effect" in str(refused.value)
