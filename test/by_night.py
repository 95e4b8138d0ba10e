"""Cases of which some are tried at every change, and all by night."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import pytest


def but(cases: Iterable[Any], *by_day: Any) -> list[Any]:
    """Values, or rows of them, of a parametrized test; those that are not `by_day` are nightly."""
    rows = [(case if isinstance(case, tuple) else (case,), case in by_day) for case in cases]
    return [pytest.param(*values, marks=() if day else pytest.mark.nightly) for values, day in rows]
