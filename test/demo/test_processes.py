"""A group of nodes: what happens when one of them ends, and that nothing of the group is left."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from compass_ros.demo.processes import NodeError, NodeGroup, shared_file
from compass_ros.demo.shared_memory import SHARED_MEMORY, held_locks
from compass_ros.errors import ConfigError
from test.nodes.harness import until


def test_files_of_the_suite_are_found() -> None:
    assert shared_file("config/fastdds.xml").read_text().startswith("<?xml")
    with pytest.raises(ConfigError, match=r"config/none.xml: not installed"):
        shared_file("config/none.xml")


@pytest.mark.ros
def test_a_node_that_cannot_start_is_one_line_with_its_log(tmp_path: Path) -> None:
    with NodeGroup(tmp_path) as nodes:
        waiting = nodes.start("calibration_client", pipe=True)
        nodes.start("virtual_cell", cell="air_hokey")
        with pytest.raises(NodeError, match=r"virtual_cell ended with status 1: unknown cell 'air_hokey'.*\(log: .*\)"):
            list(nodes.follow(waiting))
    assert waiting.process.poll() is not None


@pytest.mark.ros
def test_a_client_without_a_calibrator_says_so(tmp_path: Path) -> None:
    with NodeGroup(tmp_path) as nodes:
        client = nodes.start("calibration_client", pipe=True, timeout_s=0.5)
        with pytest.raises(NodeError, match=r"waited 0.5 s for a calibrator"):
            list(nodes.follow(client))


@pytest.mark.ros
def test_nothing_is_left_of_a_group_not_even_of_a_node_that_does_not_end(tmp_path: Path) -> None:
    with NodeGroup(tmp_path, patience_s=1.0) as nodes:
        node = nodes.start("recorder", directory=str(tmp_path / "bags"))
        until(lambda: len(held_locks(node.process.pid)) > 1, "the node's shared memory")
        locks = held_locks(node.process.pid)
        os.kill(node.process.pid, 19)  # SIGSTOP: it cannot end by itself
    assert node.process.poll() is not None
    left = [lock for lock in locks if lock.exists() or (SHARED_MEMORY / lock.name.removesuffix("_el")).exists()]
    assert left == []
