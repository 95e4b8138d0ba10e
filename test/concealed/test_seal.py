"""A seal notices what was altered, and says nothing before it is opened."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from compass_ros.concealed.seal import SEAL, seal, unseal
from compass_ros.errors import BagError, ConfigError

ANSWER = {"cell": "air_hockey", "effects": [{"name": "swirl", "size": 0.1 + 0.2}], "kind": "one"}


def sealed(tmp_path: Path) -> tuple[Path, Path, Path]:
    """World, answers, path of the answer."""
    world, answers = tmp_path / "world", tmp_path / "answers"
    bags = {}
    for name in ("shot_00", "shot_01"):
        bags[name] = world / name
        bags[name].mkdir(parents=True)
        (bags[name] / f"{name}_0.mcap").write_bytes(name.encode())
    return world, answers, seal(ANSWER, world, bags, answers)


def test_what_was_sealed_comes_out(tmp_path: Path) -> None:
    world, answers, path = sealed(tmp_path)
    opened = unseal(world, answers)
    assert opened.path == path
    assert {name: opened.answer[name] for name in ANSWER} == ANSWER


@pytest.mark.parametrize("change", [("swirl", "magnus"), ("0.30000000000000004", "0.3"), ('"salt": "', '"salt": "0')])
def test_an_altered_answer_is_noticed(tmp_path: Path, change: tuple[str, str]) -> None:
    world, answers, path = sealed(tmp_path)
    text = path.read_text()
    assert change[0] in text
    path.write_text(text.replace(*change))
    with pytest.raises(BagError, match="was altered"):
        unseal(world, answers)


def test_an_altered_bag_is_noticed(tmp_path: Path) -> None:
    world, answers, _ = sealed(tmp_path)
    (world / "shot_01" / "shot_01_0.mcap").write_bytes(b"other")
    with pytest.raises(BagError, match=r"shot_01: was altered"):
        unseal(world, answers)


def test_a_missing_answer_a_missing_seal_and_nonsense_are_one_line(tmp_path: Path) -> None:
    world, answers, path = sealed(tmp_path)
    path.write_text("{")
    with pytest.raises(BagError, match="not valid JSON"):
        unseal(world, answers)
    path.unlink()
    with pytest.raises(BagError, match="expected the answer"):
        unseal(world, answers)
    with pytest.raises(BagError, match="expected the seal"):
        unseal(tmp_path, answers)


def test_the_same_answer_twice_has_two_seals(tmp_path: Path) -> None:
    """The salt: a guess of the answer cannot be checked against the seal."""
    codes = {json.loads((sealed(tmp_path / str(i))[0] / SEAL).read_text())["sha256"] for i in range(2)}
    assert len(codes) == 2


def test_the_seal_tells_nothing(tmp_path: Path) -> None:
    world, _, _ = sealed(tmp_path)
    content = json.loads((world / SEAL).read_text())
    assert content.keys() == {"schema", "cell", "sha256", "bags"}


def test_an_answer_beside_the_bags_is_refused(tmp_path: Path) -> None:
    for answers in (tmp_path, tmp_path / "deep" / "answers"):
        with pytest.raises(ConfigError, match="beside the bags"):
            seal(ANSWER, tmp_path, {}, answers)
