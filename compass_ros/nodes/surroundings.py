"""What may be wrong around any node: another one of its name, a simulated clock that nobody moves."""

from __future__ import annotations

import time

from rclpy.node import Node

STANDSTILL_S = 5.0
"""[s] A simulated clock that has not moved for so long has stopped; simulators publish it at 10 Hz or more."""


class Surroundings:
    """Looks once a call; a call a second is enough."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._clock_ns = -1
        self._moved_s = time.monotonic()

    def problems(self) -> list[str]:
        """One sentence each."""
        return [*self._namesakes(), *self._standing_clock()]

    def _namesakes(self) -> list[str]:
        """Two nodes of one name answer each other's services and goals, and neither knows."""
        own = (self._node.get_name(), self._node.get_namespace())
        others = self._node.get_node_names_and_namespaces().count(own) - 1
        if others < 1:
            return []
        name = self._node.get_fully_qualified_name()
        return [f"another node is called {name}: services and goals reach either one; end one, or rename it"]

    def _standing_clock(self) -> list[str]:
        now_ns, now_s = self._node.get_clock().now().nanoseconds, time.monotonic()
        if not self._node.get_parameter("use_sim_time").value or now_ns != self._clock_ns:
            self._clock_ns, self._moved_s = now_ns, now_s
        if not self._node.get_parameter("use_sim_time").value:
            return []
        if now_ns == 0:
            return ["use_sim_time is set and nobody publishes /clock: time stands at zero"]
        still_s = now_s - self._moved_s
        return [f"/clock has stopped: time has stood still for {still_s:.0f} s"] if still_s > STANDSTILL_S else []
