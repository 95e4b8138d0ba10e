"""The command line as a user meets it: real files with real faults, each one line and status 1; wrong use status 2."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import cv2
import numpy as np
import pytest
import yaml

from compass_ros.cells import load
from compass_ros.episodes import read_episode, write_episode
from compass_ros.episodes.bag import RawMessage, scan
from compass_ros.episodes.definitions import STRING_TYPE, embedded_definition
from compass_ros.episodes.writer import BagWriter
from compass_ros.types import Episode
from test.commands.image_bags import image_bag
from test.conftest import Run
from test.episodes.planted import PUCKS
from test.nodes.recordings import record

CELLS = Path(__file__).parents[1] / "config" / "cells"
K = [600.0, 0, 320, 0, 600, 240, 0, 0, 1]
CAMERA = {
    "image_width": 640,
    "image_height": 480,
    "camera_matrix": {"data": K},
    "distortion_coefficients": {"data": [0.0] * 5},
}


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One sound bag."""
    return record(tmp_path_factory.mktemp("good"), {}, shots=1, seed=1)[0]


@pytest.fixture
def refused(run: Run, tmp_path: Path) -> Callable[..., str]:
    """The one line of a command that has to fail with status 1 and leave nothing behind."""

    def call(*words: object) -> str:
        status, out, err = run(*words)
        assert (status, out) == (1, ""), err
        assert err.count("\n") == 1, err
        assert err.startswith("compass: ")
        written = tmp_path / "out"
        assert not written.exists() or not any(written.iterdir()), "nothing is written when the input is bad"
        return err

    return call


def changed(good: Path, folder: Path, **fields: Any) -> Path:
    """The sound bag with some of the episode's fields replaced."""
    return write_episode(replace(read_episode(good, PUCKS), **fields), folder)


def with_track(good: Path, folder: Path, **fields: Any) -> Path:
    """The sound bag with some fields of the first track replaced."""
    episode: Episode = read_episode(good, PUCKS)
    first, *others = episode.tracks
    return write_episode(replace(episode, tracks=(replace(first, **fields), *others)), folder)


def missing(good: Path, folder: Path) -> Path:
    return folder / "none"


def empty_folder(good: Path, folder: Path) -> Path:
    (folder / "bags").mkdir()
    return folder / "bags"


def empty_bag(good: Path, folder: Path) -> Path:
    BagWriter(folder / "empty").close()
    return folder / "empty"


def cut_off(good: Path, folder: Path) -> Path:
    """As a recorder leaves it that was killed."""
    bag = Path(shutil.copytree(good, folder / good.name))
    (bag / "metadata.yaml").unlink()
    (file,) = bag.glob("*.mcap")
    os.truncate(file, file.stat().st_size // 2)
    return bag


def cut_copy(good: Path, folder: Path) -> Path:
    """As a copy leaves it that was interrupted."""
    bag = Path(shutil.copytree(good, folder / good.name))
    (file,) = bag.glob("*.mcap")
    os.truncate(file, file.stat().st_size // 2)
    return bag


def foreign(good: Path, folder: Path) -> Path:
    writer = BagWriter(folder / "foreign")
    channel = writer.add_topic("/puck_tracker/puck_1/pose", embedded_definition(STRING_TYPE))
    writer.write(channel, 1, 1, b"\x00\x01\x00\x00\x02\x00\x00\x00a\x00")
    writer.close()
    return folder / "foreign"


def no_bag(good: Path, folder: Path) -> Path:
    (folder / "notes.txt").write_text("shots of Monday")
    return folder / "notes.txt"


def noise(good: Path, folder: Path) -> Path:
    (folder / "noise.mcap").write_bytes(np.random.default_rng(0).bytes(5000))
    return folder / "noise.mcap"


def other_cell(good: Path, folder: Path) -> Path:
    return changed(good, folder, cell="push_i")


def other_configuration(good: Path, folder: Path) -> Path:
    return changed(good, folder, cell_hash="0123456789abcdef")


def no_shot(good: Path, folder: Path) -> Path:
    return changed(good, folder, action={})


def not_a_number(good: Path, folder: Path) -> Path:
    """As a tracker leaves it that never saw the first puck."""
    return with_track(good, folder, value=np.full_like(read_episode(good, PUCKS).tracks[0].value, np.nan))


def backwards(good: Path, folder: Path) -> Path:
    """As a clock leaves it that was set back: two poses of puck1 in the wrong order."""
    messages = [item for item in scan(good) if isinstance(item, RawMessage)]
    poses = [i for i, message in enumerate(messages) if message.topic.name == PUCKS[0].topic]
    messages[poses[7]], messages[poses[8]] = messages[poses[8]], messages[poses[7]]
    writer = BagWriter(folder / "backwards")
    channels = {
        topic: writer.add_topic(topic.name, embedded_definition(topic.type)) for topic in {m.topic for m in messages}
    }
    for number, message in enumerate(messages):
        writer.write(channels[message.topic], number, number, message.data)
    writer.close()
    return folder / "backwards"


def before_the_shot(good: Path, folder: Path) -> Path:
    return changed(good, folder, start_ns=read_episode(good, PUCKS).start_ns + 10**10)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (missing, ["no such bag"]),
        (empty_folder, ["expected"]),
        (empty_bag, ["empty"]),
        (cut_off, ["truncated", "compass record --recover"]),
        (cut_copy, ["truncated"]),
        (foreign, ["no topic /puck_tracker/puck1/pose", "did you mean '/puck_tracker/puck_1/pose'"]),
        (no_bag, ["expected a bag"]),
        (noise, ["noise.mcap"]),
        (other_cell, ["expected 'air_hockey', found 'push_i'"]),
        (other_configuration, ["another 'air_hockey'", "0123456789abcdef"]),
        (no_shot, ["expected ['x', 'y', 'angle', 'velocity']"]),
        (not_a_number, ["nothing is left of puck1"]),
        (backwards, ["stamps out of order", "puck1"]),
        (before_the_shot, ["no frames within 2.5 s after the command"]),
    ],
    ids=lambda value: getattr(value, "__name__", "words"),
)
def test_a_bad_bag_is_one_line_that_names_it(
    make: Callable[[Path, Path], Path], words: list[str], good: Path, tmp_path: Path, refused: Callable[..., str]
) -> None:
    bag = make(good, tmp_path)
    line = refused("calibrate", bag, "--out", tmp_path / "out", "--progress", "none")
    assert all(word in line for word in words), line
    assert bag.name in line


