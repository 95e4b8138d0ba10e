"""One calibration in a process of its own, so that the node stays free and a cancel takes effect at once.

The process is the command line itself (`compass calibrate --progress json`): what the node finds is what the command
finds. It writes into a folder beside the output, which takes the output's name only when everything is there.
"""

from __future__ import annotations

import json
import math
import os
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from queue import SimpleQueue
from typing import IO

import yaml

from compass_ros.config import CalibrationConfig
from compass_ros.errors import ConfigError
from compass_ros.nodes.journal import Journal
from compass_ros.types import Progress

ORIGIN = "origin.yaml"
"""What a result came from, beside it."""
FALSE_ALARM = CalibrationConfig().false_alarm
POLITELY = ("chrt", "--idle", "0")
"""A calibration takes what the tracker and the recorder leave of the machine, and stops the moment that they wake.

SCHED_IDLE (man 7 sched); at `nice 19` a slice of some milliseconds would be finished first.
"""


class Outcome(Enum):
    """How a calibration ended."""

    SUCCEEDED = "succeeded"
    FAILED = "failed"
    CANCELLED = "cancelled"


@dataclass(frozen=True)
class Request:
    """What to calibrate from."""

    bags: tuple[str, ...]
    cell: str
    """Name of a cell, or path of its YAML."""
    seed: int
    rollouts: int
    """Budget of simulated rollouts; 0: the method's default."""
    output: Path
    """Folder of the result. It is made, or replaced where it holds an earlier result; nothing else is overwritten."""
    method: str = "default"
    false_alarm: float = FALSE_ALARM
    """Probability of a verdict other than `none` where nothing is missing."""

    def described(self) -> dict[str, object]:
        """What a result came from, for people and for a second try."""
        return {
            "bags": list(self.bags),
            "cell": self.cell,
            "seed": self.seed,
            "rollouts": self.rollouts,
            "method": self.method,
            "false_alarm": self.false_alarm,
        }


@dataclass(frozen=True)
class Step:
    """Progress, and how long the rest will take."""

    progress: Progress
    seconds_left: float
    """[s], from the share done so far; NaN while nothing is done."""


def command(request: Request, folder: Path) -> list[str]:
    """The command line that does the work and leaves its result in `folder`; the report gives the one to type."""
    words = ["--cell", request.cell, "--method", request.method, "--seed", str(request.seed)]
    if request.rollouts:
        words += ["--rollouts", str(request.rollouts)]
    if request.false_alarm != FALSE_ALARM:
        words += ["--false-alarm", str(request.false_alarm)]
    typed = shlex.join(["compass", "calibrate", *words, "--out", str(request.output), "--", *request.bags])
    start = [sys.executable, "-m", "compass_ros.cli", "calibrate", "--progress", "json", "--repeat", typed]
    return [*start, *words, "--out", str(folder), "--", *request.bags]


def prepare(output: Path) -> Path:
    """A hidden folder beside `output`, on the same disk. Raises ConfigError where the result could not be put."""
    empty = output.is_dir() and not any(output.iterdir())
    if output.exists() and not empty and not (output / "result.json").is_file():
        raise ConfigError(f"output: {output} exists and holds no earlier calibration; it is not overwritten")
    try:
        output.parent.mkdir(parents=True, exist_ok=True)
        return Path(tempfile.mkdtemp(prefix=f".{output.name}-", dir=output.parent))
    except OSError as error:
        raise ConfigError(f"output: {output} cannot be written: {error.strerror}") from error


def read_step(line: bytes, elapsed_s: float) -> Step:
    """One line of `--progress json`, `elapsed_s` [s] after the start; null stands for a number that is not defined."""
    content = json.loads(line)
    gap, sparsity = (math.nan if content[key] is None else float(content[key]) for key in ("gap", "sparsity"))
    progress = Progress(content["stage"], int(content["iteration"]), float(content["done"]), gap, sparsity)
    left = elapsed_s * (1 - progress.done) / progress.done if progress.done > 0 else math.nan
    return Step(progress, left)


