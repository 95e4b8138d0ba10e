"""The recorder's core: one bag an episode, names, losses, types that change, clocks that step, folders taken."""

from __future__ import annotations

import os
import shutil
from dataclasses import replace
from pathlib import Path

import pytest
from mcap.reader import make_reader

from compass_ros.episodes import list_topics, read_episode, recover
from compass_ros.episodes.bag import RawMessage, scan
from compass_ros.episodes.definitions import EPISODE_TYPE, POSE_TYPE, embedded_definition, typestore
from compass_ros.episodes.notes import EpisodeHeader, header
from compass_ros.episodes.recording import Connection, Recorder
from compass_ros.errors import BagError
from test.episodes.planted import PUCK1, START_NS, mcap_file, pose_bytes

TOPIC = PUCK1[0].topic
POSES = Connection(TOPIC, embedded_definition(POSE_TYPE))
STEP_NS = 10_000_000


def feed(recorder: Recorder, frames: range, log_ns: int = START_NS, **sequence: int) -> None:
    for frame in frames:
        stamp = START_NS + frame * STEP_NS
        recorder.take(TOPIC, pose_bytes(stamp, x=frame), log_ns + frame * STEP_NS, stamp, **sequence)


def headers(bag: Path) -> list[EpisodeHeader]:
    messages = [item for item in scan(bag) if isinstance(item, RawMessage) and item.topic.type == EPISODE_TYPE]
    return [header(typestore().deserialize_cdr(item.data, EPISODE_TYPE)) for item in messages]


@pytest.fixture
def recorder(tmp_path: Path) -> Recorder:
    found = Recorder(tmp_path)
    found.connect(POSES)
    return found


def test_an_episode_from_start_to_stop(recorder: Recorder) -> None:
    feed(recorder, range(3))  # nothing runs yet
    started = recorder.start("shot", "air_hockey", "a1b2", {"x": 0.5}, START_NS)
    assert (started.state, started.messages, Path(started.bag)) == ("recording", 2, recorder.folder / "shot")
    feed(recorder, range(20))
    assert recorder.progress().messages == 22
    stopped = recorder.stop()
    assert (stopped.state, stopped.messages, stopped.message) == ("finished", 22, "")
    assert stopped.duration_ns == 19 * STEP_NS
    found = read_episode(stopped.bag, PUCK1, "air_hockey", "a1b2")
    assert (found.name, found.action, found.start_ns) == ("shot", {"x": 0.5}, START_NS)
    assert found.tracks[0].value[:, 0].tolist() == list(range(20))
    assert [said.state for said in headers(Path(stopped.bag))] == ["recording", "finished"]


def test_bytes_are_kept_as_they_came(recorder: Recorder) -> None:
    odd = [b"\x00\x01\x00\x00", b"", os.urandom(1000), b"\xff" * 70000]
    recorder.start("shot", "", "", {}, START_NS)
    for number, data in enumerate(odd):
        recorder.take(TOPIC, data, START_NS + number, 17)
    bag = Path(recorder.stop().bag)
    with mcap_file(bag).open("rb") as file:
        stored = [message for _, channel, message in make_reader(file).iter_messages() if channel.topic == TOPIC]
    assert [message.data for message in stored] == odd
    assert [message.publish_time for message in stored] == [17] * 4


def test_numbered_names_go_on_after_what_is_there(recorder: Recorder) -> None:
    (recorder.folder / "episode_0041").mkdir()
    for expected in ("episode_0042", "episode_0043"):
        assert recorder.start("", "", "", {}, START_NS).episode == expected
        recorder.stop()


@pytest.mark.parametrize("name", ["..", "../x", "/tmp/x", "a/b", "~root", "x\0y"])
def test_names_that_leave_the_folder(recorder: Recorder, name: str) -> None:
    before = sorted(recorder.folder.parent.rglob("*"))
    with pytest.raises(BagError, match="episode name"):
        recorder.start(name, "", "", {}, START_NS)
    assert sorted(recorder.folder.parent.rglob("*")) == before
    assert not recorder.recording


