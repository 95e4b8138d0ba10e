"""What recording costs: this version beside an earlier one, and beside two other ways to a bag with chunks and index.

    python benchmarks/recording.py [--before COMMIT] [--rounds 9]

Each way is a process of its own, one after the other, round by round; figures are medians over the rounds, of processor
time (user and system) a message. `before`: the recorder of the commit. `now`: the recorder here. `flushed`: mcap's own
writer, its chunk closed every 50 ms, so that no more is lost at SIGKILL. `rewritten`: messages without chunks, copied
into an indexed file when the episode ends; a disk needs room for both.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import tarfile
import tempfile
import time
from collections.abc import Callable, Iterator
from io import BytesIO
from pathlib import Path
from statistics import median
from typing import IO, cast

from mcap.reader import make_reader
from mcap.writer import CompressionType, IndexType, Writer

from compass_ros.episodes.definitions import POSE_TYPE, embedded_definition
from compass_ros.episodes.recording import Connection, Recorder

ROOT = Path(__file__).parents[1]
WAYS = ("before", "now", "flushed", "rewritten")
LOADS = {"poses": (20_000, 360, 2_000_000), "images": (400, 921_600, 11_111_111)}
"""Messages, size of one [bytes], time between two [ns]: poses at 500 Hz, 640x480 images at 90 Hz."""
FLUSH_NS = 50_000_000
ALLOWED = 1.2

Take = Callable[[int, bytes], None]
Way = Callable[[Path], tuple[Take, Callable[[], object]]]
"""A folder -> what takes a message at a time [ns], and what ends the episode."""


def recorded(folder: Path) -> tuple[Take, Callable[[], object]]:
    """The recorder that is imported: this one's, or the earlier one's."""
    recorder = Recorder(folder)
    recorder.connect(Connection("/topic", embedded_definition(POSE_TYPE)))
    recorder.start("episode", "", "", {}, 1)
    return lambda at_ns, data: recorder.take("/topic", data, at_ns, at_ns), recorder.stop


class Unbuffered:
    """A file of which nothing stays in this process, as a recorder needs it."""

    def __init__(self, path: Path) -> None:
        self._file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL)
        self._end = 0

    def write(self, data: bytes) -> int:
        self._end += os.write(self._file, data)
        return len(data)

    def tell(self) -> int:
        return self._end

    def flush(self) -> None:
        pass


def plain_writer(path: Path, chunks: bool) -> tuple[Writer, int]:
    kinds = IndexType.ALL if chunks else IndexType.METADATA
    file = cast(IO[bytes], Unbuffered(path))
    writer = Writer(
        file, compression=CompressionType.NONE, index_types=kinds, use_chunking=chunks, enable_data_crcs=True
    )
    writer.start("ros2")
    definition = embedded_definition(POSE_TYPE)
    schema = writer.register_schema(definition.type, definition.encoding, definition.text.encode())
    return writer, writer.register_channel("/topic", "cdr", schema)


def flushed(folder: Path) -> tuple[Take, Callable[[], object]]:
    writer, channel = plain_writer(folder / "flushed.mcap", chunks=True)
    last_ns = 0

    def take(at_ns: int, data: bytes) -> None:
        nonlocal last_ns
        writer.add_message(channel, at_ns, data, at_ns)
        if at_ns - last_ns >= FLUSH_NS:
            writer.flush()  # type: ignore[no-untyped-call]
            last_ns = at_ns

    return take, writer.finish


def rewritten(folder: Path) -> tuple[Take, Callable[[], object]]:
    raw, indexed = folder / "raw.mcap", folder / "indexed.mcap"
    writer, channel = plain_writer(raw, chunks=False)

    def finish() -> None:
        writer.finish()  # type: ignore[no-untyped-call]
        copy, to = plain_writer(indexed, chunks=True)
        with raw.open("rb") as file:
            for _, _, message in make_reader(file).iter_messages(log_time_order=False):
                copy.add_message(to, message.log_time, message.data, message.publish_time)
        copy.finish()  # type: ignore[no-untyped-call]
        indexed.replace(raw)

    return lambda at_ns, data: writer.add_message(channel, at_ns, data, at_ns), finish


def measured(way: Way, load: str) -> dict[str, float]:
    """One episode: processor time a message [us], time to end it [ms], size of its file [MB]."""
    count, size, step_ns = LOADS[load]
    data = os.urandom(size)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        begun = time.process_time()
        take, stop = way(folder)
        for number in range(count):
            take(1 + number * step_ns, data)
        ending = time.perf_counter()
        stop()
        ended = time.perf_counter()
        used = time.process_time() - begun
        stored = sum(file.stat().st_size for file in folder.rglob("*.mcap"))
    return {"us": used / count * 1e6, "stop_ms": (ended - ending) * 1e3, "MB": stored / 1e6}


def worker(way: str) -> dict[str, dict[str, float]]:
    ways = {"before": recorded, "now": recorded, "flushed": flushed, "rewritten": rewritten}
    return {load: measured(ways[way], load) for load in LOADS}


def rounds(count: int, before: Path) -> Iterator[dict[str, dict[str, dict[str, float]]]]:
    """Of each round: way -> load -> figures. The ways take turns in who goes first."""
    for number in range(count):
        found = {}
        for way in (*WAYS[number % len(WAYS) :], *WAYS[: number % len(WAYS)]):
            sources = before if way == "before" else ROOT
            words = [sys.executable, __file__, "--worker", way]
            environment = os.environ | {"PYTHONPATH": str(sources)}
            found[way] = json.loads(subprocess.run(words, env=environment, check=True, capture_output=True).stdout)
        yield found


def main() -> int:
    """Returns 1 where recording costs more than ALLOWED times what it cost."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--before", default="3e17494", help="the commit to compare with")
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--worker", choices=WAYS, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.worker:
        print(json.dumps(worker(arguments.worker)))
        return 0
    packed = subprocess.run(
        ["git", "archive", arguments.before, "compass_ros"], cwd=ROOT, check=True, capture_output=True
    )
    before = Path(tempfile.mkdtemp())
    try:
        with tarfile.open(fileobj=BytesIO(packed.stdout)) as sources:
            sources.extractall(before, filter="data")
        found = list(rounds(arguments.rounds, before))
    finally:
        shutil.rmtree(before)
    worst = 0.0
    for load in LOADS:
        for way in WAYS:
            figure = {key: median(one[way][load][key] for one in found) for key in ("us", "stop_ms", "MB")}
            ratio = median(one[way][load]["us"] / one["before"][load]["us"] for one in found)
            worst = max(worst, ratio) if way == "now" else worst
            print(
                f"{load:7s} {way:10s} {figure['us']:7.1f} us a message, {ratio:5.2f} times before; "
                f"stop {figure['stop_ms']:7.1f} ms; {figure['MB']:6.1f} MB"
            )
    return worst > ALLOWED


if __name__ == "__main__":
    raise SystemExit(main())
