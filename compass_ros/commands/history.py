"""`compass history`: how one cell changes from week to week."""

from __future__ import annotations

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
    from compass_ros.commands.sheet_output import show
    from compass_ros.operation.history import history as compare
    from compass_ros.operation.history import to_json
    from compass_ros.operation.several import read_runs
    from compass_ros.operation.sheets import history_sheet

    runs, left_out = read_runs(folders)
    found = compare(runs)
    show(history_sheet(found, left_out), to_json(found), left_out, out, as_json)
