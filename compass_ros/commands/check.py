"""`compass check`: are these recordings good enough? Before any fit; nothing is written."""

from __future__ import annotations

import json
from typing import Annotated

import typer


def add_to(app: typer.Typer) -> None:
    app.command()(check)


def check(
    bags: Annotated[list[str], typer.Argument(help="bags, or folders of bags")],
    cell: Annotated[str, typer.Option(help="name of a cell, or path of its YAML")] = "air_hockey",
    as_json: Annotated[bool, typer.Option("--json", help="one JSON object instead of the table")] = False,
) -> None:
    """Say what is wrong with recordings, and how well each signal was measured. Status 1 where they cannot be used."""
    from compass_ros.cells import load
    from compass_ros.checks.check import check as check_all
    from compass_ros.checks.figures import figures
    from compass_ros.commands.check_output import as_dict, print_checked
    from compass_ros.operation.current import read_usable

    known = load(cell)
    reading = read_usable(known, bags)
    checked = check_all(known, reading.episodes)
    rows, left_out = figures(known, checked), (*reading.left_out, *checked.left_out)
    if as_json:
        typer.echo(json.dumps(as_dict(checked, rows, left_out), allow_nan=False))
    else:
        print_checked(checked, rows, left_out)
    raise typer.Exit(1 if checked.bad else 0)
