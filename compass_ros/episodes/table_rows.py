"""Rows of cells, as a spreadsheet or a text file has them, become tables: where the header ends and the numbers begin.

No format says so. Programs write a title, settings, the names of bodies and units around the names of the columns, or
no names at all; another part with other columns may follow after an empty line. The rule is one for all of them: a
header has a text where the cells below are numbers.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from compass_ros.episodes.table import Table, is_missing, is_number
from compass_ros.errors import DataError

Cells = Sequence[object]
_FIRST_ROWS = 50
"""The header is among them."""
_BELOW = 10
"""So many numbers in a row below a text make it the name of a column; a setting and its value are fewer."""


@dataclass(frozen=True)
class Row:
    line: int
    """In the file, from 1."""
    cells: Cells


@dataclass(frozen=True)
class _Block:
    """Consecutive rows of numbers, and what their columns are called."""

    names: Sequence[tuple[str, ...]]
    rows: Sequence[Row]
    remark: str


def tables_of(
    rows: Sequence[Row], file: str, key: str, group_by: str, header: int | None, thousands: str
) -> list[Table]:
    """The table in these rows; several where a column's values part it.

    Args:
        rows: Those with anything in them.
        file, key: What the file is called, and the table in it.
        group_by: Column whose values part the rows; empty: none.
        header: Line of the columns' names; 0: there is none, and columns have numbers; None: it is looked for.
        thousands: see `Table`.

    Raises:
        DataError: No rows, no such column, or rows that are longer than the header.
    """
    block = _block(rows, key, header)
    width = len(block.names)
    for row in block.rows:
        if any(not _blank(cell) for cell in row.cells[width:]):
            few = f"'{key}' has {width} columns, but line {row.line} has {len(row.cells)}"
            raise DataError(f"{few}: {list(row.cells)[:12]}")
    remarks = (block.remark,) * bool(block.remark)

    def table(index: int, group: str, members: Sequence[Row]) -> Table:
        labels = {"file": file, "index": str(index), "key": key, "group": group}
        return Table(
            labels,
            block.names,
            cells=lambda place: [row.cells[place] if place < len(row.cells) else None for row in members],
            rows=len(members),
            place=lambda row: f"line {members[row].line}",
            thousands=thousands,
            remarks=remarks,
        )

    if not group_by:
        return [table(1, "1", block.rows)]
    column = table(1, "1", block.rows)
    values = column.cells(column.index(group_by, f"'{key}', group_by"))
    groups: dict[str, list[Row]] = {}
    for row, value in zip(block.rows, values, strict=True):
        groups.setdefault(str(value).strip(), []).append(row)
    return [table(index, group, members) for index, (group, members) in enumerate(groups.items(), 1)]


def _block(rows: Sequence[Row], key: str, header: int | None) -> _Block:
    if not rows:
        raise DataError(f"'{key}' is empty; expected a header line and rows of numbers")
    if header is None:
        at = next((i for i in range(min(len(rows), _FIRST_ROWS)) if _heads(rows, i)), _fallback(rows))
    else:
        at = next((i for i, row in enumerate(rows) if row.line == header), -1)
        if header and at < 0:
            raise DataError(
                f"'{key}' has no line {header}; its lines with anything in them are {rows[0].line} to {rows[-1].line}"
            )
    if at < 0:
        width = max(len(row.cells) for row in rows)
        return _Block([(str(i),) for i in range(width)], *_part(rows))
    below = rows[at + 1 :]
    named = [i for i, cell in enumerate(_named(rows[at])) if not _blank(cell)]
    start = next((i for i, row in enumerate(below) if any(is_number(_at(row.cells, c)) for c in named)), len(below))
    above = [row for row in rows[:at] if _consecutive(rows, row, at) and not _title(row)]
    return _Block(_names(above, rows[at], below[:start]), *_part(below[start:]))


def _heads(rows: Sequence[Row], at: int) -> bool:
    """Whether a row is a header: a text of it stands over numbers only, and its rows are not longer than it."""
    cells = _named(rows[at])
    if not cells or is_number(cells[0]):
        return False
    for place in [place for place, cell in enumerate(cells) if not is_number(cell) and not is_missing(cell)]:
        found: list[Row] = []
        for before, row in pairwise(rows[at:]):
            apart = bool(found) and row.line > before.line + 1
            if len(found) == _BELOW or (apart and not _countable(_at(row.cells, place))):
                break
            if not _blank(_at(row.cells, place)):
                found.append(row)
        if all(_countable(_at(row.cells, place)) for row in found):
            numbers = [row for row in found if is_number(_at(row.cells, place))]
            if numbers and max(_width(row.cells) for row in numbers) <= len(cells):
                return True
    return False


def _countable(cell: object) -> bool:
    return is_number(cell) or is_missing(cell)


def _fallback(rows: Sequence[Row]) -> int:
    """Where no text stands over numbers: the first row is the header, unless it holds a number (-1)."""
    return -1 if any(is_number(cell) for cell in rows[0].cells) else 0


def _part(rows: Sequence[Row]) -> tuple[Sequence[Row], str]:
    """The rows without comments, up to where another part begins: an empty line, then texts where numbers were."""
    rows = [row for row in rows if not _comment(row)]
    if not rows:
        return rows, ""
    numbers = [place for place, cell in enumerate(rows[0].cells) if is_number(cell)]
    for i, row in enumerate(rows[1:], 1):
        apart = row.line > rows[i - 1].line + 1
        if apart and not any(
            _countable(_at(row.cells, place)) and not _blank(_at(row.cells, place)) for place in numbers
        ):
            first = next(cell for cell in row.cells if not _blank(cell))
            return rows[:i], f"another part begins in line {row.line} ('{first}') and is not read"
    return rows, ""


def _names(above: Sequence[Row], header: Row, units: Sequence[Row]) -> list[tuple[str, ...]]:
    """What each column is called, from the top. A name above holds for the columns to its right that have none."""
    width = len(_named(header))
    lines = [_filled(_named(row), width) for row in above]
    lines += [[_text(_at(_named(row), place)) for place in range(width)] for row in (header, *units)]
    return [tuple(dict.fromkeys(line[place] for line in lines if line[place])) for place in range(width)]


def _filled(cells: Cells, width: int) -> list[str]:
    found: list[str] = []
    for place in range(width):
        found.append(_text(_at(cells, place)) or (found[-1] if found else ""))
    return found


def _consecutive(rows: Sequence[Row], row: Row, at: int) -> bool:
    """Whether no empty line lies between a row and the header."""
    return rows[at].line - row.line == at - rows.index(row)


def _title(row: Row) -> bool:
    """One text at the left: about the whole table."""
    return _width(row.cells) == 1


def _named(row: Row) -> Cells:
    """Cells of a header, without the mark of a comment in a cell of its own."""
    return row.cells[1:] if row.cells and _text(row.cells[0]) in ("#", "%") else row.cells


def _comment(row: Row) -> bool:
    first = _text(row.cells[0]) if row.cells else ""
    return first.startswith(("#", "%")) and not is_missing(first)


def _width(cells: Cells) -> int:
    """Number of cells up to the last that is filled."""
    return max((place + 1 for place, cell in enumerate(cells) if not _blank(cell)), default=0)


def _at(cells: Cells, place: int) -> object:
    return cells[place] if place < len(cells) else None


def _blank(cell: object) -> bool:
    return cell is None or (isinstance(cell, str) and not cell.strip())


def _text(cell: object) -> str:
    return "" if cell is None else str(cell).strip()
