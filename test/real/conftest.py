"""Where the real recordings are, and a small part of the tosses."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from compass_ros.episodes.tables import DATA_VARIABLE

REAL = Path(os.environ.get(DATA_VARIABLE, Path(__file__).parents[2].parent / "shared" / "data"))
needs_real = pytest.mark.skipif(not REAL.is_dir(), reason=f"no real recordings in {REAL}; set {DATA_VARIABLE}")


@pytest.fixture
def real_data() -> Path:
    if not REAL.is_dir():
        pytest.skip(f"no real recordings in {REAL}; set {DATA_VARIABLE}")
    return REAL


@pytest.fixture
def some_tosses(real_data: Path, tmp_path: Path) -> Path:
    """A data folder with each seventh toss."""
    folder = tmp_path / "data" / "cube_tosses"
    folder.mkdir(parents=True)
    with np.load(real_data / "cube_tosses" / "tosses.npz") as arrays:
        names = sorted(arrays.files, key=int)[::7]
        np.savez(folder / "tosses.npz", **{name: arrays[name] for name in names})
    return folder.parent
