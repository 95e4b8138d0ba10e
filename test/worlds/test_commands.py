"""A world that is told what to do is the same world."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from compass_ros.cells import load
from compass_ros.commands.conceal import conceal
from compass_ros.concealed.seal import unseal
from compass_ros.errors import ConfigError
from compass_ros.operation.current import read_usable
from compass_ros.planning.trials import SHOT
from compass_ros.types import Episode
from compass_ros.worlds.scenes import scene_of
from compass_ros.worlds.world import Asked, World
from test.worlds.task import task_of

STRIBECK = Asked(6, "one", ("stribeck_curve",))


def world(cell: str, asked: Asked) -> World:
    scene = scene_of(cell)
    assert scene is not None
    return scene(task_of(cell)[1], asked)


def values(episode: Episode) -> list[bytes]:
    return [track.value.tobytes() for track in (*episode.tracks, *episode.inputs)]


@pytest.mark.nightly
def test_a_table_that_is_told_what_it_draws_gives_the_same_bits() -> None:
    drawn = world("air_hockey", Asked(5, "one"))
    shots = np.array([[*e.action.values()] for e in drawn.episodes])
    told = world("air_hockey", Asked(5, "one", commands=shots))
    assert told.answer == drawn.answer
    assert [values(e) for e in told.episodes] == [values(e) for e in drawn.episodes]


@pytest.mark.nightly
@pytest.mark.parametrize("asked", [Asked(6, "none"), STRIBECK])
def test_an_arm_that_is_told_what_it_draws_gives_the_same_bits(asked: Asked) -> None:
    drawn = world("two_joint_arm_driven", asked)
    targets = np.stack([e.inputs[0].value for e in drawn.episodes])
    told = world("two_joint_arm_driven", replace(asked, commands=targets))
    assert told.answer == drawn.answer
    assert [values(e) for e in told.episodes] == [values(e) for e in drawn.episodes]


def true(folder: Path, answers: Path) -> tuple[Any, ...]:
    """Parameters and laws; how strong these are depends on the shots."""
    answer: Any = unseal(folder, answers).answer
    laws = [{k: v for k, v in law.items() if k != "strength"} for law in answer["laws"]]
    return answer["parameters"], laws


@pytest.mark.nightly
def test_one_shot_more_of_a_sealed_world(tmp_path: Path) -> None:
    (tmp_path / SHOT).write_text("shots:\n- {x: -0.25, y: 0.05, angle: 0.1, velocity: 0.4}\n", encoding="utf-8")
    answers = tmp_path / "answers"
    for out, commands in (("world", None), ("more", tmp_path / SHOT)):
        conceal(seed=7, out=tmp_path / out, answers=answers, forms="foreign", kind="one", commands=commands)
    first, more = (true(tmp_path / name, answers) for name in ("world", "more"))
    assert first == more
    (episode,) = read_usable(load("air_hockey"), [str(tmp_path / "more")]).episodes
    assert episode.action == {"x": -0.25, "y": 0.05, "angle": 0.1, "velocity": 0.4}


def test_who_cannot_be_told_is_said(tmp_path: Path) -> None:
    shots = tmp_path / SHOT
    with pytest.raises(ConfigError, match=r"ball_flight: --commands: its worlds are told nothing; .*: air_hockey, two"):
        conceal(seed=0, out=tmp_path / "out", answers=tmp_path / "answers", cell="ball_flight", commands=shots)
    shots.write_text("shots: [{x: -0.25, y: 0.05, angle: 0.1, velocity: 0.4}]\n", encoding="utf-8")
    with pytest.raises(ConfigError, match=r"--commands are of --forms foreign"):
        conceal(seed=0, out=tmp_path / "out", answers=tmp_path / "answers", commands=shots)
    motion = tmp_path / "next_motion.csv"
    motion.write_text("motion,time\na,0\n", encoding="utf-8")
    with pytest.raises(ConfigError, match=r"next_motion.csv: expected columns motion, target\."):
        conceal(seed=0, out=tmp_path / "out", answers=tmp_path / "answers", cell="kinova3", commands=motion)
