"""Every test here has its own processes; all of them share a DDS domain that nobody else on this machine uses."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, Protocol

import pytest
from domain_coordinator import domain_id

from compass_ros.demo.shared_memory import remove_half_made_ports, remove_ports
from test.nodes.episodes import TOPIC
from test.nodes.harness import NodeProcess, Probe

ROOT = Path(__file__).parents[2]


class StartNode(Protocol):
    """Start a node in a process of its own; it is killed when the test ends."""

    def __call__(self, name: str, *arguments: str, **parameters: Any) -> NodeProcess: ...


@pytest.fixture(scope="session")
def domain() -> Iterator[int]:
    """The domain; every process started afterwards is in it. The shared memory of its ports is removed at the end."""
    with domain_id() as number, pytest.MonkeyPatch.context() as patch:
        patch.setenv("ROS_DOMAIN_ID", str(number))
        patch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
        patch.setenv("RMW_IMPLEMENTATION", "rmw_fastrtps_cpp")
        patch.setenv("FASTRTPS_DEFAULT_PROFILES_FILE", str(ROOT / "config" / "fastdds.xml"))
        remove_half_made_ports()
        yield number
        remove_ports(number)


@pytest.fixture
def start_node(domain: int, tmp_path: Path) -> Iterator[StartNode]:
    started: list[NodeProcess] = []

    def start(name: str, *arguments: str, **parameters: Any) -> NodeProcess:
        started.append(NodeProcess(name, tmp_path, parameters, arguments))
        return started[-1]

    yield start
    for node in started:
        node.kill()
        print(f"--- {node.name}\n{node.output()}")  # shown by pytest when the test fails


@pytest.fixture
def probe(domain: int) -> Iterator[Probe]:
    client = Probe(domain)
    yield client
    client.close()


@pytest.fixture
def recorder(start_node: StartNode, tmp_path: Path) -> NodeProcess:
    """A recorder of one puck's poses and of the shots."""
    return start_node("recorder", directory=str(tmp_path / "bags"), topics=[TOPIC, "/virtual_cell/shot"], min_free_mb=1)
