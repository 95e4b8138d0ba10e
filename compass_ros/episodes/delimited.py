"""Text files of numbers: whatever stands between the cells, before a decimal, and at the beginning of the file."""

from __future__ import annotations

import codecs
import csv
import io
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import islice
from pathlib import Path

from compass_ros.episodes.table import is_number
from compass_ros.episodes.table_rows import Row
from compass_ros.errors import DataError

_MARKS = {codecs.BOM_UTF8: "utf-8-sig", codecs.BOM_UTF16_LE: "utf-16", codecs.BOM_UTF16_BE: "utf-16"}
_DIGITS = re.compile(r"[+-]?\d[\d.,]*([eE][+-]?\d+)?")
"""A number with decimals and thousands of any country."""
_SAMPLE = 200
"""Lines by which the sign between the cells is found."""


def read_rows(path: Path) -> tuple[list[Row], str]:
    """Rows of a text file that have anything in them, and the signs that may part thousands in its numbers.

    Between the cells stands a tab, a semicolon, a comma, a bar or spaces: that that parts most lines, and
    by which most cells are numbers.
    Raises DataError.
    """
    try:
        text = decoded(path.read_bytes())
        sample = "".join(islice(io.StringIO(text, newline=""), _SAMPLE))
        name = max(_SPLITTERS, key=lambda each: _fitness(list(_SPLITTERS[each](sample))))
        lines = enumerate(_SPLITTERS[name](text), 1)
        rows = [(line, [cell.strip() for cell in cells]) for line, cells in lines]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise DataError(f"cannot be read as CSV: {error}") from error
    numbers = [cell for _, cells in rows[:_SAMPLE] for cell in cells if is_number(cell)]
    both = any("," in cell for cell in numbers) and any("." in cell for cell in numbers)
    filled = [Row(line, cells) for line, cells in rows if any(cells)]
    return filled, "," if name == "," else ",." * both


def decoded(data: bytes) -> str:
    """Text by its byte order mark; else UTF-8; else what Windows writes (1252)."""
    for mark, encoding in _MARKS.items():
        if data.startswith(mark):
            return data.decode(encoding)
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError:
        return data.decode("cp1252")


def _fitness(rows: Sequence[Sequence[str]]) -> tuple[bool, float]:
    """Whether most rows have several cells, and how many of the cells look like numbers, in [0, 1]."""
    filled = [[cell for cell in row if cell.strip()] for row in rows if any(map(str.strip, row))]
    cells = [cell for row in filled for cell in row]
    numbers = sum(_DIGITS.fullmatch(cell.strip()) is not None for cell in cells)
    several = sum(len(row) > 1 for row in filled)
    return 2 * several > len(filled), numbers / max(len(cells), 1)


def _separated(sign: str) -> Callable[[str], Iterator[list[str]]]:
    return lambda text: csv.reader(io.StringIO(text, newline=""), delimiter=sign, skipinitialspace=True)


def _spaced(text: str) -> Iterator[list[str]]:
    return (line.split() for line in text.splitlines())


_SPLITTERS: Mapping[str, Callable[[str], Iterator[list[str]]]] = {
    **{sign: _separated(sign) for sign in ("\t", ";", ",", "|")},
    " ": _spaced,
}
"""In the order of preference where the shares are equal."""
