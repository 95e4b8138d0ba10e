"""Worlds of balls, bars and tables from the command to what a reader of bags finds, and the sealed answer."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

from compass_ros.cells import load
from compass_ros.cli import app
from compass_ros.concealed.seal import unseal
from compass_ros.episodes import read_episodes
from compass_ros.errors import ConfigError
from compass_ros.operation.current import sources
from compass_ros.worlds.scenes import scene_of
from compass_ros.worlds.world import Asked
from test.worlds.task import task_of

SCENES = {
    "ball_flight": ("drag", "magnus"),
    "ball_flight_air": ("knuckle",),
    "bouncing_ball": ("grip",),
    "pushed_bar": ("stribeck",),
    "air_hockey": ("slope",),
}
"""Cell -> laws that are asked of it."""


@pytest.mark.nightly
@pytest.mark.parametrize("name", SCENES)
def test_what_is_concealed_can_be_read_and_unsealed(name: str, tmp_path: Path) -> None:
    out, answers = tmp_path / "world", tmp_path / "answers"
    words = ["conceal", "--cell", name, "--seed", "3", "--out", str(out), "--answers", str(answers)]
    words += [word for law in SCENES[name] for word in ("--effect", law)]
    words += ["--forms", "foreign"] if name == "air_hockey" else []
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 0, done.output
    answer, cell = unseal(out, answers).answer, load(name)
    assert [law["name"] for law in answer["laws"]] == list(SCENES[name])  # type: ignore[attr-defined]
    assert all(law["class"] and law["source"] and law["strength"] > 0 for law in answer["laws"])  # type: ignore[attr-defined]
    episodes = read_episodes([out], sources(cell), cell.name, cell.hash)
    assert len(episodes) == 12
    for episode in episodes:
        assert {track.object for track in episode.tracks} == {o.name for o in cell.objects}
        assert cell.inputs(episode).shape == (len(cell.input_names),)


@pytest.mark.parametrize("name", SCENES)
def test_every_scene_knows_what_it_was_asked_for(name: str) -> None:
    scene = scene_of(name)
    assert scene is not None
    with pytest.raises(ConfigError, match="unknown law 'phlogiston'; known: "):
        scene(task_of(name)[1], Asked(0, None, ("phlogiston",)))