def test_requests_out_of_turn(recorder: Recorder) -> None:
    for act in (recorder.stop, recorder.discard):
        with pytest.raises(BagError, match="no episode is being recorded"):
            act()
    recorder.start("one", "", "", {}, START_NS)
    with pytest.raises(BagError, match="episode one is being recorded; stop or discard it first"):
        recorder.start("two", "", "", {}, START_NS)
    recorder.stop()
    with pytest.raises(BagError, match="exists already"):
        recorder.start("one", "", "", {}, START_NS)
    assert not recorder.recording


def test_a_discarded_episode_leaves_nothing(recorder: Recorder) -> None:
    recorder.start("shot", "", "", {}, START_NS)
    feed(recorder, range(5))
    assert recorder.discard().state == "discarded"
    assert [path.name for path in recorder.folder.iterdir()] == [".recorder.lock"]
    recorder.start("shot", "", "", {}, START_NS)


def test_an_episode_is_discarded_after_its_end_once(recorder: Recorder) -> None:
    for name in ("kept", "last"):
        recorder.start(name, "", "", {}, START_NS)
        feed(recorder, range(5))
        recorder.stop()
    told = recorder.discard()
    assert (told.state, told.episode, Path(told.bag).name) == ("discarded", "last", "last")
    assert sorted(path.name for path in recorder.folder.iterdir()) == [".recorder.lock", "kept"]
    with pytest.raises(BagError, match="there is no last one to discard"):
        recorder.discard()
    recorder.start("last", "", "", {}, START_NS)
    recorder.stop()
    shutil.rmtree(recorder.folder / "last")
    with pytest.raises(BagError, match=r"last: cannot be deleted: No such file"):
        recorder.discard()


@pytest.mark.parametrize(
    ("action", "connected", "latched", "words"),
    [
        ({}, True, 0, "no data: no message came on any of its topics"),
        ({"x": 0.5}, True, 0, "no data: no message came on any of its topics"),
        ({}, False, 0, "no data: no message came on any topic, none has a publisher"),
        ({}, True, 1, "no data: no message came on any of its topics"),
    ],
    ids=["nothing", "the shot alone", "no publisher", "latched messages from before"],
)
def test_an_episode_without_data_says_so_when_it_stops(
    tmp_path: Path, action: dict[str, float], connected: bool, latched: int, words: str
) -> None:
    recorder = Recorder(tmp_path)
    if connected:
        recorder.connect(replace(POSES, latched=latched))
    if latched:
        feed(recorder, range(1))
    recorder.start("shot", "", "", action, START_NS)
    said = recorder.stop()
    assert (said.state, said.message) == ("finished", words)
    assert headers(Path(said.bag))[-1].message == words, "and in the bag"
    recorder.start("next", "", "", action, START_NS)
    if connected:
        feed(recorder, range(1))
        assert recorder.stop().message == ""


def test_a_topic_that_stops_in_the_middle_is_named_with_the_episode(recorder: Recorder) -> None:
    recorder.start("shot", "", "", {}, START_NS)
    feed(recorder, range(30))
    end_ns = START_NS + 29 * STEP_NS
    assert recorder.stop(now_ns=end_ns + 3_200_000_000).message == f"{TOPIC} stopped 3.2 s before the end"
    recorder.start("next", "", "", {}, START_NS)
    feed(recorder, range(30))
    assert recorder.stop(now_ns=end_ns + 1_000_000_000).message == "", "a person takes a second to stop an episode"


