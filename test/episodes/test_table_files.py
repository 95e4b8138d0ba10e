"""Tables as other programs write them: what was planted comes back exactly, whatever stands around it."""

from __future__ import annotations

import datetime
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import openpyxl  # type: ignore[import-untyped]
import pytest
import yaml

from compass_ros.episodes import default_sources, read_episode
from compass_ros.episodes.tables import Imported, import_tables
from compass_ros.errors import CompassError, DataError
from test.episodes.hostile import damaged
from test.episodes.table_files import ANGLE, FRAMES, MS, POSE, assert_planted, imported, track


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