def test_no_episodes_at_all(tmp_path: Path, refused: Callable[..., str]) -> None:
    assert "no episodes" in refused("calibrate", tmp_path, "--out", tmp_path / "out")


def own_cell(folder: Path, change: Callable[[dict[str, Any]], object]) -> Path:
    """The air-hockey cell with a mistake in it."""
    content = yaml.safe_load((CELLS / "air_hockey.yaml").read_text())
    change(content)
    shutil.copy(CELLS / "air_hockey.xml", folder)
    path = folder / "mine.yaml"
    path.write_text(yaml.safe_dump(content))
    return path


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda c: c["parameters"][4].update(default=-26), ["puck1@dyna@damping", "-26", "bounds [-25"]),
        (lambda c: c.update(causal=["puck1@dyna@dampin"]), ["'puck1@dyna@dampin'; did you mean 'puck1@dyna@damping'?"]),
        (lambda c: c["parameters"][0].update(boundz=[0, 1]), ["boundz", "did you mean 'bounds'?"]),
        (lambda c: c["parameters"][0].update(half_width=-1), ["half_width", "greater than 0"]),
        (lambda c: c.update(model="none.xml"), ["no file"]),
    ],
)
def test_a_bad_cell_is_one_line(
    change: Callable[[dict[str, Any]], object],
    words: list[str],
    good: Path,
    tmp_path: Path,
    refused: Callable[..., str],
) -> None:
    cell = own_cell(tmp_path, change)
    line = refused("calibrate", good, "--cell", cell, "--out", tmp_path / "out")
    assert all(word in line for word in [*words, "mine.yaml"]), line


def test_an_unknown_cell_says_which_there_are(good: Path, tmp_path: Path, refused: Callable[..., str]) -> None:
    line = refused("calibrate", good, "--cell", "air_hokey", "--out", tmp_path / "out")
    assert "did you mean 'air_hockey'?" in line


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("held_out_share: 2", ["held_out_share", "less than 1", "found 2"]),
        ("held_out: 0.2", ["held_out", "did you mean 'held_out_share'?"]),
        ("compass: {n_sim: 1}", ["compass.n_sim", "found 1"]),
        ("- a\n- b", ["expected a mapping"]),
        ("a: [", ["not valid YAML"]),
    ],
)
def test_a_bad_configuration_is_one_line(
    text: str, words: list[str], good: Path, tmp_path: Path, refused: Callable[..., str]
) -> None:
    file = tmp_path / "config.yaml"
    file.write_text(text)
    line = refused("calibrate", good, "--config", file, "--out", tmp_path / "out")
    assert all(word in line for word in (*words, file.name)), line


