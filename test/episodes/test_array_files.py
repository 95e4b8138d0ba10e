"""Arrays as MATLAB and numpy write them: what was planted comes back exactly, however it is laid out."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.io

from compass_ros.errors import DataError
from test.episodes.table_files import ANGLE, MS, assert_planted, imported

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
        ({"t": MS / 1000, "q": ANGLE}, "t q", "t", "q"),
        ({"t": MS / 1000, "Y": np.stack([ANGLE, MS])}, "t=t y=Y", "t", "y.0"),
        ({"Y": np.column_stack([MS / 1000, ANGLE])}, "*", "0", "1"),
        ({"Y": np.column_stack([MS / 1000, ANGLE]), "fs": np.array(100.0), "note": np.array("text")}, "*", "0", "1"),
        ({"Y": np.column_stack([MS / 1000, ANGLE]).astype(np.longdouble)}, "Y", 0, 1),
    ],
)
def test_numpy_files(tmp_path: Path, arrays: Mapping[str, Any], tables: str, time: object, column: object) -> None:
    np.savez(tmp_path / "data.npz", **arrays)
    assert_planted(imported(tmp_path, "data.npz", [column], time, tables=tables))
