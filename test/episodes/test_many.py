"""One bad bag among many, of eight kinds: the others are read, and it is named with its reason."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from compass_ros.episodes import read_each, write_episode
from compass_ros.episodes.many import find_each
from compass_ros.episodes.recording import Connection, Recorder
from compass_ros.errors import BagError, DataError
from compass_ros.types import Episode
from test.episodes.planted import PUCKS, START_NS, episode, mcap_file, pose_bag
from test.episodes.test_recording import POSES


def _nothing(bag: Path) -> None:
    shutil.rmtree(bag)


def _empty(bag: Path) -> None:
    """As the recorder leaves an episode without data."""
    shutil.rmtree(bag)
    recorder = Recorder(bag.parent)
    recorder.connect(Connection(PUCKS[0].topic, POSES.definition))
    recorder.start(bag.name, "air_hockey", "a1b2", {}, START_NS)
    recorder.stop()
    recorder.close()


def _cut(bag: Path) -> None:
    file = mcap_file(bag)
    file.write_bytes(file.read_bytes()[:-300])


def _text(bag: Path) -> None:
    mcap_file(bag).write_text("no bag")


def _another_cell(bag: Path) -> None:
    shutil.rmtree(bag)
    write_episode(replace(episode(bag.name), cell="push_i"), bag.parent)


def _another_configuration(bag: Path) -> None:
    shutil.rmtree(bag)
    write_episode(replace(episode(bag.name), cell_hash="ffff"), bag.parent)


def _one_puck(bag: Path) -> None:
    shutil.rmtree(bag)
    pose_bag(bag, [START_NS, START_NS + 1], [(0.0, 0.0)] * 2)


def _no_metadata(bag: Path) -> None:
    """metadata.yaml names a file that is gone."""
    mcap_file(bag).unlink()


DAMAGE: dict[Callable[[Path], None], str] = {
    _nothing: "no such bag",
    _empty: "no messages on /puck_tracker/puck1/pose",
    _cut: "truncated",
    _text: "expected MCAP",
    _another_cell: "expected 'air_hockey', found 'push_i'",
    _another_configuration: "expected configuration a1b2, found ffff",
    _one_puck: "no topic /puck_tracker/puck2/pose",
    _no_metadata: "is missing",
}


@pytest.mark.parametrize("damage", DAMAGE, ids=lambda f: f.__name__)
def test_a_bad_bag_costs_the_others_nothing(damage: Callable[[Path], None], tmp_path: Path) -> None:
    bags = [write_episode(episode(f"shot_{number}"), tmp_path / "bags") for number in range(3)]
    damage(bags[1])
    for paths in (bags, [bags[0], tmp_path / "bags"]):
        if paths is not bags and damage is _nothing:
            continue  # a folder does not know what is gone
        found = read_each(paths, PUCKS, "air_hockey", "a1b2")
        assert [one.name for one in found.episodes] == ["shot_0", "shot_2"]
        (left_out,) = found.left_out
        assert left_out.bag == str(bags[1])
        assert DAMAGE[damage] in left_out.reason
        assert not left_out.reason.startswith(str(bags[1])), "the bag is named once"
        assert "\n" not in str(left_out)
    with pytest.raises(BagError, match="shot_1"):
        read_each([bags[1]], PUCKS, "air_hockey", "a1b2")


def test_an_episode_of_no_use_is_left_out_too(tmp_path: Path) -> None:
    bags = [write_episode(episode(f"shot_{number}"), tmp_path) for number in range(3)]

    def use(one: Episode) -> None:
        if one.name == "shot_2":
            raise DataError(f"{one.source}: no frames after the command")

    found = read_each([tmp_path], PUCKS, use=use)
    assert [(one.bag, one.reason) for one in found.left_out] == [(str(bags[2]), "no frames after the command")]


def test_where_nothing_is_left_one_line_says_why(tmp_path: Path) -> None:
    bags = [write_episode(episode(f"shot_{number}"), tmp_path) for number in range(3)]
    for bag in bags:
        _cut(bag)
    with pytest.raises(BagError, match=r"shot_0.*: truncated.*; none of the other 2 can be used either"):
        read_each([tmp_path], PUCKS)
    with pytest.raises(BagError, match="expected at least one bag"):
        find_each([])