class Job:
    """A running calibration. `finished` is set when `outcome` and `message` are final."""

    def __init__(
        self,
        words: Sequence[str],
        folder: Path,
        result: Path,
        output: Path,
        request: Request | None = None,
        journal: Journal | None = None,
    ) -> None:
        """Start `words`, which leave their result in the folder `result` inside `folder`; it becomes `output`.

        `request` joins the result as origin.yaml. Raises ConfigError where the process cannot be started.
        """
        self.finished = threading.Event()
        self.outcome = Outcome.FAILED
        self.message = ""
        self.output = output
        self._folder = folder
        self._result = result
        self._steps: SimpleQueue[Step] = SimpleQueue()
        self._decision = threading.Lock()  # a cancel and a successful end exclude each other
        self._cancelled = False
        self._errors: IO[bytes] = tempfile.TemporaryFile()  # noqa: SIM115  closed by the thread below
        self._started = time.monotonic()
        # A session of its own: the terminal's Ctrl-C reaches the node alone, and the whole group can be ended.
        try:
            self._process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=self._errors, start_new_session=True)
        except OSError as error:
            raise ConfigError(f"the calibration cannot be started: {error.strerror}") from error
        self._request = request
        self._journal = journal
        if journal is not None:
            journal.begun(self._process.pid, folder)
        threading.Thread(target=self._follow, name="calibration").start()

    @classmethod
    def start(cls, request: Request) -> Job:
        """Raises ConfigError where the output cannot be written, or another calibration writes there."""
        output = request.output.expanduser().absolute()
        journal = Journal(output, request.described())
        try:
            folder = prepare(output)
            words = [*POLITELY, *command(request, folder / "result")]
            try:
                return cls(words, folder, folder / "result", output, request, journal)
            except ConfigError:
                shutil.rmtree(folder)
                raise
        except ConfigError:
            journal.close()
            raise

    def steps(self) -> list[Step]:
        """Progress since the last call, oldest first."""
        found = []
        while not self._steps.empty():  # there is one reader
            found.append(self._steps.get())
        return found

    def cancel(self) -> None:
        """End the calibration now; nothing of it stays. No effect when it has ended."""
        with self._decision:
            if self._cancelled or self.finished.is_set() or self._process.poll() is not None:
                return
            self._cancelled = True
            os.killpg(self._process.pid, signal.SIGKILL)

    def _follow(self) -> None:
        with self._errors, self._process as process:
            error = self._read(process.stdout) if process.stdout else ""
            if error:
                os.killpg(process.pid, signal.SIGKILL)
            status = process.wait()
            self._errors.seek(0)
            said = self._errors.read().decode(errors="replace").strip().splitlines()
        with self._decision:
            self.outcome, self.message = self._end(status, error or (said[-1] if said else "it said nothing"))
            shutil.rmtree(self._folder)
            if self._journal is not None:
                self._journal.close()
            self.finished.set()

    def _read(self, lines: IO[bytes]) -> str:
        """Progress until the process closes its output; or a sentence about a line that is no progress."""
        for line in lines:
            try:
                step = read_step(line, time.monotonic() - self._started)
            except (ValueError, KeyError, TypeError):
                return f"expected progress as JSON, found {line!r}"
            self._steps.put(step)
            if self._journal is not None:
                self._journal.note(step.progress.stage, step.progress.iteration)
        return ""

    def _end(self, status: int, error: str) -> tuple[Outcome, str]:
        if self._cancelled:
            return Outcome.CANCELLED, "cancelled; nothing was written"
        if status == 1:
            return Outcome.FAILED, error.removeprefix("compass: ")
        if status:
            return Outcome.FAILED, f"the calibration process ended with status {status}: {error}"
        try:
            if self._request is not None:
                text = yaml.safe_dump(self._request.described(), sort_keys=False)
                (self._result / ORIGIN).write_text(text, encoding="utf-8")
            if self.output.exists():
                self.output.rename(self._folder / "earlier")
            self._result.rename(self.output)
        except OSError as problem:
            return Outcome.FAILED, f"output: {self.output} cannot be written: {problem.strerror}"
        return Outcome.SUCCEEDED, f"result in {self.output}"
