"""What tests of the whole command line share."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any

import pytest

from compass_ros.cli import main

Run = Callable[..., tuple[int, str, str]]
"""Words of a command line -> status, standard output, standard error."""


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
