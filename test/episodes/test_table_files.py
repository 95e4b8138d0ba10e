"""Tables as other programs write them: what was planted comes back exactly, whatever stands around it."""

from __future__ import annotations

import datetime
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import openpyxl  # type: ignore[import-untyped]
import pytest
import scipy.io
import yaml

from compass_ros.episodes import default_sources, read_episode
from compass_ros.episodes.tables import Imported, import_tables
from compass_ros.errors import CompassError, DataError
from compass_ros.types import Track
from test.episodes.hostile import damaged

FRAMES = 24
MS = 10 * np.arange(FRAMES)
"""Time [ms]."""
ANGLE = np.random.default_rng(3).normal(size=FRAMES).round(9)
POSE = np.random.default_rng(4).normal(size=(FRAMES, 7)).round(6)


def imported(folder: Path, file: str, columns: Sequence[object], time: object = "t", **more: object) -> Imported:
    """The bags of one file in the folder; `more` goes to the recordings."""
    quantity = {1: "joint", 3: "xyz", 7: "pose"}[len(columns)]
    kinds = {"xlsx": "xlsx", "npz": "npz", "mat": "mat"}
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


def lines(sign: str, header: str = "t,x", point: str = ".", rows: range = range(FRAMES), end: str = "") -> str:
    """Seconds and angle."""
    every = [header.replace(",", sign)] * bool(header)
    every += [f"{MS[i] / 1000:.3f}{sign}{ANGLE[i]:.9f}".replace(".", point) + end for i in rows]
    return "\n".join(every) + "\n"


TEXTS: Mapping[str, str | bytes] = {
    "commas": lines(","),
    "commas and spaces": lines(",").replace(",", ", "),
    "semicolons": lines(";"),
    "tabs": lines("\t"),
    "bars": lines("|"),
    "spaces": lines(" "),
    "many spaces": lines("     ").replace("\n", "\n   "),
    "decimal commas": lines(";", point=","),
    "decimal commas, tabs": lines("\t", point=","),
    "decimal commas, quoted": "t,x\n"
    + "".join(f'"{m},0","{a:.9f}"\n'.replace(".", ",") for m, a in zip(MS, ANGLE, strict=True)),
    "quoted": lines('","').replace("\n", '"\n"').join(['"', ""])[:-1],
    "byte order mark": b"\xef\xbb\xbf" + lines(",").encode(),
    "UTF-16": lines("\t").encode("utf-16"),
    "UTF-16, big end first": b"\xfe\xff" + lines("\t").encode("utf-16-be"),
    "Windows letters": lines(";", "t,x,Winkel °", end=";1").encode("cp1252"),
    "Windows line ends": lines(",").replace("\n", "\r\n"),
    "old Mac line ends": lines(",").replace("\n", "\r"),
    "no last line end": lines(",")[:-1],
    "comments": "# recorded 12:30, by hand\n# rate: 100\n" + lines(","),
    "comments in between": lines(",").replace("\n0.100", "\n# paused, 3 s\n0.100"),
    "a comment as header": "#" + lines(","),
    "a comment as header, apart": "# " + lines(" "),
    "a per cent sign as comment": "% " + lines(" "),
    "Excel's own sign": "sep=;\n" + lines(";"),
    "empty lines": "\n\n" + lines(",").replace("\n0.05", "\n\n0.05") + "\n\n",
    "lines of separators": lines(",", "t,x,,", end=",,") + ",,,\n,,,\n",
    "a title": "My pendulum\n\n" + lines(","),
    "settings": "Rate [Hz],100\nLength [m],0.4\nName,Anna\n" + lines(","),
    "units below": lines(",").replace("\n", "\ns,rad\n", 1),
    "a text column": lines(",", "t,x,state", end=",RUN"),
    "an empty column": lines(",", "t,x,frame_id", end=","),
    "a column without name": lines(",", "t,x,", end=",RUN"),
    "a first column of names": "who,t,x\n" + "".join("me," + line + "\n" for line in lines(",", "").split()),
    "an index": ",t,x\n" + "".join(f"{i},{line}\n" for i, line in enumerate(lines(",", "").split())),
    "numbered columns": lines(",", "t,x,0,1,2", end=",5,6,7"),
    "exponents": "t,x\n" + "".join(f"{m / 1000:.3E},{a:.12e}\n" for m, a in zip(MS, ANGLE, strict=True)),
    "plus signs": "t,x\n" + "".join(f"{m / 1000:+.3f},{a:+.9f}\n" for m, a in zip(MS, ANGLE, strict=True)),
    "another part": lines(",") + "\nMarkers\nt,y\ns,mm\n0.000,3\n",
    "a name twice": lines(",", "t,x,y,y", end=",1,2"),
}


