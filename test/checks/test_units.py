"""Degrees on a driven arm whose driver says positions and commands in them, and whose joints mostly rest."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from compass_ros.cells import Cell
from compass_ros.checks.check import check
from compass_ros.simulation import Simulator
from compass_ros.simulation.driven import driven_joints, virtual_recordings
from compass_ros.types import Episode, Floats, Track
from test.planning.scenes import arm

JOINTS = ("joints.shoulder", "joints.elbow")


def recorded(cell: Cell) -> list[Episode]:
    """One joint moves in each of four recordings, in most of one of them; the other one rests at zero."""
    simulator, time = Simulator(cell, threads=1), np.arange(401) / 100
    series = np.zeros((4, len(time), 2))
    for i, (joint, begins, size) in enumerate([(0, 3.0, 0.9), (1, 3.0, -1.1), (0, 0.5, -0.8), (1, 0.5, 1.0)]):
        series[i, :, joint] = size * np.sin(np.pi * np.clip((time - begins) / 4.0, 0, None)) ** 2
    rng = np.random.default_rng(0)
    return virtual_recordings(simulator, driven_joints(simulator), simulator.defaults, time, series, series[:, 0], rng)


def times(factor: Floats, tracks: tuple[Track, ...]) -> tuple[Track, ...]:
    return tuple(replace(t, value=t.value * factor) for t in tracks)


def found(cell: Cell, episodes: list[Episode]) -> set[tuple[str, str]]:
    return {(one.kind, one.signal) for one in check(cell, episodes).findings if one.severity == "bad"}


def test_radians_are_radians(tmp_path: Path) -> None:
    cell = arm(tmp_path)
    assert found(cell, recorded(cell)) == set()


@pytest.mark.parametrize("commands", [False, True])
def test_degrees_are_degrees_whatever_the_commands_are_in(tmp_path: Path, commands: bool) -> None:
    cell, degrees = arm(tmp_path), np.full(2, 180 / np.pi)
    said = [
        replace(e, tracks=times(degrees, e.tracks), inputs=times(degrees if commands else np.ones(2), e.inputs))
        for e in recorded(cell)
    ]
    assert found(cell, said) == {("units", joint) for joint in JOINTS}


def test_one_joint_in_degrees_is_said_alone(tmp_path: Path) -> None:
    cell, first = arm(tmp_path), np.array([180 / np.pi, 1.0])
    said = [replace(e, tracks=times(first, e.tracks), inputs=times(first, e.inputs)) for e in recorded(cell)]
    assert found(cell, said) == {("units", JOINTS[0])}
