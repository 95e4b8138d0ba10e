"""`compass check` as it is typed: a table or JSON, status 0 where recordings can be used and 1 where they cannot."""

from __future__ import annotations

import json
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from compass_ros.cells import Cell
from compass_ros.episodes.episode_writer import write_episode
from compass_ros.types import Episode
from test.checks import faults
from test.checks.faults import Fault
from test.checks.robots import ROBOTS, cell, record
from test.conftest import Run


def written(cell: Cell, episodes: Sequence[Episode], folder: Path) -> Path:
    for episode in episodes:
        write_episode(replace(episode, name=f"take_{episode.name}", cell=cell.name), folder)
    return folder


@pytest.mark.parametrize("robot", ROBOTS)
def test_clean_recordings_are_usable(robot: str, tmp_path: Path, run: Run) -> None:
    known = cell(robot, tmp_path)
    bags = written(known, record(robot, episodes=12), tmp_path / "bags")
    began = time.monotonic()
    status, out, err = run("check", "--cell", known.path, bags)
    assert time.monotonic() - began < 10
    assert (status, err) == (0, "")
    assert "Usable? Yes, 12 recordings." in out
    assert all(o.name in out for o in known.objects)


BAD: tuple[tuple[Fault, str, str], ...] = (
    (faults.zeros_of_another, "pendulum", "zeros in between"),
    (faults.another_place, "puck", "two series of values take turns"),
    (faults.sporadic_zeros, "slider", "zeros in between"),
    (faults.frozen_to_the_end, "arm", "frozen"),
    (faults.clock_jumps, "cube", "the stamps jump"),
    (faults.degrees, "servo", "degrees, not radians"),
    (faults.millimetres, "puck", "millimetres, not metres"),
)


@pytest.mark.parametrize(("fault", "robot", "looks"), BAD, ids=[f"{f.__name__}-{robot}" for f, robot, _ in BAD])
def test_wrong_ones_are_not_and_which_is_said(fault: Fault, robot: str, looks: str, tmp_path: Path, run: Run) -> None:
    known = cell(robot, tmp_path)
    spoilt = fault(record(robot), np.random.default_rng(0))
    bags = written(known, spoilt, tmp_path / "bags")
    status, out, _ = run("check", "--cell", known.path, bags)
    assert status == 1
    assert "Usable? No" in out
    assert looks in " ".join(out.split())
    status, out, _ = run("check", "--cell", known.path, "--json", bags)
    said = json.loads(out)
    assert (status, said["usable"]) == (1, False)
    (finding,) = [one for one in said["findings"] if one["severity"] == "bad"]
    assert finding["signal"] == known.objects[0].name
    clean = {f"take_{e.name}": e for e in record(robot)}
    touched = {f"take_{e.name}" for e in spoilt if _differs(e, clean[f"take_{e.name}"])}
    assert set(finding["samples"]) == touched


def _differs(one: Episode, other: Episode) -> bool:
    a, b = one.tracks[0], other.tracks[0]
    return not (np.array_equal(a.stamp_ns, b.stamp_ns) and np.array_equal(a.value, b.value))


def test_what_is_mended_is_said_and_usable(tmp_path: Path, run: Run) -> None:
    known = cell("rotor", tmp_path)
    bags = written(known, faults.wrapped(record("rotor"), np.random.default_rng(0)), tmp_path / "bags")
    status, out, _ = run("check", "--cell", known.path, bags)
    assert status == 0
    assert "Mended: spin: the angle jumps by 2 pi and goes on (wrapped): unwrapped" in " ".join(out.split())


def test_numbers_that_are_not_defined_are_null(tmp_path: Path, run: Run) -> None:
    known = cell("cube", tmp_path)
    _, out, _ = run("check", "--cell", known.path, "--json", written(known, record("cube"), tmp_path / "bags"))
    place, turn = json.loads(out)["signals"]
    assert (place["signal"], place["unit"], place["delay_s"]) == ("cube", "m", None)
    assert turn["signal"] == "orientation of cube"


def test_a_bag_that_cannot_be_read_costs_the_others_nothing(tmp_path: Path, run: Run) -> None:
    known = cell("puck", tmp_path)
    bags = written(known, record("puck"), tmp_path / "bags")
    next((bags / "take_03").glob("*.mcap")).write_bytes(b"no bag")
    status, out, _ = run("check", "--cell", known.path, "--json", bags)
    said = json.loads(out)
    assert (status, len(said["used"])) == (0, 7)
    assert [Path(one["bag"]).name for one in said["left_out"]] == ["take_03"]


def test_nothing_but_stillness_is_one_line(tmp_path: Path, run: Run) -> None:
    known = cell("pendulum", tmp_path)
    still = [
        replace(e, tracks=(replace(e.tracks[0], value=np.full_like(e.tracks[0].value, 0.3)),))
        for e in record("pendulum")
    ]
    status, out, err = run("check", "--cell", known.path, written(known, still, tmp_path / "bags"))
    assert (status, out) == (1, "")
    assert err.startswith("compass: no recording holds a motion: ")
    assert err.count("\n") == 1
