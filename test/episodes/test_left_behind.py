"""Bags as power cuts, other versions and file managers leave them: read whole, or refused with advice that works."""

from __future__ import annotations

import re
import shlex
import shutil
import sqlite3
import struct
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import StoragePlugin
from typer.testing import CliRunner

from compass_ros.cli import app
from compass_ros.episodes import find_bags, list_topics, read_bag, read_episode
from compass_ros.episodes.metadata import read_summary
from compass_ros.errors import BagError
from test.episodes.foreign import FRAMES, POSITION, SOURCES, STAMPS, write_rosbag2

MCAP, SQLITE3 = StoragePlugin.MCAP, StoragePlugin.SQLITE3


def assert_whole(bag: Path, saying: str = "") -> None:
    """All planted frames are read; the reader says one thing of the bag, or nothing."""
    found = read_episode(bag, SOURCES)
    np.testing.assert_array_equal(found.track("c").value, POSITION)
    assert found.track("c").stamp_ns.tolist() == STAMPS
    assert len(found.remarks) == bool(saying)
    assert all(saying in remark for remark in found.remarks)


def split(folder: Path, storage: StoragePlugin, parts: int = 3) -> Path:
    """A recording that rosbag2 cut into files NAME_8, NAME_9, NAME_10, without metadata.yaml."""
    folder.mkdir()
    edges = np.linspace(0, FRAMES, parts + 1).astype(int).tolist()
    for part in range(parts):
        one = write_rosbag2(folder.parent / f"part{part}", storage, range(edges[part], edges[part + 1]))
        (file,) = (path for path in one.iterdir() if path.suffix in (".mcap", ".db3"))
        file.rename(folder / f"{folder.name}_{8 + part}{file.suffix}")
        shutil.rmtree(one)
    return folder


@pytest.mark.parametrize("storage", [MCAP, SQLITE3])
@pytest.mark.parametrize("parts", [1, 3])
def test_files_that_are_whole_are_read_without_metadata(tmp_path: Path, storage: StoragePlugin, parts: int) -> None:
    bag = split(tmp_path / "bag", storage, parts)
    assert_whole(bag, f"without metadata.yaml, read from {parts} file")
    assert find_bags([tmp_path]) == (bag,)


@pytest.mark.parametrize("storage", [MCAP, SQLITE3])
def test_a_file_that_is_missing_among_them_is_said(tmp_path: Path, storage: StoragePlugin) -> None:
    bag = split(tmp_path / "bag", storage)
    next(bag.glob("bag_9*")).unlink()
    assert "number 9 is missing among them" in read_episode(bag, SOURCES).remarks[0]


def test_a_file_that_metadata_does_not_name_is_said(tmp_path: Path) -> None:
    bag = write_rosbag2(tmp_path / "bag", MCAP)
    shutil.copy(bag / "bag.mcap", bag / "bag_1.mcap")
    assert_whole(bag, "metadata.yaml does not name bag_1.mcap: not read")


def follow(message: str) -> str:
    """Run the `compass` command that a message advises; returns what it says."""
    (command,) = re.findall(r"run: compass (.*)", message)
    done = CliRunner().invoke(app, shlex.split(command))
    assert done.exit_code == 0, done.output
    return done.output


def cut(file: Path, share: float) -> None:
    with file.open("r+b") as opened:
        opened.truncate(int(share * file.stat().st_size))


@pytest.mark.parametrize("name", ["bag", "two words", "it's", "投げ"])
@pytest.mark.parametrize("cut_file", [8, 10])
def test_the_advice_for_a_split_recording_works(tmp_path: Path, name: str, cut_file: int) -> None:
    bag = split(tmp_path / name, MCAP)
    cut(bag / f"{name}_{cut_file}.mcap", 0.999)
    with pytest.raises(BagError, match="truncated") as caught:
        read_episode(bag, SOURCES)
    follow(str(caught.value))
    messages = sum(topic.messages for topic in list_topics(bag))
    summary = read_summary(bag)
    assert (summary.messages, len(summary.files)) == (messages, 3)
    assert summary.files == tuple(f"{name}_{number}.mcap" for number in (8, 9, 10))
    with AnyReader([bag]) as theirs:
        assert (theirs.message_count, sum(1 for _ in theirs.messages())) == (messages, messages)
    assert read_episode(bag, SOURCES[2:3]).remarks == ()
    assert follow(str(caught.value)).strip().endswith("was whole")


def test_the_advice_for_a_bare_file_among_others_works(tmp_path: Path) -> None:
    whole, broken = (write_rosbag2(tmp_path / name, MCAP) / f"{name}.mcap" for name in ("whole", "broken"))
    files = [file.rename(tmp_path / f"take {file.name}") for file in (whole, broken)]
    kept = files[0].read_bytes()
    cut(files[1], 0.99)
    with pytest.raises(BagError, match="truncated") as caught:
        list_topics(files[1])
    follow(str(caught.value))
    assert read_episode(files[1], SOURCES[2:3]).tracks[0].value.tolist()[0] == POSITION[0].tolist()
    assert files[0].read_bytes() == kept
    assert not (tmp_path / "metadata.yaml").exists()


