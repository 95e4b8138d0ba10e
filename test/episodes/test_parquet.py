"""Parquet files as pandas and LeRobot write them: what was planted comes back exactly."""

from __future__ import annotations

import datetime
from pathlib import Path

import numpy as np
import pyarrow as pa  # type: ignore[import-untyped]
import pytest
import yaml
from pyarrow import parquet

from compass_ros.episodes.tables import import_tables
from compass_ros.errors import DataError
from test.episodes.table_files import ANGLE, FRAMES, MS, assert_planted, imported, track

START = datetime.datetime(2024, 5, 1, 12, tzinfo=datetime.timezone.utc)
NS = int(START.timestamp()) * 10**9 + 10**6 * MS


def written(folder: Path, **columns: object) -> str:
    parquet.write_table(pa.table(columns), folder / "data.parquet")
    return "data.parquet"


@pytest.mark.parametrize(
    ("time", "unit_s"),
    [
        (MS / 1000, 1.0),
        (MS.astype(np.int32), 1e-3),
        (NS, 1e-9),
        (pa.array(NS, pa.timestamp("ns", "UTC")), 1e-9),
        (pa.array(NS // 1000, pa.timestamp("us")), 1e-9),
    ],
    ids=["seconds", "milliseconds", "nanoseconds", "timestamps with a zone", "microseconds of pandas"],
)
def test_times_and_numbers(tmp_path: Path, time: object, unit_s: float) -> None:
    file = written(tmp_path, t=time, q=ANGLE, note=["a text"] * FRAMES)
    assert_planted(imported(tmp_path, file, ["q"], {"column": "t", "unit_s": unit_s}))


@pytest.mark.parametrize("kind", [pa.list_(pa.float64()), pa.list_(pa.float64(), 3), pa.large_list(pa.float64())])
def test_episodes_of_lists(tmp_path: Path, kind: pa.DataType) -> None:
    """As in a dataset of LeRobot: two episodes in one file, the states of all joints in one column."""
    states = np.stack([ANGLE, MS, -ANGLE], axis=1)
    file = written(
        tmp_path,
        timestamp=np.tile(MS / 1000, 2).astype(np.float64),
        episode_index=np.repeat([7, 9], FRAMES),
        **{"observation.state": pa.array([*states.tolist(), *states[::-1].tolist()], kind)},
    )
    more = {"group_by": "episode_index", "name": "run_{group}"}
    found = imported(tmp_path, file, ["observation.state.0"], "timestamp", **more)
    assert [bag.name for bag in found.bags] == ["run_7", "run_9"]
    assert_planted(found, index=0)
    np.testing.assert_array_equal(track(found, index=1).value[:, 0], ANGLE[::-1])


def test_a_column_of_lists_is_asked_for_by_its_own_name(tmp_path: Path) -> None:
    places = np.stack([ANGLE, MS, -ANGLE], axis=1)
    file = written(tmp_path, t=MS / 1000, place=pa.array(places.tolist()))
    content = {
        "cell": "lab",
        "recordings": [{"file": file, "format": "parquet", "name": "{file}"}],
        "time": {"column": "t"},
        "tracks": {"it": {"quantity": "xyz", "columns": ["place"]}},
    }
    (tmp_path / "import.yaml").write_text(yaml.safe_dump(content))
    np.testing.assert_array_equal(track(import_tables(tmp_path / "import.yaml", tmp_path / "out"), "xyz").value, places)


def test_what_is_empty_is_left_out(tmp_path: Path) -> None:
    some = [None if i in (3, 4) else float(a) for i, a in enumerate(ANGLE)]
    found = imported(tmp_path, written(tmp_path, t=MS / 1000, q=some), ["q"])
    assert_planted(found, [i for i in range(FRAMES) if i not in (3, 4)])


def test_what_is_no_parquet_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "data.parquet").write_bytes(b"PAR1 and no more")
    with pytest.raises(DataError, match="cannot be read as Parquet"):
        imported(tmp_path, "data.parquet", ["q"])
    with pytest.raises(DataError, match="group_by: no column 'run'; there are t, q"):
        imported(tmp_path, written(tmp_path, t=MS / 1000, q=ANGLE), ["q"], group_by="run")
    with pytest.raises(DataError, match="is empty"):
        imported(tmp_path, written(tmp_path, t=np.zeros(0), q=np.zeros(0)), ["q"])