@pytest.mark.parametrize("how", TEXTS)
def test_text_files(tmp_path: Path, how: str) -> None:
    text = TEXTS[how]
    (tmp_path / "data.csv").write_bytes(text if isinstance(text, bytes) else text.encode())
    unit = {"column": "t", "unit_s": 0.001 if how == "decimal commas, quoted" else 1}
    found = imported(tmp_path, "data.csv", ["x"], unit)
    assert_planted(found)
    part = "data_1: another part begins in line 27 ('Markers') and is not read"
    assert found.said == ((part,) if how == "another part" else ())


@pytest.mark.parametrize("sign", [",", ";", "\t", " "])
def test_without_a_header_columns_have_numbers(tmp_path: Path, sign: str) -> None:
    (tmp_path / "data.txt").write_text(lines(sign, header=""))
    assert_planted(imported(tmp_path, "data.txt", [1], 0))


def test_the_header_can_be_named(tmp_path: Path) -> None:
    (tmp_path / "data.csv").write_text("7,8\n" * 12 + "1,2\n" + lines(",", header=""))
    assert_planted(imported(tmp_path, "data.csv", ["2"], "1", header=13))
    (tmp_path / "bare.csv").write_text(lines(",", header=""))
    assert_planted(imported(tmp_path, "bare.csv", [1], 0, header=0))
    with pytest.raises(DataError, match="has no line 99; its lines with anything in them are 1 to 37"):
        imported(tmp_path, "data.csv", ["x"], header=99)


NS = 1_700_000_000_123_456_789


def test_ros2_topic_echo(tmp_path: Path) -> None:
    """`ros2 topic echo --csv /joint_states`: no header; stamp, frame, names, positions, velocities, efforts."""
    stamps = [NS + int(m) * 10**6 for m in MS]
    rows = [f"{s // 10**9},{s % 10**9},,a,it,9.5,{a},0.1,0.2,0.0,0.0" for s, a in zip(stamps, ANGLE, strict=True)]
    (tmp_path / "echo.csv").write_text("\n".join(rows) + "\n")
    assert_planted(imported(tmp_path, "echo.csv", [6], {"column": 0, "nanosec": 1}))


def test_rostopic_echo(tmp_path: Path) -> None:
    """`rostopic echo -b FILE -p /joint_states`: nanoseconds since 1970, an empty frame, names as text."""
    head = "%time,field.header.seq,field.header.stamp,field.header.frame_id,field.name0,field.position0"
    rows = [
        f"{NS + int(m) * 10**6 + 7},{i},{NS + int(m) * 10**6},,it,{a}"
        for i, (m, a) in enumerate(zip(MS, ANGLE, strict=True))
    ]
    (tmp_path / "echo.csv").write_text("\n".join([head, *rows]) + "\n")
    for name in ("%time", "time", "field.header.stamp"):
        found = imported(tmp_path, "echo.csv", ["field.position0"], {"column": name, "unit_s": 1e-9}, name=f"by_{name}")
        assert_planted(found)


