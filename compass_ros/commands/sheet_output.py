"""Several results side by side, as a page and in the terminal."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path

import typer

from compass_ros.reporting.sheet import Sheet, print_sheet, write_sheet


def show(sheet: Sheet, content: Mapping[str, object], left_out: Sequence[str], out: Path | None, as_json: bool) -> None:
    """Write the page, if one is asked for, and print the tables; or `content` as JSON in their place."""
    if out is not None:
        write_sheet(sheet, out)
    if as_json:
        typer.echo(json.dumps({**content, "left_out": left_out}, indent=1))
        return
    print_sheet(sheet)
    if out is not None:
        typer.echo(f"page: {os.path.relpath(out)}")
