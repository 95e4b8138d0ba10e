"""Tables of joints and commands become bags with signals and inputs: every format, many recordings a file, gaps."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import openpyxl  # type: ignore[import-untyped]
import pytest
import scipy.io

from compass_ros.cells import load
from compass_ros.episodes import Source, read_episode
from compass_ros.episodes.tables import DATA_VARIABLE, import_tables
from compass_ros.errors import CompassError, ConfigError, DataError
from compass_ros.operation.current import read
from compass_ros.types import Episode, Floats

ROOT = Path(__file__).parents[2]
REAL = Path(os.environ.get(DATA_VARIABLE, ROOT.parent / "shared" / "data"))
needs_real = pytest.mark.skipif(
    not REAL.is_dir(), reason=f"no real recordings in {REAL}; see its variable {DATA_VARIABLE}"
)
FRAMES = 40
RNG = np.random.default_rng(2)
STAMP_US = 1_700_000_000_000_000 + np.cumsum(RNG.integers(900, 1100, FRAMES))
POSITION, COMMAND = RNG.normal(size=(2, FRAMES, 2))
SIGNAL = Source("/joint_states", "joints", "joint_position", of=("lift", "elbow"))
TARGET = Source("/joint_commands", "target", "joint_position", of=("lift", "elbow"), drives=True)
HEADER = ["stamp", "q_lift", "q_elbow", "u_lift", "u_elbow"]
NAMED = {"joints": ["q_lift", "q_elbow"], "target": ["u_lift", "u_elbow"]}
WHOLE = {"joints": ["q"], "target": ["u"]}


def table() -> Floats:
    return np.column_stack([STAMP_US.astype(float), POSITION, COMMAND])


def csv(path: Path) -> None:
    rows = [
        ",".join([str(stamp), *map(repr, row)]) for stamp, row in zip(STAMP_US, table()[:, 1:].tolist(), strict=True)
    ]
    path.write_text("\n".join([",".join(HEADER), *rows]) + "\n")


def semicolons(path: Path) -> None:
    csv(path)
    path.write_text(path.read_text().replace(",", ";").replace(".", ","))


def xlsx(path: Path) -> None:
    book = openpyxl.Workbook()
    book.active.append(HEADER)
    for row in table().tolist():
        book.active.append(row)
    book.save(path)


def npz(path: Path) -> None:
    np.savez(path, stamp=STAMP_US, q=POSITION, u=COMMAND)


def mat(path: Path) -> None:
    scipy.io.savemat(path, {"stamp": STAMP_US, "q": POSITION, "u": COMMAND})


FORMATS: Mapping[str, tuple[str, str, Callable[[Path], None], str, Mapping[str, list[str]]]] = {
    "csv": ("log.csv", "csv", csv, "*", NAMED),
    "decimal commas": ("log.csv", "csv", semicolons, "*", NAMED),
    "xlsx": ("log.xlsx", "xlsx", xlsx, "*", NAMED),
    "npz": ("log.npz", "npz", npz, "stamp=stamp q=q u=u", WHOLE),
    "npz by column": (
        "log.npz",
        "npz",
        npz,
        "stamp=stamp q=q u=u",
        {"joints": ["q.0", "q.1"], "target": ["u.0", "u.1"]},
    ),
    "mat": ("log.mat", "mat", mat, "stamp q u", WHOLE),
}


def spec(folder: Path, file: str, kind: str, tables: str = "*", **changes: object) -> Path:
    content: dict[str, object] = {
        "cell": "arm",
        "recordings": [{"file": file, "format": kind, "tables": tables, "name": "{key}"}],
        "time": {"column": "stamp", "unit_s": 1e-6},
        **changes,
    }
    path = folder / "import.yaml"
    path.write_text(json.dumps(content))  # which is YAML too
    return path


def wanted(columns: Mapping[str, list[str]], **more: object) -> dict[str, object]:
    both: dict[str, object] = {"quantity": "joint_position", "of": ["lift", "elbow"], **more}
    return {
        "tracks": {"joints": {**both, "columns": columns["joints"]}},
        "inputs": {"target": {**both, "columns": columns["target"]}},
    }


def same(found: Episode, position: Floats = POSITION, command: Floats = COMMAND, share: float = 0.0) -> None:
    """To the last bit, or with an error that is a small share."""
    np.testing.assert_allclose(found.tracks[0].value, position, rtol=share, atol=0)
    np.testing.assert_allclose(found.inputs[0].value, command, rtol=share, atol=0)
    for track in (*found.tracks, *found.inputs):
        np.testing.assert_array_equal(track.stamp_ns - 10**9, (STAMP_US - STAMP_US[0]) * 1000)


@pytest.mark.parametrize("case", FORMATS)
def test_signals_and_inputs_of_every_format(tmp_path: Path, case: str) -> None:
    file, kind, write, tables, columns = FORMATS[case]
    write(tmp_path / file)
    (bag,) = import_tables(spec(tmp_path, file, kind, tables, **wanted(columns)), tmp_path / "out").bags
    same(read_episode(bag, [SIGNAL, TARGET]), share=1e-15 if kind == "xlsx" else 0.0)  # Excel keeps 15 digits


def test_a_cell_that_names_no_topic_finds_them(tmp_path: Path) -> None:
    """Both sides have the same defaults."""
    npz(tmp_path / "log.npz")
    (bag,) = import_tables(
        spec(tmp_path, "log.npz", "npz", "stamp=stamp q=q u=u", **wanted(WHOLE)), tmp_path / "o"
    ).bags
    scene = '<mujoco><worldbody><body><joint name="lift"/><geom size="1"/><body><joint name="elbow"/><geom size="1"/>'
    scene += '</body></body></worldbody><actuator><motor name="lift" joint="lift"/></actuator></mujoco>'
    (tmp_path / "arm.xml").write_text(scene)
    both = "quantity: joint_position, of: [lift, elbow]"
    (tmp_path / "arm.yaml").write_text(
        "name: arm\ndynamics: mjcf\nmodel: arm.xml\nwindows: {length_s: 1}\n"
        f"inputs: [{{name: target, {both}, to: qfrc}}]\nsignals: [{{name: joints, {both}}}]\n"
    )
    same(read(load(tmp_path / "arm.yaml"), bag))


def test_units_and_zeros_of_each_joint(tmp_path: Path) -> None:
    npz(tmp_path / "log.npz")
    more = {"scale": [0.5, -2.0], "offset": [0.0, 1.0]}
    path = spec(tmp_path, "log.npz", "npz", "stamp=stamp q=q u=u", **wanted(WHOLE, **more))
    found = read_episode(import_tables(path, tmp_path / "out").bags[0], [SIGNAL, TARGET])
    same(found, POSITION * [0.5, -2.0] + [0.0, 1.0], COMMAND * [0.5, -2.0] + [0.0, 1.0])


def test_joints_that_are_missing_now_and_then(tmp_path: Path) -> None:
    """A row keeps what it has; one without anything is left out and said."""
    lost = table()
    lost[3, 1] = lost[5, 1:3] = lost[7, 3:] = np.nan
    np.savez(tmp_path / "log.npz", stamp=STAMP_US, q=lost[:, 1:3], u=lost[:, 3:])
    imported = import_tables(spec(tmp_path, "log.npz", "npz", "stamp=stamp q=q u=u", **wanted(WHOLE)), tmp_path / "out")
    found = read_episode(imported.bags[0], [SIGNAL, TARGET])
    np.testing.assert_array_equal(found.tracks[0].value, np.delete(lost[:, 1:3], 5, axis=0))
    np.testing.assert_array_equal(found.inputs[0].value, np.delete(COMMAND, 7, axis=0))
    assert [said.partition(" rows of ")[2] for said in imported.said] == [
        "joints are left out (1 without a number): row 6",
        "target are left out (1 without a number): row 8",
    ]


GROUPS: Mapping[str, tuple[str, str, Mapping[str, str]]] = {
    "before": ("stamp=*.stamp q=*.q u=*.u", "{}.{}", {}),
    "behind": ("stamp=stamp_* q=q_* u=u_*", "{1}_{0}", {}),
    "between": ("stamp=log.*.stamp q=log.*.q u=log.*.u", "log.{}.{}", {}),
    "with points in it": ("stamp=*.stamp q=*.q u=*.u", "run.{}.{}", {"a": "run.a", "b": "run.b", "c": "run.c"}),
    "beside others": ("stamp=*.stamp q=*.q u=*.u", "{}.{}", {}),
}


@pytest.mark.parametrize("case", GROUPS)
def test_recordings_that_a_star_tells_apart(tmp_path: Path, case: str) -> None:
    tables, name, keys = GROUPS[case]
    own = {"a": 1.0, "b": 2.0, "c": 3.0}
    arrays = {
        name.format(key, what): value
        for key, factor in own.items()
        for what, value in (("stamp", STAMP_US), ("q", factor * POSITION), ("u", COMMAND))
    }
    if case == "beside others":
        arrays |= {"version": np.array("1"), "d.stamp": STAMP_US, "d.q": POSITION}
    np.savez(tmp_path / "log.npz", **arrays)
    imported = import_tables(spec(tmp_path, "log.npz", "npz", tables, **wanted(WHOLE)), tmp_path / "out")
    assert [bag.name for bag in imported.bags] == [keys.get(key, key) for key in own]
    for bag, factor in zip(imported.bags, own.values(), strict=True):
        same(read_episode(bag, [SIGNAL, TARGET]), factor * POSITION)
    said = ["a: d is left out: no array for u"] if case == "beside others" else []
    assert list(imported.said) == said


@pytest.mark.parametrize("first", [0, 1_700_000_000_000_000_000, 2**62])
def test_times_in_whole_nanoseconds_are_exact(tmp_path: Path, first: int) -> None:
    stamps = first + np.cumsum(RNG.integers(1, 10**7, FRAMES))
    np.savez(tmp_path / "log.npz", stamp=stamps, q=POSITION, u=COMMAND)
    path = spec(
        tmp_path, "log.npz", "npz", "stamp=stamp q=q u=u", time={"column": "stamp", "unit_s": 1e-9}, **wanted(WHOLE)
    )
    found = read_episode(import_tables(path, tmp_path / "out").bags[0], [SIGNAL])
    np.testing.assert_array_equal(found.tracks[0].stamp_ns - 10**9, stamps - stamps[0])


OTHERS: Mapping[str, tuple[Mapping[str, object], Source, str, int]] = {
    "scalar": (
        {"quantity": "scalar", "of": ["a", "b"]},
        Source("/x", "x", "scalar", of=("a", "b"), drives=True),
        "inputs",
        2,
    ),
    "twist": (
        {"quantity": "twist", "of": ["vx", "wz"]},
        Source("/x", "x", "twist", of=("vx", "wz"), drives=True),
        "inputs",
        2,
    ),
    "force": ({"quantity": "wrench", "topic": "/ft"}, Source("/ft", "x", "wrench"), "tracks", 6),
    "gyro": ({"quantity": "gyro"}, Source("/x", "x", "gyro"), "tracks", 3),
    "efforts": (
        {"quantity": "joint_effort", "of": ["j"]},
        Source("/joint_states", "x", "joint_effort", of=("j",)),
        "tracks",
        1,
    ),
}


@pytest.mark.parametrize("case", OTHERS)
def test_other_quantities(tmp_path: Path, case: str) -> None:
    said, source, section, size = OTHERS[case]
    value = RNG.normal(size=(FRAMES, size))
    np.savez(tmp_path / "log.npz", stamp=STAMP_US, y=value)
    tracks: dict[str, object] = {"tracks": {}} | {section: {"x": {**said, "columns": ["y"]}}}
    path = spec(tmp_path, "log.npz", "npz", "stamp=stamp y=y", **tracks)
    found = read_episode(import_tables(path, tmp_path / "out").bags[0], [source])
    np.testing.assert_array_equal((found.inputs if source.drives else found.tracks)[0].value, value)


MISTAKES: Mapping[str, tuple[Mapping[str, object], str, str]] = {
    "no names": (
        {"quantity": "joint_position", "columns": ["q"]},
        "stamp=stamp q=q",
        "tracks.x.of: missing; say a name",
    ),
    "too few": (
        {"quantity": "joint_position", "columns": ["q.0"], "of": ["a", "b"]},
        "stamp=stamp q=q",
        "expected 2 columns for 'joint_position', found 1",
    ),
    "numbers of a track": (
        {"quantity": "wrench", "columns": ["q"], "of": ["fx", "fy"]},
        "stamp=stamp q=q",
        "tracks.x.of: a track has all numbers",
    ),
    "an array": (
        {"quantity": "joint_position", "columns": ["p"], "of": ["a"]},
        "stamp=stamp q=q",
        "no column 'p'; there are",
    ),
    "nothing for the star": (
        {"quantity": "joint_position", "columns": ["q"], "of": ["a"]},
        "stamp=*.stamp q=*.q",
        "no variables of numbers are asked for; it has",
    ),
    "a variable": (
        {"quantity": "joint_position", "columns": ["q"], "of": ["a"]},
        "stamp=stamp q=qq",
        "no variable 'qq'; it has stamp, q",
    ),
}


@pytest.mark.parametrize("case", MISTAKES)
def test_mistakes_are_one_line(tmp_path: Path, case: str) -> None:
    track, tables, said = MISTAKES[case]
    npz(tmp_path / "log.npz")
    with pytest.raises(CompassError, match=said) as caught:
        import_tables(spec(tmp_path, "log.npz", "npz", tables, tracks={"x": track}), tmp_path / "out")
    assert isinstance(caught.value, ConfigError | DataError)
    assert "\n" not in str(caught.value)


@needs_real
@pytest.mark.nightly
def test_so101(tmp_path: Path) -> None:
    bags = import_tables(ROOT / "config/import/so101.yaml", tmp_path, REAL).bags
    cell = load("so101")
    with np.load(REAL / "so101" / "motions.npz") as arrays:
        assert len(bags) == 36
        for name in ("chirp_sweep", "static_holding", "reaching_points"):
            found = read(cell, tmp_path / name)
            np.testing.assert_array_equal(found.tracks[0].value, arrays[f"{name}.position"][:, :5].astype(float))
            np.testing.assert_array_equal(found.inputs[0].value, arrays[f"{name}.command"][:, :5].astype(float))
            stamps = arrays[f"{name}.stamp_us"]
            np.testing.assert_array_equal(found.tracks[0].stamp_ns - 10**9, 1000 * (stamps - stamps[0]))


@needs_real
def test_torque_pendulum(tmp_path: Path) -> None:
    bags = import_tables(ROOT / "config/import/torque_pendulum.yaml", tmp_path, REAL).bags
    with np.load(REAL / "torque_pendulum" / "runs.npz") as arrays:
        for bag in bags:
            found = read(load("torque_pendulum"), bag)
            np.testing.assert_array_equal(found.track("angle").value[:, 0], arrays[f"{bag.name}.measured.position"])
            np.testing.assert_array_equal(found.inputs[0].value[:, 0], arrays[f"{bag.name}.measured.torque"])
    assert len(bags) == 8
