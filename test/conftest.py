"""What tests of the whole command line share."""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from compass_ros.cli import main

Run = Callable[..., tuple[int, str, str]]
"""Words of a command line -> status, standard output, standard error."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Slow tests first: otherwise the last of them runs for minutes while the other process has nothing left to do.

    Those that need ROS are not run in parallel, and keep their order: the tests of a folder share a DDS domain.
    """
    items.sort(key=lambda item: not item.get_closest_marker("slow") or bool(item.get_closest_marker("ros")))


@pytest.fixture
def hear_ctrl_c() -> Iterator[None]:
    """Who runs the tests in the background has them, and so their children, ignore SIGINT."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> Run:
    """Runs `compass` with these words, in this process."""

    def call(*words: object) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["compass", *map(str, words)])
        try:
            main()
            status: Any = 0
        except SystemExit as end:
            status = end.code or 0
        out, err = capfd.readouterr()
        return int(status), out, err

    return call