def test_plotjuggler(tmp_path: Path) -> None:
    """All series in one table by time; a cell is empty where a series has no sample."""
    rows = [
        f"{NS // 10**9}.{m + 100:03d},{a},\n{NS // 10**9}.{m + 103:03d},,{i}"
        for i, (m, a) in enumerate(zip(MS, ANGLE, strict=True))
    ]
    (tmp_path / "plot.csv").write_text("__time,/joint_states/it/position,/tf/x\n" + "\n".join(rows) + "\n")
    found = imported(tmp_path, "plot.csv", ["/joint_states/it/position"], "__time")
    assert_planted(found)
    assert "24 of 48 rows of it are left out (24 without a number): line 3, line 5," in found.said[0]
    whole = imported(tmp_path, "plot.csv", ["/tf/x"], "__time", name="other")
    np.testing.assert_array_equal(track(whole).value[:, 0], np.arange(FRAMES))


BODY, MARKER = 8, 4
MOTIVE = "\n".join(
    [
        "Format Version,1.23,Take Name,Take 1,Take Notes,,Capture Frame Rate,100.000000,Length Units,Meters",
        "",
        ",Type" + ",Rigid Body" * BODY + ",Rigid Body Marker" * MARKER,
        ",Name" + ",Cube" * BODY + ",Cube:Marker1" * MARKER,
        ",ID" + ',"12"' * BODY + ',"E1F"' * MARKER,
        "," + ",Rotation" * 4 + ",Position" * 3 + ",Mean Marker Error" + ",Position" * 3 + ",Marker Quality",
        "Frame,Time (Seconds),X,Y,Z,W,X,Y,Z,,X,Y,Z,",
        "",
    ]
)
IN_MOTIVE = ["Cube/Position/X", "Cube/Position/Y", "Cube/Position/Z"]
IN_MOTIVE += ["Cube/Rotation/W", "Cube/Rotation/X", "Cube/Rotation/Y", "Cube/Rotation/Z"]


def motive(lost: Sequence[int]) -> str:
    rows = []
    for i, (x, y, z, w, a, b, c) in enumerate(POSE):
        cells = [""] * 7 if i in lost else [a, b, c, w, x, y, z]
        rows.append(
            ",".join(map(str, [i, f"{MS[i] / 1000:.6f}", *cells, "" if i in lost else 0.0003, *cells[4:], 1.0]))
        )
    return MOTIVE + "\n".join(rows) + "\n"


def assert_poses(found: Imported, rows: Sequence[int] = range(FRAMES)) -> None:
    one = track(found, "pose")
    np.testing.assert_array_equal(one.value, POSE[rows])
    assert one.stamp_ns.tolist() == (10**6 * MS[rows]).tolist()


@pytest.mark.parametrize("lost", [(), (3, 4, 5), (0, 23)])
def test_optitrack_motive(tmp_path: Path, lost: Sequence[int]) -> None:
    (tmp_path / "Take 1.csv").write_text("\ufeff" + motive(lost), encoding="utf-8")
    found = imported(tmp_path, "Take 1.csv", IN_MOTIVE, "Time (Seconds)")
    assert_poses(found, [i for i in range(FRAMES) if i not in lost])
    assert len(found.said) == bool(lost)
    assert all(
        f"{len(lost)} of 24 rows of it are left out ({len(lost)} without a number)" in line for line in found.said
    )


def test_a_name_that_several_columns_have(tmp_path: Path) -> None:
    (tmp_path / "take.csv").write_text(motive(()))
    with pytest.raises(DataError, match=r"'X' are 3 columns: Rigid Body/Cube/12/Rotation/X \(number 2\), .*say more"):
        imported(tmp_path, "take.csv", ["X", "Y", "Z"], "Time (Seconds)")
    assert_poses(imported(tmp_path, "take.csv", [6, 7, 8, 5, 2, 3, 4], "Time (Seconds)"))


