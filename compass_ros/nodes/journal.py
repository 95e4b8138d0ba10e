"""What is written down while a calibration runs: who writes to an output, and what was cut off when a node was killed.

The file `.NAME.running` beside the output NAME is locked by the process that calibrates. A file that nobody holds was
left by one that was killed.
"""

from __future__ import annotations

import fcntl
import json
import os
import shutil
import signal
import time
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from compass_ros.errors import ConfigError


@dataclass(frozen=True)
class CutOff:
    """A calibration that has no end."""

    bags: tuple[str, ...]
    cell: str
    seed: int
    rollouts: int
    output: str
    stage: str
    iteration: int

    def __str__(self) -> str:
        where = f" in '{self.stage}', iteration {self.iteration}" if self.stage else " at its beginning"
        return f"the calibration from {len(self.bags)} paths was cut off{where}"


class Journal:
    """Held from the start of a calibration to its end."""

    def __init__(self, output: Path, request: Mapping[str, Any]) -> None:
        """Take hold of an absolute `output`; `request` is what CutOff says of it.

        Raises ConfigError where another process calibrates into it, or where nothing can be written.
        """
        self._path = journal_path(output)
        self._content: dict[str, Any] = {**request, "output": str(output), "stage": "", "iteration": 0}
        try:
            output.parent.mkdir(parents=True, exist_ok=True)
            self._descriptor = os.open(self._path, os.O_RDWR | os.O_CREAT, 0o644)
        except OSError as error:
            raise ConfigError(f"output: {output} cannot be written: {error.strerror}") from error
        try:
            fcntl.flock(self._descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            holder = _read(self._path).get("node", "unknown")
            os.close(self._descriptor)
            message = f"refused: another calibration (process {holder}) already writes to {output}"
            raise ConfigError(message) from None
        _tidy(_read(self._path))
        self._content["node"] = os.getpid()
        self._write()

    def begun(self, process: int, folder: Path) -> None:
        """The calibration is this process and leaves its files in this folder."""
        self._content |= {"process": process, "folder": str(folder)}
        self._write()

    def note(self, stage: str, iteration: int) -> None:
        """How far it is."""
        if (stage, iteration) != (self._content["stage"], self._content["iteration"]):
            self._content |= {"stage": stage, "iteration": iteration}
            self._write()

    def close(self) -> None:
        """The calibration has ended, well or not."""
        self._path.unlink(missing_ok=True)
        os.close(self._descriptor)

    def _write(self) -> None:
        text = json.dumps(self._content).encode()
        with suppress(OSError):  # a full disk costs the note, not the calibration
            os.pwrite(self._descriptor, text, 0)
            os.ftruncate(self._descriptor, len(text))


def journal_path(output: Path) -> Path:
    return output.parent / f".{output.name}.running"


def cut_off(output: Path) -> CutOff | None:
    """The calibration that was killed while it worked for an absolute `output`; what it left is tidied away.

    None where there was none, or where it still runs. Its journal is gone afterwards.
    """
    path = journal_path(output)
    try:
        descriptor = os.open(path, os.O_RDWR)
    except OSError:
        return None
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        content = _read(path)
        _tidy(content)
        path.unlink(missing_ok=True)
    except BlockingIOError:
        return None
    finally:
        os.close(descriptor)
    try:
        return CutOff(
            bags=tuple(map(str, content["bags"])),
            cell=str(content["cell"]),
            seed=int(content["seed"]),
            rollouts=int(content["rollouts"]),
            output=str(output),
            stage=str(content["stage"]),
            iteration=int(content["iteration"]),
        )
    except (KeyError, TypeError, ValueError):
        return None  # killed while the first note was written: nothing had begun


def _read(path: Path) -> dict[str, Any]:
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return content if isinstance(content, dict) else {}


def _command_line(process: int) -> bytes:
    """Of a running process; a program that is just being loaded has none for a moment. Raises OSError."""
    for _ in range(100):
        words = Path(f"/proc/{process}/cmdline").read_bytes()
        if words or "\nState:\tZ" in Path(f"/proc/{process}/status").read_text(encoding="utf-8"):
            break
        time.sleep(0.01)
    return words


def _tidy(content: Mapping[str, Any]) -> None:
    """End the orphan of a killed node, if it still runs, and remove its unfinished files."""
    process, folder = content.get("process"), content.get("folder")
    if not isinstance(process, int) or not isinstance(folder, str) or not folder:
        return
    with suppress(OSError):
        if folder.encode() in _command_line(process):
            os.killpg(process, signal.SIGKILL)
    if Path(folder).name.startswith(".") and Path(folder).parent == Path(str(content.get("output"))).parent:
        shutil.rmtree(folder, ignore_errors=True)
