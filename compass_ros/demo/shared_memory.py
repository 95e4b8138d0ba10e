"""What processes of Fast DDS leave in shared memory when they are killed: segments, and ports that none can open.

A port is a file /dev/shm/fastrtps_port<number>, made by whoever comes first. A process that is killed while it makes
one leaves a file on which every later process waits without end (boost::interprocess, `managed_open_or_create_impl`:
the first word of the file is 2 once it can be used, and nothing tells a slow maker from a dead one).
"""

from __future__ import annotations

import os
import signal
import subprocess
from pathlib import Path

SHARED_MEMORY = Path("/dev/shm")
PORTS_OF_DOMAIN = 250
FIRST_PORT = 7400
"""Ports of domain d begin at FIRST_PORT + PORTS_OF_DOMAIN d (RTPS standard)."""
USABLE = (2).to_bytes(4, "little")
"""First word of a segment that was made to its end: `InitializedSegment` of boost::interprocess."""


def held_locks(pid: int) -> list[Path]:
    """The lock files by which a process owns segments and ports of Fast DDS; `fastdds shm clean` goes by them too.

    That tool looks at all processes on the machine and can hit one that is just starting; this looks at one alone.
    """
    return [path for path in _opened(pid) if path.parent == SHARED_MEMORY and path.name.endswith("_el")]


def kill(process: subprocess.Popen[bytes], patience_s: float | None = None) -> None:
    """End the leader of a session at once, with all that it started, and remove the shared memory that was its own."""
    locks = held_locks(process.pid)
    os.killpg(process.pid, signal.SIGKILL)
    process.wait(patience_s)
    for lock in locks:
        _remove(lock.name.removesuffix("_el"))


def remove_ports(domain: int) -> None:
    """Remove the ports of a DDS domain that nobody is in any more."""
    first = FIRST_PORT + PORTS_OF_DOMAIN * domain
    for port in range(first, first + PORTS_OF_DOMAIN):
        _remove(f"fastrtps_port{port}")


def locks_in_use() -> set[Path]:
    """The lock files that any process of this machine holds now, of those that this user may look at."""
    return {lock for pid in _processes() for lock in held_locks(pid)}


def remove_half_made_ports() -> list[str]:
    """Remove the ports that were not made to their end and that no process has open; their names."""
    half_made = [path for path in SHARED_MEMORY.glob("fastrtps_port*") if _is_port(path) and not _is_usable(path)]
    in_use = {path for pid in _processes() for path in _opened(pid) | _mapped(pid)} if half_made else set()
    left = [path.name for path in half_made if path not in in_use]
    for name in left:
        _remove(name)
    return left


def _remove(name: str) -> None:
    """Remove one segment or port whose owner is dead."""
    for file in (name, f"{name}_el", f"{name}_sl", f"sem.{name}_mutex"):
        (SHARED_MEMORY / file).unlink(missing_ok=True)


def _is_port(path: Path) -> bool:
    return path.name.removeprefix("fastrtps_port").isdigit()


def _is_usable(path: Path) -> bool:
    """True also for a file that has gone or that is another user's: there is nothing to remove."""
    try:
        with path.open("rb") as file:
            return file.read(len(USABLE)) == USABLE
    except (FileNotFoundError, PermissionError):
        return True


def _processes() -> list[int]:
    return [int(process.name) for process in Path("/proc").glob("[0-9]*")]


def _opened(pid: int) -> set[Path]:
    """What a process has open; nothing of one that has ended or is another user's."""
    opened = set()
    try:
        for descriptor in Path(f"/proc/{pid}/fd").iterdir():
            try:
                opened.add(descriptor.readlink())
            except FileNotFoundError:
                continue  # closed in the meantime
    except (FileNotFoundError, ProcessLookupError, PermissionError):
        return set()
    return opened


def _mapped(pid: int) -> set[Path]:
    """What of the shared memory a process has mapped, likewise."""
    try:
        lines = Path(f"/proc/{pid}/maps").read_text(errors="replace").splitlines()
    except (FileNotFoundError, ProcessLookupError, PermissionError):
        return set()
    return {Path(line[line.index("/") :]) for line in lines if str(SHARED_MEMORY) in line}
