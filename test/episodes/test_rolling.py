"""The last seconds, saved afterwards: what is in the bag, how much memory it takes, and that an episode goes on."""

from __future__ import annotations

import tracemalloc
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from compass_ros.episodes import Source, read_bag, read_episode, write_episode
from compass_ros.episodes.bag import RawMessage, RawTopic, scan
from compass_ros.episodes.definitions import JOINT_TYPE, STRING_TYPE, embedded_definition
from compass_ros.episodes.notes import EPISODE_TOPIC
from compass_ros.episodes.recording import Connection, Recorder
from compass_ros.episodes.rolling import Rolling
from compass_ros.errors import BagError
from compass_ros.types import Episode, Track
from test.episodes.planted import START_NS, assert_same
from test.episodes.test_latched import text

S = 10**9
JOINTS = tuple(f"joint_{i}" for i in range(1, 8))
SOURCES = (
    Source("/joint_states", "joints", "joint_position", of=JOINTS),
    Source("/joint_commands", "target", "joint_position", of=JOINTS, drives=True),
)


def keeping(folder: Path, span_s: float, most_bytes: int = 10**9, *topics: Connection) -> Recorder:
    recorder = Recorder(folder, rolling=Rolling(round(span_s * S), most_bytes))
    for topic in topics or (Connection("/chat", embedded_definition(STRING_TYPE)),):
        recorder.connect(topic)
    return recorder


def saved(recorder: Recorder, now_ns: int) -> Path:
    folder, past = recorder.last(now_ns)
    return Path(past.write(folder, "cell", "a1").bag)


def raw(bag: Path, topic: str = "/chat") -> list[bytes]:
    return [item.data for item in scan(bag) if isinstance(item, RawMessage) and item.topic.name == topic]


def say(recorder: Recorder, first: int, count: int, every_ns: int, topic: str = "/chat") -> None:
    """Messages that are their own numbers, each at its number times the period."""
    for number in range(first, first + count):
        at_ns = START_NS + number * every_ns
        recorder.take(topic, text(str(number)), at_ns, at_ns - 1)


@pytest.mark.parametrize(
    ("span_s", "rate_hz", "sent_s"), [(1, 1000, 3), (60, 10, 100), (0.5, 100, 0.3), (10, 3, 60), (2, 250, 2), (5, 1, 4)]
)
def test_the_last_seconds_and_no_others(tmp_path: Path, span_s: float, rate_hz: int, sent_s: float) -> None:
    recorder = keeping(tmp_path, span_s)
    every_ns, count = S // rate_hz, round(sent_s * rate_hz)
    say(recorder, 0, count, every_ns)
    end_ns = START_NS + (count - 1) * every_ns
    bag = saved(recorder, end_ns)
    expected = [i for i in range(count) if end_ns - (START_NS + i * every_ns) <= round(span_s * S)]
    assert raw(bag) == [text(str(i)) for i in expected]
    content = read_bag(bag, ())
    assert (bag.name, content.episode.cell, content.episode.cell_hash) == ("last_0001", "cell", "a1")
    assert content.episode.start_ns == START_NS + expected[0] * every_ns
    times = [item.log_ns for item in scan(bag) if isinstance(item, RawMessage)]
    assert all(a <= b for a, b in pairwise(times))
    later_ns = end_ns + 10 * round(span_s * S)
    with pytest.raises(BagError, match="no message came in the last"):
        recorder.last(later_ns)


def test_series_of_an_arm_are_read_back_bit_for_bit(tmp_path: Path) -> None:
    """1 kHz, seven joints and what drove them: the messages of an episode, received one by one."""
    stamps = START_NS + np.arange(3000) * 1_000_000
    values = np.random.default_rng(0).normal(size=(2, 3000, 7))
    tracks = [Track(s.object, s.quantity, stamps, v) for s, v in zip(SOURCES, values, strict=True)]
    arm = Episode("arm", "cell", "a1", {}, START_NS, (tracks[0],), inputs=(tracks[1],))
    recorder = keeping(tmp_path, 2.0, 10**9, *(Connection(s.topic, embedded_definition(JOINT_TYPE)) for s in SOURCES))
    for item in scan(write_episode(arm, tmp_path / "sent", SOURCES)):
        if isinstance(item, RawMessage) and item.topic.type == JOINT_TYPE:
            recorder.take(item.topic.name, item.data, item.log_ns, item.log_ns)
    bag = saved(recorder, int(stamps[-1]))
    cut = [replace(t, stamp_ns=t.stamp_ns[-2001:], value=t.value[-2001:]) for t in tracks]
    expected = replace(
        arm, name="last_0001", start_ns=int(stamps[-2001]), tracks=(cut[0],), inputs=(cut[1],), source=str(bag)
    )
    assert_same(read_episode(bag, SOURCES), expected)


