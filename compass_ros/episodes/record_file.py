"""A file that grows by whole pieces: what is written is in it at once and whole, or not at all."""

from __future__ import annotations

import fcntl
import os
from collections.abc import Sequence
from pathlib import Path


class RecordFile:
    """Nothing is held back in this process. Locked while open: nobody recovers the file meanwhile."""

    def __init__(self, path: Path) -> None:
        """Make the file. Raises OSError."""
        self._descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o644)
        fcntl.flock(self._descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        self.end = 0
        """The file's size [bytes]."""

    def append(self, parts: Sequence[bytes]) -> None:
        """Write pieces at the end, one after the other. Raises OSError (disk full): then none of them is there."""
        size = sum(map(len, parts))
        try:
            written = os.pwritev(self._descriptor, parts, self.end)
            while written < size:  # a signal, or the last bytes of a disk; the next try says which
                written += os.pwrite(self._descriptor, b"".join(parts)[written:], self.end + written)
        except OSError:
            os.ftruncate(self._descriptor, self.end)
            raise
        self.end += size

    def replace(self, at: int, data: bytes) -> None:
        """Write over bytes that are in the file. Raises OSError."""
        os.pwrite(self._descriptor, data, at)

    def close(self) -> None:
        os.close(self._descriptor)