@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_vicon_nexus(tmp_path: Path, end: str) -> None:
    """Two parts, their rate in a line of its own, the object's name over its first column, units below the names."""
    text = "Objects\n100\n,,Global Angle Cube:Cube,,,,,\nFrame,Sub Frame,RX,RY,RZ,TX,TY,TZ\n,,deg,deg,deg,mm,mm,mm\n"
    text += "".join(f"{i + 1},0,0.1,0.2,0.3,{x},{y},{z}\n" for i, (x, y, z) in enumerate(POSE[:, :3]))
    text += "\nTrajectories\n100\n,,Cube:C1,,\nFrame,Sub Frame,X,Y,Z\n,,mm,mm,mm\n1,0,1,2,3\n"
    (tmp_path / "trial.csv").write_text(text.replace("\n", end))
    for i, names in enumerate(
        (["TX", "TY", "TZ"], ["TX/mm", "TY/mm", "TZ/mm"], [f"Global Angle Cube:Cube/T{a}" for a in "XYZ"])
    ):
        found = imported(tmp_path, "trial.csv", names, {"rate_hz": 100}, name=f"trial_{i}")
        np.testing.assert_array_equal(track(found, "xyz").value, POSE[:, :3])
        assert found.said == (f"trial_{i}: another part begins in line 31 ('Trajectories') and is not read",)


@pytest.mark.parametrize(
    "date", ["2024-02-28T23:59:59.9{:02d}0", "2024-02-28 23:59:59.9{:02d}", "2024-02-28T23:59:59.9{:02d}000+02:00"]
)
def test_dates(tmp_path: Path, date: str) -> None:
    few = range(9)
    text = "".join(f"{date.format(int(MS[i]))},{ANGLE[i]}\n" for i in few)
    (tmp_path / "data.csv").write_text("t,x\n" + text)
    assert_planted(imported(tmp_path, "data.csv", ["x"]), few)


NOTHING = ("", "nan", "NaN", "n/a", "NA", "null", "None", "-", "inf", "#N/A", "1.#QNAN")


@pytest.mark.parametrize("cell", NOTHING)
def test_cells_that_say_that_there_is_no_number(tmp_path: Path, cell: str) -> None:
    text = lines(",").splitlines()
    for line in (5, 6, 7, 20):
        text[line] = f"{text[line].split(',')[0]},{cell}"
    text[22] = f"{cell},0.5"
    (tmp_path / "data.csv").write_text("\n".join(text))
    found = imported(tmp_path, "data.csv", ["x"])
    assert_planted(found, [i for i in range(FRAMES) if i not in (4, 5, 6, 19, 21)])
    left = "data_1: 4 of 23 rows of it are left out (4 without a number): line 6, line 7, line 8, line 21"
    assert found.said == (left, "data_1: 1 of 24 rows have no time and are left out")
    assert read_episode(found.bags[0], default_sources(["it"], "joint")).remarks == tuple(
        line.removeprefix("data_1: ") for line in found.said
    )


