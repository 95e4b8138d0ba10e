"""Recordings that can be read and still are odd."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from compass_ros.cells import Cell, load
from compass_ros.checks.doubts import doubts
from compass_ros.operation.current import read
from compass_ros.types import Episode, Track
from test.nodes.recordings import record


@pytest.fixture(scope="module")
def cell() -> Cell:
    return load("air_hockey")


@pytest.fixture(scope="module")
def sound(cell: Cell, tmp_path_factory: pytest.TempPathFactory) -> list[Episode]:
    return [read(cell, bag) for bag in record(tmp_path_factory.mktemp("bags"), {}, shots=8, seed=3)]


def still(episode: Episode, name: str, noise_m: float) -> Episode:
    """The episode with an object that is only seen with noise."""
    rng = np.random.default_rng(len(episode.name))
    tracks = tuple(
        replace(track, value=track.value[0] + rng.normal(0, noise_m, track.value.shape))
        if track.object == name
        else track
        for track in episode.tracks
    )
    return replace(episode, tracks=tracks)


def test_sound_recordings_raise_none(cell: Cell, sound: list[Episode]) -> None:
    assert doubts(cell, sound) == ()
    one_moves = [still(e, "puck2", 3e-4) for e in sound[1:]] + [sound[0]]
    assert doubts(cell, one_moves) == ()


def test_a_puck_that_never_moves(cell: Cell, sound: list[Episode]) -> None:
    (said,) = doubts(cell, [still(episode, "puck2", 3e-4) for episode in sound])
    assert said == "puck2 never moves in 8 episodes: nothing can be said about its parameters"


def test_a_camera_that_shakes(cell: Cell, sound: list[Episode]) -> None:
    """3 mm at 9 Hz moves both pucks; a scatter of each alone does not."""
    rng = np.random.default_rng(0)

    def shaken(episode: Episode, common: float, own: float) -> Episode:
        phase = rng.uniform(0, 2 * np.pi, 2)

        def moved(track: Track) -> Track:
            before = episode.start_ns - 16_666_667 * np.arange(15, 0, -1)
            stamp = np.concatenate([before, track.stamp_ns])
            value = np.concatenate([np.repeat(track.value[:1], 15, axis=0), track.value])
            time = (stamp - episode.start_ns) * 1e-9
            value[:, :2] += common * np.sin(2 * np.pi * 9 * time[:, None] + phase) + rng.normal(0, own, (len(time), 2))
            return replace(track, stamp_ns=stamp, value=value, std=None)

        return replace(episode, tracks=tuple(moved(track) for track in episode.tracks))

    (said,) = doubts(cell, [shaken(episode, 3e-3, 3e-4) for episode in sound])
    assert said.startswith("puck1 and puck2 jitter together while they rest (correlation 0.9")
    assert said.endswith(" mm): their camera or its mount moves")
    assert doubts(cell, [shaken(episode, 0.0, 3e-3) for episode in sound]) == ()
    assert doubts(cell, [shaken(episode, 0.0, 0.0) for episode in sound]) == ()
    unseen = [replace(shaken(episode, 3e-3, 3e-4), tracks=()) for episode in sound[:2]]
    alone = [replace(e, tracks=e.tracks[:1]) for e in (shaken(episode, 3e-3, 3e-4) for episode in sound[2:])]
    assert not any("jitter" in said for said in doubts(cell, [*unseen, *alone]))
    assert not any("jitter" in said for said in doubts(cell, []))


def test_copies(cell: Cell, sound: list[Episode]) -> None:
    (said,) = doubts(cell, [replace(sound[0], name=f"copy{i}") for i in range(8)])
    assert said.startswith("7 of 8 episodes are copies of others (copy1, copy2, copy3, ...)")


def test_few(cell: Cell, sound: list[Episode]) -> None:
    assert doubts(cell, sound[:1])[0].startswith("one episode is few")
    assert doubts(cell, sound[:5])[0].startswith("5 episodes are few")


@pytest.mark.parametrize("turns", [False, True])
def test_an_orientation_that_never_changes(turns: bool) -> None:
    cell = load("ball_flight")
    (spec,) = cell.objects
    pose = np.zeros((60, 7))
    pose[:, 0], pose[:, 3] = np.linspace(0, 1, 60), 1.0
    pose[1:, 6] = 0.1 * turns
    track = Track(spec.name, "pose", np.arange(60) * 10**7, pose)
    said = doubts(cell, [Episode(str(i), cell.name, cell.hash, {}, 0, (track,)) for i in range(8)])
    assert any("one and the same orientation" in sentence for sentence in said) is not turns