@pytest.mark.parametrize("folder", ["bags", "./bags", "../here/bags", "~/bags"])
def test_what_is_announced_is_absolute(folder: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    monkeypatch.setenv("HOME", str(tmp_path / "here"))
    recorder = Recorder(Path(folder))
    bag = Path(recorder.start("shot", "", "", {}, START_NS).bag)
    assert bag.is_absolute()
    assert bag.samefile(tmp_path / "here" / "bags" / "shot")


def test_two_recorders_on_one_folder(recorder: Recorder) -> None:
    with pytest.raises(BagError, match=rf"another recorder \(process {os.getpid()}\) records here"):
        Recorder(recorder.folder)
    recorder.close()
    Recorder(recorder.folder).close()


def test_lost_messages_are_counted_by_the_publishers_count(recorder: Recorder) -> None:
    recorder.start("shot", "", "", {}, START_NS)
    for sequence in (7, 8, 11, 12, 20):
        feed(recorder, range(sequence, sequence + 1), sequence=sequence)
    assert recorder.stop().message == f"lost 9 messages on {TOPIC}"
    recorder.start("next", "", "", {}, START_NS)
    feed(recorder, range(30, 31), sequence=90)  # between the episodes nothing was wanted
    feed(recorder, range(31, 32), sequence=1)  # the publisher was started anew
    assert recorder.stop().message == ""


def test_a_clock_that_steps_back(recorder: Recorder) -> None:
    """Stamps stay as they are; log times, which readers rely on, do not go back."""
    recorder.start("shot", "", "", {}, START_NS)
    feed(recorder, range(10))
    feed(recorder, range(10, 20), log_ns=START_NS - 3600 * 10**9)
    stopped = recorder.stop()
    assert stopped.message == "the clock stepped back 10 times"
    assert stopped.duration_ns == 9 * STEP_NS
    with mcap_file(Path(stopped.bag)).open("rb") as file:
        times = [message.log_time for _, _, message in make_reader(file).iter_messages(log_time_order=False)]
    assert times == sorted(times)
    assert read_episode(stopped.bag, PUCK1).tracks[0].value[:, 0].tolist() == list(range(20))


def test_a_topic_that_changes_its_type(recorder: Recorder) -> None:
    recorder.start("shot", "", "", {}, START_NS)
    feed(recorder, range(3))
    recorder.connect(Connection(TOPIC, embedded_definition("std_msgs/msg/String")))
    recorder.take(TOPIC, b"\x00\x01\x00\x00\x01\x00\x00\x00\x00", START_NS + 3 * STEP_NS, 0)
    stopped = recorder.stop()
    assert stopped.message == f"{TOPIC} changed from {POSE_TYPE} to std_msgs/msg/String"
    counts = {(topic.name, topic.type): topic.messages for topic in list_topics(stopped.bag)}
    assert counts[TOPIC, POSE_TYPE] == 3
    assert counts[TOPIC, "std_msgs/msg/String"] == 1
    with pytest.raises(BagError, match=f"{TOPIC} changes from {POSE_TYPE} to std_msgs/msg/String in this bag"):
        read_episode(stopped.bag, PUCK1)


def test_a_topic_that_appears_in_the_middle(recorder: Recorder) -> None:
    recorder.start("shot", "", "", {}, START_NS)
    recorder.connect(Connection("/late", embedded_definition("std_msgs/msg/String")))
    recorder.take("/late", b"\x00\x01\x00\x00\x01\x00\x00\x00\x00", START_NS, 0)
    counts = {topic.name: topic.messages for topic in list_topics(recorder.stop().bag)}
    assert counts["/late"] == 1
    assert counts[TOPIC] == 0, "a topic that stayed silent is in the bag, with no messages"


def test_an_episode_that_nobody_stops(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path, max_duration_ns=5 * STEP_NS)
    recorder.connect(POSES)
    assert not recorder.overdue(START_NS)
    recorder.start("shot", "", "", {}, START_NS)
    assert not recorder.overdue(START_NS + 5 * STEP_NS)
    assert recorder.overdue(START_NS + 5 * STEP_NS + 1)
    feed(recorder, range(1))
    assert recorder.stop("ended by itself").message == "ended by itself"


def test_a_recorder_that_is_stopped_in_an_episode_leaves_it_recoverable(recorder: Recorder) -> None:
    recorder.start("shot", "", "", {}, START_NS)
    feed(recorder, range(5))
    recorder.close()
    bag = recorder.folder / "shot"
    assert recorder.status.state == "failed"
    assert f"compass record --recover {bag}" in recorder.status.message
    with pytest.raises(BagError, match="truncated"):
        read_episode(bag, PUCK1)
    next_one = Recorder(recorder.folder)
    assert next_one.status.message == f"bags without an end: shot; run: compass record --recover {bag.parent}"
    recover(bag)
    assert len(read_episode(bag, PUCK1).tracks[0].stamp_ns) == 5
    assert [said.state for said in headers(bag)] == ["recording", "recovered"]


def test_too_little_space_to_start(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path, min_free_bytes=2**62)
    with pytest.raises(BagError, match="MB left; expected"):
        recorder.start("shot", "", "", {}, START_NS)
    assert not (tmp_path / "shot").exists()
