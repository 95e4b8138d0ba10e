"""Where the real recordings are."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from compass_ros.episodes.tables import DATA_VARIABLE

REAL = Path(os.environ.get(DATA_VARIABLE, Path(__file__).parents[2].parent / "shared" / "data"))
needs_real = pytest.mark.skipif(not REAL.is_dir(), reason=f"no real recordings in {REAL}; set {DATA_VARIABLE}")


@pytest.fixture
def real_data() -> Path:
    if not REAL.is_dir():
        pytest.skip(f"no real recordings in {REAL}; set {DATA_VARIABLE}")
    return REAL
