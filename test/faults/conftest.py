"""Faults of nodes use the processes and the DDS domain of the node tests."""

from __future__ import annotations

from test.nodes.conftest import domain, probe, recorder, start_node

__all__ = ["domain", "probe", "recorder", "start_node"]
