"""A table of a file: columns found by their names, cells that become numbers only where somebody asks for them."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, timezone
from decimal import Decimal

import numpy as np

from compass_ros.errors import DataError, nearest, shown
from compass_ros.types import Floats, Ints

MISSING = frozenset(
    {"", "#n/a", "#n/a n/a", "#na", "-1.#ind", "-1.#qnan", "-nan", "1.#ind", "1.#qnan"}
    | {"<na>", "n/a", "na", "nan", "null", "none", "--", "-"}
)
"""Cells, in small letters, that say that there is no number: those of pandas, and a dash."""

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\d*[.,]\d+)([eE][+-]?\d+)?|[+-]?inf(inity)?", re.IGNORECASE)
_GROUPED = {sign: re.compile(rf"[+-]?[1-9]\d{{0,2}}(\{sign}\d{{3}})+") for sign in ",."}
"""What may be 1.234, or 1234 with its thousands apart."""


def is_missing(cell: object) -> bool:
    """Whether a cell says that there is no number."""
    return cell is None or (isinstance(cell, str) and cell.strip().lower() in MISSING)


def is_number(cell: object) -> bool:
    """Whether a cell holds a number, with a point or a comma."""
    if isinstance(cell, str):
        return _NUMBER.fullmatch(cell.strip()) is not None
    return isinstance(cell, int | float | np.number)


@dataclass(frozen=True)
class Table:
    """One table of a file."""

    labels: Mapping[str, str]
    """What tells it from others, for its name: `file`, `index` in the file (from 1), `key`, `group`."""
    names: Sequence[tuple[str, ...]]
    """Of each column from the top: the header lines above it and its own, as ("Cube", "Position", "X"); columns of
    arrays are numbered `0`, `1`, ..., after the array's name where there are several."""
    cells: Callable[[int], Sequence[object] | Floats | Ints]
    """Content of a column by its place."""
    rows: int
    """Of the longest column."""
    place: Callable[[int], str]
    """What a row is called in a message: its line in the file."""
    thousands: str = ""
    """Signs that may part thousands and not decimals: a comma where commas part the cells, both where both occur."""
    remarks: tuple[str, ...] = ()
    """What reading the file left out."""

    def column(self, name: str | int, asked: str) -> Floats:
        """(F,) numbers, NaN where a cell is empty or says that there is none.

        Args:
            name: The column's own name; or some of its header lines with `/` between them; or its number from 0.
            asked: Where it is asked for, for the message.

        Raises:
            DataError: No such column, several of them, or it holds text.
        """
        cells = self.cells(self.index(name, asked))
        if isinstance(cells, np.ndarray):
            return np.asarray(cells, float)
        if (plain := self._plain(cells)) is not None:
            return plain
        return np.array([self._number(cell, row, name, asked) for row, cell in enumerate(cells)])

    def seconds(self, name: str | int, unit_s: float, asked: str) -> Floats:
        """(F,) time since the first one that is known [s], exact for nanoseconds since 1970; NaN where none is."""
        cells = self.cells(self.index(name, asked))
        if isinstance(cells, np.ndarray):
            return np.asarray((cells - cells[np.isfinite(cells)][:1]) * unit_s)
        if self._plain(cells) is not None and all(isinstance(cell, str) for cell in cells):
            exact = [Decimal(str(cell)) for cell in cells]
            return np.array([float(at - exact[0]) for at in exact]) * unit_s
        times = [self._time(cell, row, name, asked) for row, cell in enumerate(cells)]
        known = [at for at in times if at is not None]
        if len({isinstance(at, datetime) for at in known}) > 1:
            raise DataError(f"{asked}: column '{name}' holds dates and numbers")
        return np.array([np.nan if at is None else _since(known[0], at, unit_s) for at in times])

    def parts(self, name: str) -> Sequence[str]:
        """The columns of an array, by its name; of anything else the name itself."""
        whole = {"/".join(parts) for parts in self.names}
        if name in whole or f"{name}.0" not in whole:
            return (name,)
        return [f"{name}.{i}" for i in range(len(whole)) if f"{name}.{i}" in whole]

    def index(self, name: str | int, asked: str) -> int:
        """Place of a column. Raises DataError with the columns that there are."""
        every = ["/".join(parts) for parts in self.names]
        wanted = [_bare(part) for part in str(name).split("/")]
        found = (
            [i for i, whole in enumerate(every) if whole == str(name)]
            or [i for i, parts in enumerate(self.names) if [_bare(part) for part in parts] == wanted]
            or [i for i, parts in enumerate(self.names) if _within(wanted, [_bare(part) for part in parts])]
            or [i for i in range(len(every)) if str(i) == str(name)]
        )
        if len(found) == 1:
            return found[0]
        if found:
            several = ", ".join(f"{every[i]} (number {i})" for i in found[:6])
            raise DataError(
                f"{asked}: '{name}' are {len(found)} columns: {several}; say more of the name, or the number"
            )
        known = [whole for whole in every if whole]
        there = ", ".join(known[:20]) + ", ..." * (len(known) > 20)
        raise DataError(f"{asked}: no column '{name}'; there are {there}{nearest(str(name), known)}")

    def _plain(self, cells: Sequence[object]) -> Floats | None:
        """The cells at once where all are finite numbers as computers write them; most are, and this is fast."""
        try:
            found = np.array([float(cell) for cell in cells])  # type: ignore[arg-type]
        except (TypeError, ValueError):
            return None
        return found if "." not in self.thousands and np.isfinite(found).all() else None

    def _number(self, cell: object, row: int, name: str | int, asked: str) -> float:
        if is_missing(cell):
            return math.nan
        if isinstance(cell, int | float | np.number):
            return float(cell)
        if not isinstance(cell, str) or not is_number(cell):
            where = f"column '{name}' holds something else than numbers in {self.place(row)}"
            raise DataError(f"{asked}: {where}: {shown(cell)}")
        return float(self._pointed(cell, row, name, asked))

    def _pointed(self, cell: str, row: int, name: str | int, asked: str) -> str:
        """Text of a number with a point."""
        text = cell.strip()
        for sign in self.thousands:
            if _GROUPED[sign].fullmatch(text):
                either = f"{text} in {self.place(row)} may be {text.replace(',', '.')} or {text.replace(sign, '')}"
                raise DataError(
                    f"{asked}: column '{name}': {either}; write numbers with a point, and thousands together"
                )
        return text.replace(",", ".")

    def _time(self, cell: object, row: int, name: str | int, asked: str) -> float | Decimal | datetime | None:
        if is_missing(cell):
            return None
        if isinstance(cell, str) and is_number(cell):
            return Decimal(self._pointed(cell, row, name, asked))
        date = _date(cell)
        return date if date is not None else self._number(cell, row, name, asked)


def _date(cell: object) -> datetime | None:
    """A date with its time of day in UTC, where a cell is one: of a spreadsheet, or text of ISO 8601."""
    if isinstance(cell, str):
        try:
            cell = datetime.fromisoformat(cell.strip())
        except ValueError:
            return None
    if not isinstance(cell, datetime):
        return None
    return cell.replace(tzinfo=timezone.utc) if cell.tzinfo is None else cell.astimezone(timezone.utc)


def _since(first: float | Decimal | datetime, at: float | Decimal | datetime, unit_s: float) -> float:
    """Seconds between two times of one kind."""
    if isinstance(first, datetime) and isinstance(at, datetime):
        return (at - first).total_seconds()
    if isinstance(first, float) and isinstance(at, float):
        return (at - first) * unit_s
    return float(Decimal(str(at)) - Decimal(str(first))) * unit_s


def _bare(name: str) -> str:
    """A name without the mark of a comment that a header line may begin with."""
    return name.strip().lstrip("#%").strip()


def _within(wanted: Sequence[str], parts: Sequence[str]) -> bool:
    """Whether all that is wanted is there, in this order."""
    left = iter(parts)
    return all(any(part == one for part in left) for one in wanted)
