"""A ray cluster of two nodes on this machine: `make ray`, in an environment that has ray."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from compass_ros.executors import Ray
from test.executors.tasks import dies_once, refuses, where

ray: Any = pytest.importorskip("ray", reason="ray is not installed: make ray")
pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("default")]


NODE = {"num_cpus": 1}
PORTS = ("metrics_agent_port", "metrics_export_port", "dashboard_agent_listen_port", "runtime_env_agent_port")


def ports() -> dict[str, int]:
    """Free ones, chosen here: where ray lets its agents choose, a node gives up on a slow machine after 15 s."""
    with ExitStack() as held:
        open_ = [held.enter_context(socket.create_server(("127.0.0.1", 0))) for _ in PORTS]
        return {name: one.getsockname()[1] for name, one in zip(PORTS, open_, strict=True)}


@pytest.fixture(scope="module")
def cluster() -> Iterator[Any]:
    from ray.cluster_utils import Cluster

    made = Cluster(initialize_head=True, head_node_args=NODE | ports() | {"include_dashboard": False})
    made.add_node(**NODE, **ports())
    made.wait_for_nodes()
    yield made
    ray.shutdown()
    made.shutdown()


def test_both_nodes_work(cluster: Any) -> None:
    by = Ray(cluster.address)
    assert by.jobs == 2
    answers = [answer for _, answer in by.each(where, range(6))]
    assert sorted(number for number, _ in answers) == list(range(6))
    assert len({node for _, node in answers}) == 2


def test_a_killed_worker_loses_nothing(cluster: Any, tmp_path: Path) -> None:
    task = partial(dies_once, tmp_path)
    assert sorted(Ray(cluster.address).each(task, range(6))) == [(i, i * i) for i in range(6)]
    assert (tmp_path / "died").exists()


def test_what_a_task_raises_is_the_callers(cluster: Any) -> None:
    with pytest.raises(ValueError, match="not 5"):
        list(Ray(cluster.address).each(refuses, [5]))


def test_a_lost_node_loses_nothing(cluster: Any) -> None:
    """The second node ends while it works; what it had goes to the first."""
    other = cluster.add_node(**NODE, **ports())
    cluster.wait_for_nodes()
    answers: list[int] = []
    for _, (number, _) in Ray(cluster.address).each(where, range(6)):
        if not answers:
            cluster.remove_node(other, allow_graceful=False)
        answers.append(number)
    assert sorted(answers) == list(range(6))
