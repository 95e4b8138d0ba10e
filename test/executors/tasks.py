"""Tasks for workers: they live in other processes, so they are functions of a module."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path


def squared(number: int) -> int:
    return number * number


def busy(seconds: float, number: int) -> int:
    """Computes for so long."""
    begun, total = time.process_time(), 0
    while time.process_time() - begun < seconds:
        total += 1
    return number if total else -1


def dies_once(folder: Path, number: int) -> int:
    """The first worker that gets number 2 is killed in the middle of it."""
    mark = folder / "died"
    if number == 2 and not mark.exists():
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return number * number


def always_dies(number: int) -> int:
    if number == 1:
        os.kill(os.getpid(), signal.SIGKILL)
    return number


def refuses(number: int) -> int:
    raise ValueError(f"not {number}")


def where(number: int) -> tuple[int, str]:
    """Which worker it was, after long enough that others have to help."""
    import ray

    time.sleep(1.0)
    return number, str(ray.get_runtime_context().get_node_id())
