"""`compass fleet`: several robots of one kind, side by side."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer


def add_to(app: typer.Typer) -> None:
    app.command()(fleet)


def fleet(
    folders: Annotated[list[Path], typer.Argument(help="folders of results, one a unit, or folders of such folders")],
    out: Annotated[Path | None, typer.Option(help="HTML page to write")] = None,
    priors: Annotated[
        Path | None, typer.Option(help="YAML to write: the cell with the fleet's values as priors")
    ] = None,
    cell: Annotated[str, typer.Option(help="for the priors: the cell, where the first result's own is not there")] = "",
    as_json: Annotated[bool, typer.Option("--json", help="print JSON instead of tables")] = False,
) -> None:
    """Say what units of one robot share, which one differs in what, and what to expect of the next unit."""
    from compass_ros.cells import load
    from compass_ros.commands.evaluate import cell_of
    from compass_ros.commands.sheet_output import show
    from compass_ros.operation.fleet import fleet as compare
    from compass_ros.operation.fleet import to_json
    from compass_ros.operation.priors import write_priors
    from compass_ros.operation.several import read_runs
    from compass_ros.operation.sheets import fleet_sheet
    from compass_ros.reporting import read_result

    units, left_out = read_runs(folders)
    found = compare(units)
    show(fleet_sheet(found, left_out), to_json(found), left_out, out, as_json)
    if priors is not None:
        known = load(cell or cell_of(units[0].folder, read_result(units[0].folder / "result.json")))
        changed = write_priors(found, known, priors)
        if not as_json:
            typer.echo(f"priors of {len(changed)} parameters: {os.path.relpath(priors)}")
