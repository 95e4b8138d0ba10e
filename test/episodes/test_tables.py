"""Tables become bags: every format, units, groups; each mistake gets one line. The shared real data where they are."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import openpyxl  # type: ignore[import-untyped]
import pytest
import scipy.io
import yaml

from compass_ros.episodes import Source, default_sources, read_episode, read_episodes
from compass_ros.episodes.tables import DATA_VARIABLE, import_tables
from compass_ros.errors import CompassError, ConfigError, DataError

ROOT = Path(__file__).parents[2]
REAL = Path(os.environ.get(DATA_VARIABLE, ROOT.parent / "shared" / "data"))
needs_real = pytest.mark.skipif(
    not REAL.is_dir(), reason=f"no real recordings in {REAL}; see its variable {DATA_VARIABLE}"
)

HEIGHTS = np.array([2.0, 1.5, 0.25])
BALL = default_sources(["ball"], "xyz")


def spec(folder: Path, **changes: object) -> Path:
    """A YAML that imports `drops.csv` by the column `drop`, with changes."""
    content: dict[str, object] = {
        "cell": "ball_drop",
        "recordings": [{"file": "drops.csv", "format": "csv", "group_by": "drop", "name": "drop_{group}"}],
        "time": {"column": "t", "unit_s": 0.001},
        "tracks": {"ball": {"quantity": "xyz", "columns": [None, None, "h"], "scale": [1, 1, 0.01], "std": 0.02}},
        "initial_state": {"ball": {"columns": ["h"], "scale": [0.01], "offset": [1]}},
        "action": {"height": {"columns": ["from"], "scale": [0.01]}},
    }
    path = folder / "import.yaml"
    path.write_text(yaml.safe_dump({**content, **changes}))
    return path


@pytest.fixture
def drops(tmp_path: Path) -> Path:
    lines = ["drop, t, h, from"]
    lines += [
        f"{drop},{500 + 20 * row},{100 * height * drop},{200 * drop}"
        for drop in (1, 2)
        for row, height in enumerate(HEIGHTS)
    ]
    (tmp_path / "drops.csv").write_text("\n".join(lines) + "\n\n")
    return tmp_path


def test_many_files_by_a_pattern(drops: Path) -> None:
    for name in ("fall_2", "fall_1", "other"):
        (drops / f"{name}.csv").write_text("t,h,from\n0,100,1\n20,90,1\n40,70,1\n")
    recordings = [{"file": "fall_*.csv", "format": "csv", "name": "{key}"}]
    bags = import_tables(spec(drops, recordings=recordings), drops / "out").bags
    assert [bag.name for bag in bags] == ["fall_1", "fall_2"]
    recordings[0]["name"] = "same"
    with pytest.raises(ConfigError, match=r"fall_\*\.csv: 'same' gives the same name to several"):
        import_tables(spec(drops, recordings=recordings), drops / "again")


def test_csv(drops: Path) -> None:
    bags = import_tables(spec(drops), drops / "out").bags
    assert [bag.name for bag in bags] == ["drop_1", "drop_2"]
    found = read_episodes(bags, BALL, "ball_drop")
    for drop, episode in enumerate(found, 1):
        np.testing.assert_allclose(episode.tracks[0].value[:, 2], HEIGHTS * drop)
        assert (np.diff(episode.tracks[0].stamp_ns) == 20_000_000).all()
        assert episode.start_ns == episode.tracks[0].stamp_ns[0]
        assert episode.tracks[0].std is not None
        np.testing.assert_allclose(episode.tracks[0].std, 0.02)
        assert episode.initial_state["ball"] == pytest.approx((1 + 2.0 * drop,))
        assert episode.action == pytest.approx({"height": 2.0 * drop})


def test_a_rate_instead_of_times(drops: Path) -> None:
    bags = import_tables(spec(drops, time={"rate_hz": 250}), drops / "out").bags
    assert np.diff(read_episode(bags[0], BALL).tracks[0].stamp_ns).tolist() == [4_000_000] * 2


def test_one_column_less_another(drops: Path) -> None:
    tracks = {"ball": {"quantity": "joint", "columns": ["h"], "minus": ["t"]}}
    bag = import_tables(spec(drops, tracks=tracks), drops / "out").bags[0]
    found = read_episode(bag, default_sources(["ball"], "joint")).tracks[0].value[:, 0]
    np.testing.assert_allclose(found, 100 * HEIGHTS - [500, 520, 540])


def test_xlsx_npz_and_mat_give_the_same(drops: Path) -> None:
    times = 500.0 + 20 * np.arange(3)
    book = openpyxl.Workbook()
    book.active.title = "Drop A"
    for row in [["t", "h"], *np.stack([times, 100 * HEIGHTS], axis=1).tolist(), [None, None]]:
        book.active.append(row)
    book.save(drops / "drops.xlsx")
    np.savez(drops / "drops.npz", **{"Drop A": np.stack([times, 100 * HEIGHTS], axis=1), "other": np.zeros((2, 2))})
    cells = {"T": np.empty((1, 1), object), "Y": np.empty((1, 1), object)}
    cells["T"][0, 0], cells["Y"][0, 0] = times[:, None], np.stack([0 * times, 100 * HEIGHTS])
    scipy.io.savemat(drops / "drops.mat", cells)
    found = []
    for kind, tables, names in (
        ("xlsx", "Drop*", ("t", "h")),
        ("npz", "Drop*", (0, 1)),
        ("mat", "time=T state=Y", ("time.0", "state.1")),
    ):
        recordings = [{"file": f"drops.{kind}", "format": kind, "tables": tables, "name": "{key}"}]
        columns: Sequence[object] = [None, None, names[1]]
        path = spec(
            drops,
            recordings=recordings,
            time={"column": str(names[0]), "unit_s": 0.001},
            tracks={"ball": {"quantity": "xyz", "columns": columns, "scale": [0.01]}},
            initial_state={},
            action={},
        )
        (bag,) = import_tables(path, drops / kind).bags
        found.append(read_episode(bag, BALL).tracks[0])
    for track in found:
        np.testing.assert_allclose(track.value[:, 2], HEIGHTS)
        np.testing.assert_array_equal(track.stamp_ns, found[0].stamp_ns)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"tims": 1}, "import.yaml: tims: Unexpected keyword argument.*did you mean 'time'"),
        ({"time": {"column": "T"}}, "drops.csv: drop_1: time: no column 'T'; there are drop, t, h, from"),
        (
            {"tracks": {"ball": {"quantity": "xyz", "columns": ["h", "g", "h"]}}},
            "tracks.ball: no column 'g'; there are drop, t, h, from",
        ),
        ({"time": {}}, "expected a column or a rate_hz"),
        ({"time": {"column": "h"}}, "time does not increase in line 3"),
        ({"tracks": {"ball": {"quantity": "xyz", "columns": ["h"]}}}, "expected 3 columns for 'xyz', found 1"),
        (
            {"tracks": {"ball": {"quantity": "joint", "columns": ["h"], "scale": [1, 2]}}},
            "tracks.ball.scale: expected 1 or 1 entries",
        ),
        ({"tracks": {"ball": {"quantity": "volume", "columns": ["h"]}}}, "tracks.ball.quantity: Input should be"),
        ({"recordings": [{"file": "x.csv", "format": "csv", "name": "x"}]}, "no file x.csv in .*--data"),
        (
            {"recordings": [{"file": "drops.csv", "format": "csv", "name": "{what}"}]},
            "expected only {file}, {index}, {key}, {group}",
        ),
        ({"recordings": [{"file": "drops.csv", "format": "csv", "name": "x", "group_by": "drop"}]}, "the same name"),
        (
            {"recordings": [{"file": "drops.csv", "format": "csv", "name": "x", "group_by": "y"}]},
            "'drops', group_by: no column 'y'",
        ),
        ({"recordings": [{"file": "../drops.csv", "format": "csv", "name": "x"}]}, "a path inside the data folder"),
        ({"recordings": [{"file": "/etc/passwd", "format": "csv", "name": "x"}]}, "a path inside the data folder"),
        ({"recordings": [{"file": "drops.csv", "format": "npz", "name": "x"}]}, "cannot be read as NPZ"),
        ({"recordings": [{"file": "drops.csv", "format": "mat", "name": "x"}]}, "cannot be read as MAT"),
        ({"recordings": [{"file": "drops.csv", "format": "xlsx", "name": "x"}]}, "cannot be read as an Excel workbook"),
        ({"recordings": [{"file": "drops.csv", "format": "csv", "name": "{key.__class__}"}]}, "expected only"),
    ],
)
def test_mistakes(drops: Path, changes: dict[str, object], message: str) -> None:
    with pytest.raises((ConfigError, DataError), match=message) as caught:
        import_tables(spec(drops, **changes), drops / "out")
    assert "\n" not in str(caught.value)


def test_arrays_with_python_objects_are_not_loaded(drops: Path) -> None:
    np.savez(drops / "evil.npz", a=np.array([{"x": 1}], dtype=object))
    recordings = [{"file": "evil.npz", "format": "npz", "name": "x"}]
    with pytest.raises(DataError, match="cannot be read as NPZ"):
        import_tables(spec(drops, recordings=recordings), drops / "out")


def test_the_folder_comes_from_the_command_line_or_the_environment(
    drops: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    elsewhere = drops / "elsewhere"
    elsewhere.mkdir()
    path = spec(drops)
    (drops / "drops.csv").rename(elsewhere / "drops.csv")
    with pytest.raises(CompassError, match=f"or {DATA_VARIABLE}"):
        import_tables(path, drops / "none")
    assert len(import_tables(path, drops / "one", elsewhere).bags) == 2
    monkeypatch.setenv(DATA_VARIABLE, str(elsewhere))
    assert len(import_tables(path, drops / "other").bags) == 2
    (elsewhere / "drops.csv").rename(drops / "drops.csv")
    assert len(import_tables(path, drops / "beside").bags) == 2  # what the named folder lacks is beside the YAML


@needs_real
def test_ball_drops(tmp_path: Path) -> None:
    bags = import_tables(ROOT / "config/import/ball_drops.yaml", tmp_path, REAL).bags
    assert len(bags) == 22
    found = read_episode(tmp_path / "Bowling_Ball_drop_1", BALL)
    assert found.tracks[0].value[0, 2] == 46.136281121
    assert len(found.tracks[0].stamp_ns) == 43
    assert found.tracks[0].stamp_ns[-1] - found.start_ns == pytest.approx(2.77166506982e9, abs=1)


@needs_real
def test_single_pendulum(tmp_path: Path) -> None:
    bags = import_tables(ROOT / "config/import/pendulum_single.yaml", tmp_path, REAL).bags
    assert sorted(bag.name for bag in bags) == [
        *(f"fit_{i:02d}" for i in range(1, 5)),
        "validation_01",
        "validation_02",
    ]
    found = read_episode(bags[0], default_sources(["joint1"], "joint"))
    assert found.initial_state["joint1"] == (1.523163726144009, 1.8482540642494463)
    assert (np.diff(found.tracks[0].stamp_ns) == 1_000_000).all()


@pytest.mark.nightly
@needs_real
@pytest.mark.slow
def test_cube_tosses_and_double_pendulum(tmp_path: Path) -> None:
    tosses = import_tables(ROOT / "config/import/cube_tosses.yaml", tmp_path / "cube", REAL).bags
    assert len(tosses) == 440
    with np.load(REAL / "cube_tosses" / "tosses.npz") as arrays:
        table = arrays["7"]
    track = read_episode(tmp_path / "cube" / "toss_007", default_sources(["cube"], "pose")).tracks[0]
    np.testing.assert_allclose(track.value[:, :3], table[:, :3] * 0.0524)
    np.testing.assert_array_equal(track.value[:, 3:], table[:, 3:7])
    assert (track.stamp_ns[-1] - track.stamp_ns[0]) * 1e-9 == pytest.approx((len(table) - 1) / 148)
    swings = import_tables(ROOT / "config/import/pendulum_double.yaml", tmp_path / "double", REAL).bags
    assert len(swings) == 30
    joints = [Source("/joint_states", name, "joint") for name in ("joint1", "joint2")]
    assert len(read_episode(swings[0], joints).tracks) == 2