def test_rows_that_are_cut_short(tmp_path: Path) -> None:
    text = lines(",").splitlines()
    text[10] = text[10].split(",")[0]
    (tmp_path / "data.csv").write_text("\n".join(text))
    assert_planted(imported(tmp_path, "data.csv", ["x"]), [i for i in range(FRAMES) if i != 9])


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (lines(",").replace("\n0.100", "\n0.100,ERR\n0.101"), "holds something else than numbers in line 12: 'ERR'"),
        (lines(",").replace("\n0.100", "\naborted\n0.100"), "holds something else than numbers in line 12: 'aborted'"),
        (lines(",", point=","), "has 2 columns, but line 2 has 4"),
        ('t,x\n0.1,"1,234"\n0.2,"2,500"\n', "1,234 in line 2 may be 1.234 or 1234; write numbers with a point"),
        ("t;x\n0,1;1.234\n0,2;1.500\n0,3;999,5\n", "1.234 in line 2 may be 1.234 or 1234"),
        ("t;x\n0,1;1.234,5\n0,2;1.500,25\n", "holds something else than numbers in line 2: '1.234,5'"),
        ("t,x\n0.1,nan\n0.2,\n", "no row of the columns x says where it is"),
        ("t,x\n,1\n,2\n", "time: column 't' holds no number"),
        ("t,x\n0.1,1\n2024-01-01,2\n", "holds dates and numbers"),
        ("t,x\n0.1,1\n0.3,2\n0.2,3\n", "time does not increase in line 4: 0.2 s, then 0.1 s"),
        ("t,x\n", "time: column 't' holds no number"),
        ("", "is empty; expected a header line"),
        ("a,b\n0,1\n", "no column 't'; there are a, b"),
    ],
)
def test_what_cannot_be_understood_is_one_line(tmp_path: Path, text: str, said: str) -> None:
    (tmp_path / "data.csv").write_text(text)
    with pytest.raises(DataError) as caught:
        imported(tmp_path, "data.csv", ["x"])
    assert said in str(caught.value)
    assert str(caught.value).startswith(f"{tmp_path / 'data.csv'}: ")
    assert "\n" not in str(caught.value)


def test_one_bad_file_costs_none_of_the_others(tmp_path: Path) -> None:
    for i in range(4):
        (tmp_path / f"d_{i}.csv").write_text(lines(",") if i != 2 else "t,x\n0.1,ERR\n")
    found = imported(tmp_path, "d_*.csv", ["x"])
    assert [bag.name for bag in found.bags] == ["d_0_1", "d_1_1", "d_3_1"]
    (line,) = found.said
    assert line.startswith(f"left out: {tmp_path / 'd_2.csv'}: ")
    assert "'ERR'" in line


@pytest.mark.parametrize("column", ["same", "once"])
def test_an_action_is_one_number(tmp_path: Path, column: str) -> None:
    text = "t,x,same,once\n" + "".join(f"{i},{i},0.7,{0.7 if i == 0 else ''}\n" for i in range(5))
    (tmp_path / "data.csv").write_text(text)
    assert_action(tmp_path, column, 0.7)


def assert_action(folder: Path, column: str, expected: float) -> None:
    content: dict[str, Any] = {
        "cell": "lab",
        "recordings": [{"file": "data.csv", "format": "csv", "name": "{key}"}],
        "time": {"column": "t"},
        "tracks": {"it": {"quantity": "joint", "columns": ["x"]}},
        "action": {"speed": {"columns": [column], "scale": [2]}},
    }
    (folder / "import.yaml").write_text(yaml.safe_dump(content))
    bag = import_tables(folder / "import.yaml", folder / "out").bags[0]
    assert read_episode(bag, default_sources(["it"], "joint")).action == {"speed": 2 * expected}


@pytest.mark.parametrize(
    "values", [(0, 0, 0, 1), (0.5, 0.7, 0.5, 0.7), (1, 1, 1, 1.0000001), (0, "", 0, -1), (1, 2, 3, 4)]
)
def test_an_action_that_varies_is_refused(tmp_path: Path, values: Sequence[object]) -> None:
    (tmp_path / "data.csv").write_text("t,x,v\n" + "".join(f"{i},{i},{v}\n" for i, v in enumerate(values)))
    with pytest.raises(
        DataError, match=r"action\.speed: column 'v' varies \(.* in line 2, .* in line \d\); an action is"
    ):
        assert_action(tmp_path, "v", 0)


