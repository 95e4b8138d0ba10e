"""`compass history`: how one cell changes from week to week."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Annotated

import typer


def add_to(app: typer.Typer) -> None:
    app.command()(history)


def history(
    folders: Annotated[list[Path], typer.Argument(help="folders of results, oldest first, or folders of such folders")],
    out: Annotated[Path | None, typer.Option(help="HTML page to write")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="print JSON instead of tables")] = False,
) -> None:
    """Show how parameters, gaps and explanations of one cell move from week to week, and what moved when."""
    from compass_ros.operation.history import history as compare
    from compass_ros.operation.history import to_json
    from compass_ros.operation.several import read_runs
    from compass_ros.operation.sheets import history_sheet
    from compass_ros.reporting.sheet import print_sheet, write_sheet

    runs, left_out = read_runs(folders)
    found = compare(runs)
    sheet = history_sheet(found, left_out)
    if out is not None:
        write_sheet(sheet, out)
    if as_json:
        typer.echo(json.dumps(to_json(found) | {"left_out": left_out}, indent=1))
        return
    print_sheet(sheet)
    if out is not None:
        typer.echo(f"page: {os.path.relpath(out)}")
