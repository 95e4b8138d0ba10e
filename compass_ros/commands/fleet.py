"""`compass fleet`: several robots of one kind, side by side."""

from __future__ import annotations

import json
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
    from compass_ros.operation.fleet import fleet as compare
    from compass_ros.operation.fleet import to_json
    from compass_ros.operation.priors import write_priors
    from compass_ros.operation.several import read_runs
    from compass_ros.operation.sheets import fleet_sheet
    from compass_ros.reporting import read_result
    from compass_ros.reporting.sheet import print_sheet, write_sheet

    units, left_out = read_runs(folders)
    found = compare(units)
    sheet = fleet_sheet(found, left_out)
    if out is not None:
        write_sheet(sheet, out)
    changed: tuple[str, ...] = ()
    if priors is not None:
        known = load(cell or cell_of(units[0].folder, read_result(units[0].folder / "result.json")))
        changed = write_priors(found, known, priors)
    if as_json:
        typer.echo(json.dumps(to_json(found) | {"left_out": left_out}, indent=1))
        return
    print_sheet(sheet)
    if out is not None:
        typer.echo(f"page: {os.path.relpath(out)}")
    if priors is not None:
        typer.echo(f"priors of {len(changed)} parameters: {os.path.relpath(priors)}")