def test_an_episode_goes_on_and_has_all_that_came(tmp_path: Path) -> None:
    recorder = keeping(tmp_path, 1.0)
    say(recorder, 0, 500, S // 100)
    running = recorder.start("", "", "", {}, START_NS + 5 * S)
    say(recorder, 500, 250, S // 100)
    folder, past = recorder.last(START_NS + 750 * S // 100)
    say(recorder, 750, 250, S // 100)  # in the time of writing
    bag = Path(past.write(folder, "", "").bag)
    stopped = recorder.stop()
    assert (stopped.bag, stopped.message) == (running.bag, "")
    assert raw(Path(stopped.bag)) == [text(str(i)) for i in range(500, 1000)]
    assert raw(bag) == [text(str(i)) for i in range(650, 750)]
    assert saved(recorder, START_NS + 10 * S).name == "last_0002"


LATCHED = {
    # publishers that were seen; seconds before the end at which each message came; those that the bag has to hold
    "long ago": (1, (900,), (0,)),
    "long ago and again": (1, (900, 600), (1,)),
    "within": (1, (1,), (0,)),
    "long ago and within": (1, (900, 1), (0, 1)),
    "of several publishers": (3, (900, 800, 700), (0, 1, 2)),
    "of several, one within": (2, (900, 800, 0.5), (0, 1, 2)),
}


@pytest.mark.parametrize("name", LATCHED)
def test_latched_topics_stand_first(tmp_path: Path, name: str) -> None:
    publishers, before_s, expected = LATCHED[name]
    chat = Connection("/chat", embedded_definition(STRING_TYPE))
    recorder = keeping(
        tmp_path, 2.0, 10**9, Connection("/tf_static", embedded_definition(STRING_TYPE), latched=publishers), chat
    )
    end_ns = START_NS + 1000 * S
    said = [(round(s * S), "/tf_static", text(f"latched {number}")) for number, s in enumerate(before_s)]
    said += [(tenth * S // 10 + 1, "/chat", text("now")) for tenth in range(30)]
    for before_ns, topic, data in sorted(said, reverse=True):
        recorder.take(topic, data, end_ns - before_ns, 7)
    bag = saved(recorder, end_ns)
    assert raw(bag, "/tf_static") == [text(f"latched {number}") for number in expected]
    order = [item.topic.name for item in scan(bag) if isinstance(item, RawMessage)]
    old = [number for number in expected if before_s[number] > 2]
    assert order[: len(old) + 1] == ["/tf_static"] * len(old) + [EPISODE_TOPIC], "no sample of the episode"


def test_a_topic_that_changes_its_type_has_both(tmp_path: Path) -> None:
    recorder = keeping(tmp_path, 1000.0)
    say(recorder, 0, 3, S)
    recorder.connect(Connection("/chat", embedded_definition(JOINT_TYPE)))
    recorder.take("/chat", b"\x00\x01\x00\x00", START_NS + 3 * S, 0)
    topics = [item for item in scan(saved(recorder, START_NS + 3 * S)) if isinstance(item, RawTopic)]
    assert {(topic.name, topic.type) for topic in topics} >= {("/chat", STRING_TYPE), ("/chat", JOINT_TYPE)}


@pytest.mark.parametrize("size", [1, 60, 400, 5000, 100_000, 700_000])
def test_memory_is_bounded_whatever_the_size_of_messages(size: int) -> None:
    """Measured, not counted: the bound holds for Python's own bytes too."""
    most = 2_000_000
    tracemalloc.start()
    kept = Rolling(10**6 * S, most)
    kept.connect(Connection("/any", embedded_definition(STRING_TYPE)))
    before, _ = tracemalloc.get_traced_memory()
    for number in range(3 * most // (size + 200)):
        kept.keep("/any", START_NS + number, START_NS + number + 10**12, bytes(bytearray(size)), 0)
    used, peak = (found - before for found in tracemalloc.get_traced_memory())
    tracemalloc.stop()
    assert kept.short
    assert 0.5 * most < used + size
    assert used < most + 20_000
    assert peak < most + 2 * size + 20_000


@pytest.mark.parametrize("back_s", [0.05, 0.5, 3, 100, 10**6])
def test_a_clock_that_is_set_back(tmp_path: Path, back_s: float) -> None:
    """A little: all is kept. To before all that is kept, as when a simulation begins anew: only what is new."""
    recorder = keeping(tmp_path, 1.0)
    say(recorder, 0, 100, S // 100)
    jump = round(back_s * S)
    for number in range(100, 120):
        recorder.take("/chat", text(str(number)), START_NS + number * S // 100 - jump, 0)
    bag = saved(recorder, START_NS + 119 * S // 100 - jump)
    first = 0 if back_s < 0.9 else 100
    assert raw(bag)[-20:] == [text(str(i)) for i in range(100, 120)]
    assert raw(bag)[0] in ([text(str(i)) for i in range(20)] if first == 0 else [text("100")])


def test_what_was_lost_is_said(tmp_path: Path) -> None:
    recorder = keeping(tmp_path, 100.0)
    for sequence in (1, 2, 5, 6, 10):
        recorder.take("/chat", text("x"), START_NS + sequence, 0, sequence)
    folder, past = recorder.last(START_NS + 20)
    assert past.write(folder, "", "").message == "lost 5 messages on /chat"


def test_nothing_is_kept_unless_asked_for(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path)
    recorder.connect(Connection("/chat", embedded_definition(STRING_TYPE)))
    say(recorder, 0, 3, S)
    with pytest.raises(BagError, match="keeps nothing between episodes"):
        recorder.last(START_NS)


def test_a_folder_that_is_gone(tmp_path: Path) -> None:
    recorder = keeping(tmp_path / "bags", 10.0)
    say(recorder, 0, 3, S // 10)
    folder, past = recorder.last(START_NS + S)
    folder.mkdir()
    with pytest.raises(BagError, match="exists already"):
        past.write(folder, "", "")