def test_a_last_file_that_holds_nothing_yet(tmp_path: Path) -> None:
    """The recorder was killed just after it had begun another file."""
    bag = split(tmp_path / "bag", MCAP)
    (bag / "bag_11.mcap").write_bytes((bag / "bag_10.mcap").read_bytes()[:60])
    with pytest.raises(BagError, match="truncated") as caught:
        read_episode(bag, SOURCES)
    follow(str(caught.value))
    assert_whole(bag)


def with_log(folder: Path, checkpointed: int) -> Path:
    """An sqlite3 bag as a recorder leaves it that writes with a log (`--storage-preset-profile resilient`) and is cut.

    The file itself holds so many frames; the others are only in the log beside it.
    """
    bag = write_rosbag2(folder / "made", SQLITE3)
    source = sqlite3.connect(bag / "made.db3")
    rows = source.execute("SELECT topic_id, timestamp, data FROM messages ORDER BY rowid").fetchall()
    source.execute("DELETE FROM messages")
    source.commit()
    source.execute("PRAGMA journal_mode=WAL")
    source.execute("PRAGMA wal_autocheckpoint=0")
    insert = "INSERT INTO messages(topic_id, timestamp, data) VALUES (?, ?, ?)"
    edge = checkpointed * len(rows) // FRAMES
    source.executemany(insert, rows[:edge])
    source.commit()
    source.execute("PRAGMA wal_checkpoint(TRUNCATE)")
    source.executemany(insert, rows[edge:])
    source.commit()
    target = folder / "bag"
    target.mkdir()
    for ending in ("", "-wal"):
        shutil.copy(bag / f"made.db3{ending}", target / f"bag_0.db3{ending}")
    source.close()
    shutil.rmtree(bag)
    return target


@pytest.mark.parametrize("checkpointed", [0, 1, 10, 19])
def test_a_database_with_its_log_is_read_whole(tmp_path: Path, checkpointed: int) -> None:
    bag = with_log(tmp_path, checkpointed)
    before = {file.name: file.read_bytes() for file in bag.iterdir()}
    assert_whole(bag, "without metadata.yaml, read from 1 file as")
    assert sum(topic.messages for topic in list_topics(bag / "bag_0.db3")) == 8 * FRAMES
    assert {file.name: file.read_bytes() for file in bag.iterdir()} == before, "nothing was written beside it"


def test_a_database_with_the_journal_of_a_transaction(tmp_path: Path) -> None:
    """What a transaction had begun to write is taken back, as SQLite does it."""
    bag = write_rosbag2(tmp_path / "bag", SQLITE3)
    file, journal = bag / "bag.db3", bag / "bag.db3-journal"
    with closing(sqlite3.connect(file)) as database:
        database.execute("PRAGMA cache_spill=1")
        database.execute("PRAGMA cache_size=2")
        database.execute("UPDATE messages SET data = zeroblob(400)")
        for path in (file, bag / "bag.db3-journal"):
            shutil.copy(path, tmp_path / path.name)
        database.rollback()
    shutil.copy(tmp_path / "bag.db3", file)
    with pytest.raises(BagError):
        read_episode(bag, SOURCES)  # half of the transaction is in the file
    shutil.copy(tmp_path / "bag.db3-journal", journal)
    assert_whole(bag)
    victim = tmp_path / "victim"
    victim.write_bytes(b"x")
    named = str(victim).encode()
    tail = struct.pack(">II", len(named), sum(named)) + bytes.fromhex("d9d505f920a163d7")
    journal.write_bytes(journal.read_bytes() + named + tail)
    with pytest.raises(BagError, match="its journal names another file"):
        read_episode(bag, SOURCES)
    assert victim.exists()


def identifier(text: str) -> Callable[[Path], None]:
    def change(bag: Path) -> None:
        path = bag / "metadata.yaml"
        path.write_text(re.sub(r"storage_identifier: .*", f"storage_identifier: {text}", path.read_text()))

    return change


@pytest.mark.parametrize("storage", [MCAP, SQLITE3])
@pytest.mark.parametrize("said", ['""', "''", "mcap", "sqlite3", "rosbag2_storage_of_mine"])
def test_the_files_say_how_they_are_stored(tmp_path: Path, storage: StoragePlugin, said: str) -> None:
    """Humble's `ros2 bag reindex` leaves the identifier empty; the endings are those of the files."""
    bag = write_rosbag2(tmp_path / "bag", storage)
    identifier(said)(bag)
    assert_whole(bag)


def test_a_storage_of_another_ending(tmp_path: Path) -> None:
    bag = write_rosbag2(tmp_path / "bag", MCAP)
    (bag / "bag.mcap").rename(bag / "bag.parquet")
    path = bag / "metadata.yaml"
    path.write_text(path.read_text().replace("bag.mcap", "bag.parquet"))
    identifier("parquet")(bag)
    with pytest.raises(BagError, match=r"storage 'parquet' of bag\.parquet cannot be read; expected mcap or sqlite3"):
        read_bag(bag, SOURCES)


def test_hidden_files_are_no_recordings(tmp_path: Path) -> None:
    write_rosbag2(tmp_path / "bag", MCAP)
    (tmp_path / "._bag.mcap").write_bytes(b"\\x00\\x05\\x16\\x07 written by macOS")
    (tmp_path / ".recovering_x.mcap").mkdir()
    (tmp_path / ".recovering_x.mcap" / "metadata.yaml").write_text("")
    assert find_bags([tmp_path]) == (tmp_path / "bag",)
