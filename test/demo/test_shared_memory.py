"""What killed processes leave in shared memory: a port that was not made to its end stops everyone who comes later."""

from __future__ import annotations

import mmap
from collections.abc import Iterator
from contextlib import nullcontext
from pathlib import Path

import pytest
from domain_coordinator import domain_id

from compass_ros.demo import processes
from compass_ros.demo.shared_memory import SHARED_MEMORY, held_locks, remove_half_made_ports
from test.nodes.harness import until

PORT = SHARED_MEMORY / "fastrtps_port64999"
"""No domain has this one."""
BEING_MADE = (1).to_bytes(4, "little")


@pytest.fixture(params=[b"", bytes(4), BEING_MADE], ids=["empty", "not begun", "being made"])
def half_made(request: pytest.FixtureRequest) -> Iterator[bytes]:
    """The port as a process leaves it that is killed at one of three moments."""
    PORT.write_bytes(request.param and request.param + bytes(4096 - 4))
    yield request.param
    PORT.unlink(missing_ok=True)


def test_a_port_that_nobody_makes_to_its_end_is_removed(half_made: bytes) -> None:
    assert PORT.name in remove_half_made_ports()
    assert not PORT.exists()


def test_a_port_stays_while_somebody_has_it_open(half_made: bytes) -> None:
    with PORT.open("rb"):
        assert PORT.name not in remove_half_made_ports()
    assert PORT.exists()


@pytest.mark.parametrize("half_made", [BEING_MADE], indirect=True)
def test_a_port_stays_while_somebody_has_it_mapped(half_made: bytes) -> None:
    with PORT.open("r+b") as file:
        mapped = mmap.mmap(file.fileno(), 0)
    assert PORT.name not in remove_half_made_ports()
    mapped.close()
    assert PORT.name in remove_half_made_ports()


def test_a_port_that_can_be_used_stays() -> None:
    PORT.write_bytes((2).to_bytes(4, "little") + bytes(4092))
    assert PORT.name not in remove_half_made_ports()
    PORT.unlink(missing_ok=True)


@pytest.mark.ros
def test_a_group_starts_where_a_killed_node_has_left_its_port(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with domain_id() as domain:
        monkeypatch.setattr(processes, "domain_id", lambda: nullcontext(domain))
        with processes.NodeGroup(tmp_path / "first") as nodes:
            first = nodes.start("recorder", directory=str(tmp_path / "bags"))
            until(lambda: bool(_ports(first)), "a port")
            ports = _ports(first)
        ports = {port for port in ports if not port.exists()}  # one that domains share may be in use by others
        assert ports
        for port in ports:
            port.write_bytes(BEING_MADE + bytes(4092))
        with processes.NodeGroup(tmp_path / "second") as nodes:
            second = nodes.start("recorder", directory=str(tmp_path / "bags"))
            until(lambda: ports <= _ports(second), "the same ports")


def _ports(node: processes.NodeProcess) -> set[Path]:
    """The ports that it has opened."""
    names = {lock.name.removesuffix("_el") for lock in held_locks(node.process.pid)}
    return {SHARED_MEMORY / name for name in names if name.startswith("fastrtps_port")}