@pytest.mark.parametrize("how", ["plain", "title", "shifted", "empty", "text", "dates", "units"])
def test_workbooks(tmp_path: Path, how: str) -> None:
    book = openpyxl.Workbook()
    sheet = book.active
    rows: list[list[object]] = [["t", "x", "note"]]
    start = datetime.datetime(2024, 5, 1, 12)
    for i in range(FRAMES):
        at = start + datetime.timedelta(milliseconds=int(MS[i])) if how == "dates" else MS[i] / 1000
        rows.append([at, None if how == "empty" and i == 7 else ANGLE[i], "RUN" if how == "text" else None])
    rows[:0] = [["Pendulum, 1 May"], []] * (how == "title")
    rows[1:1] = [["s", "rad"]] * (how == "units")
    down, right = (4, 2) if how == "shifted" else (0, 0)
    for i, row in enumerate(rows):
        for j, cell in enumerate(row):
            sheet.cell(1 + i + down, 1 + j + right, cell)
    book.save(tmp_path / "data.xlsx")
    found = imported(tmp_path, "data.xlsx", ["x"])
    assert_planted(found, [i for i in range(FRAMES) if how != "empty" or i != 7])
    assert len(found.said) == (how == "empty")


COLUMN = {"t": MS[:, None] / 1000, "q": ANGLE[:, None]}
CELLS = np.empty((1, 3), object), np.empty((1, 3), object)
for _i in range(3):
    CELLS[0][0, _i], CELLS[1][0, _i] = MS[:, None] / 1000, np.stack([ANGLE, MS])
BESIDE = {"note": "a text", "fs": 100.0, "names": np.array(["a", "b"], object)}
MATS: Mapping[str, tuple[Mapping[str, object], str, str, str]] = {
    "columns": (COLUMN, "time=t state=q", "time.0", "state.0"),
    "rows": ({name: value.T for name, value in COLUMN.items()}, "time=t state=q", "time.0", "state.0"),
    "by their names": (COLUMN, "*", "t", "q"),
    "some by their names": ({**COLUMN, **BESIDE}, "t q", "t", "q"),
    "a text and a number beside": ({**COLUMN, **BESIDE}, "*", "t", "q"),
    "a matrix": ({"Y": np.column_stack([MS / 1000, ANGLE])}, "y=Y", "y.0", "y.1"),
    "a matrix on its side": ({"Y": np.stack([MS / 1000, ANGLE])}, "Y", "Y.0", "Y.1"),
    "a matrix wider than long": ({"t": MS[None] / 1000, "Y": np.tile(ANGLE[:, None], 40)}, "t Y", "t", "Y.39"),
    "that one on its side": ({"t": MS[None] / 1000, "Y": np.tile(ANGLE, (40, 1))}, "t Y", "t", "Y.39"),
    "whole numbers": ({"t": MS.astype(np.int32), "q": ANGLE}, "*", "t", "q"),
    "a structure": ({"log": {"t": MS / 1000, "out": {"q": ANGLE}}}, "t=log.t q=log.out.q", "t", "q"),
    "cells": ({"T": CELLS[0], "Y": CELLS[1]}, "time=T state=Y", "time.0", "state.0"),
    "structures side by side": (
        {"runs": np.array([(MS / 1000, ANGLE)] * 3, [("t", object), ("q", object)])}, "t=runs.t q=runs.q", "t", "q",
    ),
}  # fmt: skip


IN_VERSION_4 = ("columns", "rows", "by their names", "a matrix", "a matrix wider than long", "whole numbers")


@pytest.mark.parametrize(("how", "version"), [*((how, "5") for how in MATS), *((how, "4") for how in IN_VERSION_4)])
def test_matlab_files(tmp_path: Path, how: str, version: str) -> None:
    content, tables, time, column = MATS[how]
    scipy.io.savemat(tmp_path / "data.mat", dict(content), format=version)
    unit = {"column": time, "unit_s": 0.001 if how == "whole numbers" else 1}
    found = imported(tmp_path, "data.mat", [column], unit, tables=tables, name="{key}")
    several = how in ("cells", "structures side by side")
    assert [bag.name for bag in found.bags] == (["1", "2", "3"] if several else ["data"])
    for index in range(len(found.bags)):
        assert_planted(found, index=index)


