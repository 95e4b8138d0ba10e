"""`compass unseal` of a world from another engine: its truth, and the table of what a result said beside it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from compass_ros.cli import app
from compass_ros.commands.unseal_scene import show
from compass_ros.errors import BagError

FRICTION = {
    "name": "lugre_friction",
    "class": ["stribeck_friction"],
    "sites": ["elbow"],
    "quantities": {"bristle_nm_rad": [812.5], "model": "measured"},
    "source": "a paper",
    "strength": 7.3,
}


def answer(*laws: dict[str, Any]) -> dict[str, Any]:
    return {
        "cell": "two_joint_arm",
        "seed": 4,
        "kind": "one" if laws else "none",
        "laws": list(laws),
        "strength": max([0.0, *(law["strength"] for law in laws)]),
        "parameters": {"elbow@dyna@damping": 0.02},
    }


def result(verdict: str, *explanations: dict[str, Any]) -> dict[str, Any]:
    damping = {"name": "elbow@dyna@damping", "value": 0.023, "std": 0.002, "identifiable": True}
    return {
        "mismatch": {"verdict": verdict, "explanations": list(explanations), "false_alarm": 0.01},
        "parameters": [damping],
    }


def explanation(name: str) -> dict[str, Any]:
    size = {"value": 0.1234, "std": 0.011, "unit": "N m"}
    return {
        "laws": [{"name": name, "sites": ["elbow"], "quantities": {"more_at_rest": size}}],
        "probability": 0.97,
        "held_out": {"before": 0.0123, "after": 0.0021, "floor": 0.002, "unit": "rad"},
    }


def shown(capsys: pytest.CaptureFixture[str], said: dict[str, Any], true: dict[str, Any]) -> str:
    """The table as one line of words."""
    show(said, true)
    return " ".join(capsys.readouterr().out.replace("│", " ").split())


def test_what_was_named_stands_beside_the_truth(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    said = shown(capsys, result("named", explanation("stribeck_friction")), answer(FRICTION))
    for words in (
        "two_joint_arm, seed 4: the seal is whole",
        "named: stribeck_friction on elbow (probability 0.97) lugre_friction on elbow, 7.3 times the noise right",
        "lugre_friction: may be called stribeck_friction",
        "sites elbow elbow right",
        "stribeck_friction on elbow: more_at_rest 0.1234 +- 0.011 N m",
        "lugre_friction: bristle_nm_rad 812.5",
        "lugre_friction: model measured",
        "held-out error, with laws 0.0021 rad",
        "median 1.5 error bars off",
    ):
        assert words in said


def test_a_wrong_name_and_a_right_silence_are_marked(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    said = shown(capsys, result("named", explanation("spring")), answer(FRICTION))
    assert "lugre_friction on elbow, 7.3 times the noise wrong" in said
    assert "sites" not in said
    assert "verdict none nothing is missing right" in shown(capsys, result("none"), answer())


@pytest.mark.slow
def test_a_world_alone_says_what_is_true_of_it(tmp_path: Path) -> None:
    world, answers = tmp_path / "world", tmp_path / "answers"
    runner = CliRunner()
    asked = ["conceal", "--cell", "ball_flight", "--seed", "3", "--out", str(world), "--answers", str(answers)]
    assert runner.invoke(app, asked).exit_code == 0
    told = runner.invoke(app, ["unseal", str(world), "--answers", str(answers)])
    assert told.exit_code == 0, told.output
    assert told.stdout.startswith("true: ")
    assert "times the noise" in told.stdout or "nothing is missing" in told.stdout
    taken = runner.invoke(app, asked)
    assert "is not empty" in str(taken.exception)
    next(answers.glob("*.json")).unlink()
    gone = runner.invoke(app, ["unseal", str(world), "--answers", str(answers)])
    assert isinstance(gone.exception, BagError)