def test_an_output_that_cannot_be_written_is_said_before_the_work(good: Path, tmp_path: Path, run: Run) -> None:
    (tmp_path / "file").write_text("")
    status, _, err = run("calibrate", good, "--out", tmp_path / "file", "--no-discover", "--progress", "none")
    assert status == 1
    assert "cannot be written" in err


def blank_video(folder: Path) -> Path:
    path = folder / "blank.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 60, (640, 480))
    for _ in range(3):
        writer.write(np.full((480, 640, 3), 120, np.uint8))
    writer.release()
    return path


def camera_file(folder: Path, content: Mapping[str, object] = CAMERA) -> Path:
    path = folder / "camera.yaml"
    path.write_text(yaml.safe_dump(dict(content)))
    return path


def test_tracking_that_cannot_work_is_one_line(good: Path, tmp_path: Path, refused: Callable[..., str]) -> None:
    (tmp_path / "bad").mkdir()
    out, camera = tmp_path / "out", camera_file(tmp_path)
    gray = np.full((480, 640, 3), 120, np.uint8)
    blank, video = image_bag(tmp_path / "blank", [(1, gray), (2, gray)], K), blank_video(tmp_path)
    small = image_bag(tmp_path / "small", [(1, gray[:48, :64])], K)
    for words, expected in (
        ((blank,), "none of 2 images could be used: no fiducials in view"),
        ((video, "--camera", camera), "none of 3 images could be used: no fiducials in view"),
        ((video,), "give --camera"),
        ((good,), "expected images"),
        ((blank, "--topic", "/imag"), "expected images on /imag"),
        ((tmp_path / "none.mp4", "--camera", camera), "no such file"),
        ((tmp_path / "none",), "no such video or bag"),
        ((camera, "--camera", camera), "not a video"),
        ((small, "--camera", camera), "image 0: image is 64x48"),
        ((blank, "--config", camera), "camera.yaml"),
        ((blank, "--camera", camera_file(tmp_path / "bad", {"camera_matrix": 3})), "camera_matrix"),
    ):
        assert expected in refused("track", *words, "--out", out), expected


def test_wrong_use_is_status_2(run: Run, tmp_path: Path) -> None:
    for words in (
        ("calibrat",),
        ("calibrate",),
        ("calibrate", "bag", "--held-out", "2"),
        ("calibrate", "bag", "--progress", "loud"),
        ("demo", "--shots", "2"),
        ("demo", "--out"),
        ("record",),
        ("track",),
    ):
        status, out, err = run(*words)
        assert status == 2, words
        assert out == ""
        assert "Traceback" not in err


def test_the_version_is_that_of_the_package(run: Run) -> None:
    package = Path(__file__).parents[1] / "package.xml"
    assert run("--version") == (0, f"compass_ros {ElementTree.parse(package).findtext('version')}\n", "")


def test_the_demo_refuses_effects_that_it_cannot_conceal(tmp_path: Path, run: Run) -> None:
    for name, expected in (("camera_scale", "may conceal none, table_tilt"), ("swril", "did you mean 'swirl'")):
        words = ("--shots", "4", "--effect", name, "--out", tmp_path / "demo", "--answers", tmp_path / "answers")
        status, _, err = run("demo", *words)
        assert status == 1
        assert expected in err
        assert not (tmp_path / "answers").exists()


def test_the_demo_overwrites_nothing_of_others(tmp_path: Path, run: Run) -> None:
    (tmp_path / "thesis.tex").write_text("years of work")
    status, _, err = run("demo", "--out", tmp_path)
    assert status == 1
    assert err == f"compass: {tmp_path}: exists and holds no earlier demonstration; it is not overwritten\n"
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]


def test_a_table_of_no_results_is_one_line(tmp_path: Path, refused: Callable[..., str]) -> None:
    nowhere = tmp_path / "none.jsonl"
    assert f"{nowhere}: no results" in refused("prove", "--table", "--out", nowhere)


def test_a_cut_bag_is_made_whole(good: Path, tmp_path: Path, run: Run) -> None:
    bag = cut_off(good, tmp_path)
    status, out, _ = run("record", "--recover", bag)
    assert status == 0
    assert "whole again" in out
    assert len(read_episode(bag, PUCKS).tracks[0].stamp_ns) > 10


def test_the_recordings_of_this_file_are_of_this_cell(good: Path) -> None:
    assert read_episode(good, PUCKS).cell_hash == load("air_hockey").hash
