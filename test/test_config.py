"""The one configuration: defaults after the paper, one line for whatever is wrong, and a line that stays short."""

from __future__ import annotations

import time
from dataclasses import asdict
from pathlib import Path

import pytest

from compass_ros.config import CalibrationConfig, calibration_config, read_yaml
from compass_ros.errors import ConfigError
from compass_ros.plain_yaml import LARGEST


def bomb() -> object:
    """A list that, written out, has 9^9 words, and takes no room as it is."""
    found: object = "x"
    for _ in range(9):
        found = [found] * 9
    return found


HOSTILE = {
    "aliases": "a: &a [x]\nseed: [*a, *a]",
    "merged aliases": "a: &a {k: 1}\nseed: {<<: *a}",
    "brackets": "seed: " + "[" * 100_000,
    "braces": "seed: " + "{a: " * 10_000,
    "nested lists": "- " * 20_000 + "x",
    "number of 5000 digits": "seed: " + "1" * 5000,
    "hexadecimal number": "seed: 0x" + "f" * 100_000,
    "number that is none": "seed: !!int foo",
    "truth that is none": "seed: !!bool foo",
    "date": "seed: !!timestamp foo",
    "binary": "seed: !!binary QUFB",
    "Python": "seed: !!python/object/apply:os.system ['touch owned']",
    "too long": "seed: 1 # " + "x" * LARGEST,
}


def test_the_whole_configuration_can_be_written_down_and_read_again() -> None:
    config = CalibrationConfig(method="compass", seed=3, rollouts=100, held_out_share=0.5)
    assert calibration_config(asdict(config)) == config
    assert calibration_config({}) == CalibrationConfig()


def test_the_papers_hyperparameters_are_the_defaults() -> None:
    compass = CalibrationConfig().compass
    assert (compass.n_round, compass.n_cmd_action, compass.n_sim) == (10, 10, 64)
    assert (compass.sparse_weight, compass.sw_discount, compass.hidden_dim) == (0.003, 0.5, (256, 256))


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ({"seed": -1}, ["seed", "greater than or equal to 0", "found -1"]),
        ({"methods": "random"}, ["methods", "did you mean 'method'?"]),
        ({"compass": {"n_rounds": 3}}, ["compass.n_rounds", "did you mean 'n_round'?"]),
        ({"compass": {"hidden_dim": ["wide"]}}, ["compass.hidden_dim", "found"]),
        ({"discover": None}, ["discover", "found None"]),
        ({"false_alarm": 0}, ["false_alarm", "greater than or equal to 0.0001", "found 0"]),
        ({"false_alarm": 0.5}, ["false_alarm", "less than 0.5", "found 0.5"]),
        ({"false_alarm": "never"}, ["false_alarm", "found 'never'"]),
    ],
)
def test_what_is_wrong_is_named(content: dict[str, object], words: list[str]) -> None:
    with pytest.raises(ConfigError) as caught:
        calibration_config(content, "here.yaml")
    said = str(caught.value)
    assert said.startswith("here.yaml: ")
    assert all(word in said for word in words), said


@pytest.mark.parametrize(
    "value",
    [bomb(), "x" * 10**6, ["y" * 10**6] * 3, {"z" * 10**6: "z" * 10**6}, 2**100_000, list(range(10**5)), b"b" * 10**6],
    ids=["bomb", "text", "texts", "mapping", "number", "list", "bytes"],
)
def test_a_value_that_would_fill_the_screen_is_shown_short(value: object) -> None:
    for content in ({"discover": value}, {"compass": {"hidden_dim": {"a": value}}}):
        with pytest.raises(ConfigError, match=r"discover|hidden_dim") as caught:
            calibration_config(content)
        assert len(str(caught.value)) < 350
        assert "\n" not in str(caught.value)


@pytest.mark.parametrize("kind", HOSTILE)
def test_a_hostile_yaml_is_refused_at_once_with_one_line(tmp_path: Path, kind: str) -> None:
    path = tmp_path / "hostile.yaml"
    path.write_text(HOSTILE[kind])
    before = time.process_time()
    with pytest.raises(ConfigError, match=r"hostile\.yaml: not valid YAML: ") as caught:
        read_yaml(path)
    assert time.process_time() - before < 60, "expanded, it would not end"
    assert len(str(caught.value)) < 400 + len(str(path))
    assert "\n" not in str(caught.value)


def test_what_a_plain_yaml_may_say(tmp_path: Path) -> None:
    path = tmp_path / "plain.yaml"
    path.write_text("a: [1, -2.5e+3, .inf, true, null, ~, 0x1f, text]\nb: {day: 2026-11-20, quoted: '1'}\n")
    content = read_yaml(path)
    assert content["a"] == [1, -2500.0, float("inf"), True, None, None, 31, "text"]
    assert content["b"] == {"day": "2026-11-20", "quoted": "1"}


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("a: 1\nb: {c: 1, d: 2}\na: 3\n", "the key 'a' stands twice, in line 1 and in line 3"),
        ("a: 1\nb: {c: 1, c: 2}\n", "the key 'c' stands twice, both in line 2"),
        ("a: 1\nb: \x07\n", "line 2: a letter that YAML does not have, number 7"),
        ("a: 'x\nb: 2\n", "line 3: found unexpected end of stream, while scanning a quoted scalar that"),
        ("a: 1\n\tb: 2\n", "line 2: "),
    ],
)
def test_a_broken_yaml_is_refused_with_the_line_of_its_fault(tmp_path: Path, text: str, says: str) -> None:
    path = tmp_path / "broken.yaml"
    path.write_text(text)
    with pytest.raises(ConfigError) as caught:
        read_yaml(path)
    assert str(caught.value).startswith(f"{path}: not valid YAML: {says}")
    assert "\n" not in str(caught.value)
    assert "unicode string" not in str(caught.value)
