"""rosbag2's sqlite3 storage, read as it was left: with its write-ahead log, and nothing written beside it."""

from __future__ import annotations

import shutil
import sqlite3
from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from compass_ros.episodes.raw import RawMessage, RawTopic, one_line, type_name
from compass_ros.errors import BagError

LARGEST_MESSAGE = 256 * 2**20
"""A message, or a name, that is longer is refused [bytes]."""
_JOURNAL_MAGIC = bytes.fromhex("d9d505f920a163d7")
"""Begins a rollback journal of SQLite, and ends one that names another journal."""


def messages(path: Path) -> Iterator[RawTopic | RawMessage]:
    """Topics and messages in the order of writing. Raises BagError without the file's name, or OSError."""
    try:
        with ExitStack() as stack:
            address, size = stack.enter_context(_complete(path))
            database = stack.enter_context(closing(sqlite3.connect(address, uri=True)))
            yield from _rows(database, size)
    except (sqlite3.Error, ValueError, OverflowError, MemoryError) as error:
        raise BagError(f"not a readable rosbag2 database: {one_line(error)}") from error


@contextmanager
def _complete(path: Path) -> Iterator[tuple[str, int]]:
    """Address and size [bytes] of a database with all that its recorder wrote.

    What a recorder that was cut off left beside the file, a write-ahead log or the journal of an unfinished
    transaction, belongs to it: SQLite merges them, in a copy.
    """
    beside = [path.with_name(path.name + end) for end in ("-wal", "-journal")]
    beside = [file for file in beside if file.is_file() and file.stat().st_size]
    if not beside:
        yield f"{path.absolute().as_uri()}?immutable=1", path.stat().st_size
        return
    if any(_names_another(file) for file in beside):
        raise BagError("its journal names another file, as that of a recorder does not")
    with TemporaryDirectory(prefix="compass_") as folder:
        for file in (path, *beside):
            shutil.copyfile(file, Path(folder, file.name))
        yield Path(folder, path.name).as_uri(), sum(file.stat().st_size for file in (path, *beside))


def _names_another(journal: Path) -> bool:
    """Whether a rollback journal has a super-journal, which SQLite would delete wherever it lies."""
    return journal.name.endswith("-journal") and journal.read_bytes()[-len(_JOURNAL_MAGIC) :] == _JOURNAL_MAGIC


def _rows(database: sqlite3.Connection, size: int) -> Iterator[RawTopic | RawMessage]:
    database.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, min(LARGEST_MESSAGE, size))
    columns = {"topics": {"id", "name", "type"}, "messages": {"topic_id", "timestamp", "data"}}
    for table, expected in columns.items():
        if not _stored(database, table, expected):
            raise BagError(f"not a rosbag2 database: expected a table '{table}' with {sorted(expected)}")
    topics = {}
    definitions = _definitions(database)
    for key, name, kind_of in database.execute("SELECT id, name, type FROM topics ORDER BY id"):
        text, encoding = definitions.get(str(kind_of), ("", "ros2msg"))
        topics[key] = RawTopic(str(name), type_name(str(kind_of)), definition=text, encoding=encoding)
        yield topics[key]
    rows_left = size // 8
    for key, log_ns, data in database.execute("SELECT topic_id, timestamp, data FROM messages ORDER BY rowid"):
        rows_left -= 1
        if key not in topics or not isinstance(data, bytes) or not isinstance(log_ns, int) or rows_left < 0:
            raise BagError("damaged: a row of 'messages' is not a message of a known topic")
        yield RawMessage(topics[key], log_ns, data)


def _stored(database: sqlite3.Connection, table: str, expected: set[str]) -> bool:
    """Whether a real table has these columns."""
    # hidden = 0: stored columns only, so nothing is computed while we read
    stored = {row[1] for row in database.execute(f"PRAGMA table_xinfo({table})") if row[6] == 0}
    found = database.execute("SELECT type FROM sqlite_master WHERE name = ?", (table,)).fetchall()
    return found == [("table",)] and expected <= stored


def _definitions(database: sqlite3.Connection) -> dict[str, tuple[str, str]]:
    """Text and encoding of the definitions by type; rosbag2 writes them since version 4 of its format."""
    names = ("topic_type", "encoding", "encoded_message_definition")
    if not _stored(database, "message_definitions", {*names}):
        return {}
    rows = database.execute(f"SELECT {', '.join(names)} FROM message_definitions ORDER BY rowid")
    return {str(kind): (str(text), str(encoding)) for kind, encoding, text in rows}
