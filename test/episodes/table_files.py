"""Numbers that are planted in tables of any format, and how they come back."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import yaml

from compass_ros.episodes import default_sources, read_episode
from compass_ros.episodes.tables import Imported, import_tables
from compass_ros.types import Track

FRAMES = 24
MS = 10 * np.arange(FRAMES)
"""Time [ms]."""
ANGLE = np.random.default_rng(3).normal(size=FRAMES).round(9)
POSE = np.random.default_rng(4).normal(size=(FRAMES, 7)).round(6)


def imported(folder: Path, file: str, columns: Sequence[object], time: object = "t", **more: object) -> Imported:
    """The bags of one file in the folder; `more` goes to the recordings."""
    quantity = {1: "joint", 3: "xyz", 7: "pose"}[len(columns)]
    kinds = {"xlsx": "xlsx", "npz": "npz", "mat": "mat", "parquet": "parquet"}
    recordings = {"file": file, "format": kinds.get(file.rsplit(".", 1)[-1], "csv"), "name": "{file}_{index}", **more}
    content = {
        "cell": "lab",
        "recordings": [recordings],
        "time": time if isinstance(time, dict) else {"column": time},
        "tracks": {"it": {"quantity": quantity, "columns": list(columns)}},
    }
    (folder / "import.yaml").write_text(yaml.safe_dump(content, allow_unicode=True), encoding="utf-8")
    return import_tables(folder / "import.yaml", folder / "out", folder)


def track(found: Imported, quantity: str = "joint", index: int = 0) -> Track:
    """The track in a bag, its stamps from 0."""
    one = read_episode(found.bags[index], default_sources(["it"], quantity)).tracks[0]  # type: ignore[arg-type]
    return Track(one.object, one.quantity, one.stamp_ns - 10**9, one.value, one.std)


def assert_planted(found: Imported, rows: Sequence[int] | range = range(FRAMES), index: int = 0) -> None:
    one = track(found, index=index)
    assert one.stamp_ns.tolist() == (10**6 * MS[rows]).tolist()
    np.testing.assert_array_equal(one.value[:, 0], ANGLE[rows])
