"""Problems that come and go: each is said once in the log when it begins, and once when it is over."""

from __future__ import annotations

import re
from collections.abc import Iterable

from rclpy.impl.rcutils_logger import RcutilsLogger

_NUMBER = re.compile(r"(?<![\w.])\d+(\.\d+)?(?!\w)")
"""Seconds and counts, which change while a problem stays the same; not the digit of a name, as in `puck1`."""


class Alarms:
    """Of one node. A problem is one sentence; two that differ in numbers alone are the same one."""

    def __init__(self, logger: RcutilsLogger) -> None:
        self._log = logger
        self._now: dict[str, str] = {}

    def take(self, problems: Iterable[str]) -> bool:
        """What is wrong now; true where something has begun or has ended since the last call."""
        now = {_NUMBER.sub("#", problem): problem for problem in problems}
        begun, over = now.keys() - self._now.keys(), self._now.keys() - now.keys()
        for kind in begun:
            self._log.warning(now[kind])
        for kind in over:
            self._log.info(f"over: {self._now[kind].partition(': ')[0]}")
        self._now = now
        return bool(begun or over)