@pytest.mark.parametrize(
    ("content", "tables", "said"),
    [
        (COLUMN, "time=T", "no variable 'T'; it has t, q"),
        (COLUMN, "X*", "no variables of numbers are asked for; it has t, q"),
        ({"log": {"t": MS}}, "t=log.time", "no field 'time' in 'log.time'; it has t"),
        ({"T": CELLS[0], "q": ANGLE}, "t=T q=q", "different numbers of recordings: {'t': 3, 'q': 1}"),
        ({"t": MS, "q": ANGLE[:-1]}, "*", "column 'q' has 23 rows, the time has 24"),
        ({"t": MS, "q": np.zeros((3, 4, 5))}, "*", "'q' has 3 dimensions; expected vectors and matrices"),
        ({"t": MS, "q": "text"}, "t=t q=q", "cannot be read as MAT with numbers"),
    ],
)
def test_matlab_files_that_do_not_hold_it(
    tmp_path: Path, content: Mapping[str, object], tables: str, said: str
) -> None:
    scipy.io.savemat(tmp_path / "data.mat", dict(content))
    with pytest.raises(DataError) as caught:
        imported(tmp_path, "data.mat", ["q"], tables=tables)
    assert said in str(caught.value)


def test_matlab_files_of_version_7_3_say_what_to_do(tmp_path: Path) -> None:
    head = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM"
    (tmp_path / "data.mat").write_bytes(head.ljust(512, b"\x00") + b"\x89HDF\r\n\x1a\n" + bytes(500))
    with pytest.raises(
        DataError, match=r"data\.mat: MAT files of version 7\.3 \(HDF5\) are not read; save it again .*'-v7'"
    ):
        imported(tmp_path, "data.mat", ["q"], tables="t q")


@pytest.mark.parametrize(
    ("arrays", "tables", "time", "column"),
    [
        ({"t": MS / 1000, "q": ANGLE}, "t=t q=q", "t", "q"),
        ({"t": MS / 1000, "Y": np.stack([ANGLE, MS])}, "t=t y=Y", "t", "y.0"),
        ({"Y": np.column_stack([MS / 1000, ANGLE])}, "*", "0", "1"),
        ({"Y": np.column_stack([MS / 1000, ANGLE]), "fs": np.array(100.0), "note": np.array("text")}, "*", "0", "1"),
        ({"Y": np.column_stack([MS / 1000, ANGLE]).astype(np.longdouble)}, "Y", 0, 1),
    ],
)
def test_numpy_files(tmp_path: Path, arrays: Mapping[str, Any], tables: str, time: object, column: object) -> None:
    np.savez(tmp_path / "data.npz", **arrays)
    assert_planted(imported(tmp_path, "data.npz", [column], time, tables=tables))


@pytest.mark.parametrize("kind", ["csv", "xlsx", "npz"])
def test_damaged_files_are_read_or_refused_with_one_line(tmp_path: Path, kind: str) -> None:
    """As bags in test_hostile. Not MAT: scipy's reader itself may end the process there."""
    path = tmp_path / f"data.{kind}"
    if kind == "csv":
        path.write_text(motive(()))
    elif kind == "npz":
        np.savez(path, t=MS, q=ANGLE)
    else:
        book = openpyxl.Workbook()
        for row in (["t", "q"], *zip(MS.tolist(), ANGLE.tolist(), strict=True)):
            book.active.append(row)
        book.save(path)
    content, refused = path.read_bytes(), []
    for seed in range(60):
        path.write_bytes(damaged(content, seed))
        try:
            imported(tmp_path, path.name, [2], 1, name=f"{{file}}_{seed}", tables="t=t q=q" if kind == "npz" else "*")
        except CompassError as error:
            refused.append(str(error))
    assert refused
    assert all("\n" not in line and len(line) < 1000 for line in refused)
