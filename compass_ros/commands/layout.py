"""`compass layout`: a Foxglove layout for a cell."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Annotated

import typer


def add_to(app: typer.Typer) -> None:
    app.command()(layout)


def layout(
    bag: Annotated[
        Path | None, typer.Argument(help="a bag of the robot: types of its topics, order of its joints")
    ] = None,
    cell: Annotated[str, typer.Option(help="name of a cell, or path of its YAML")] = "air_hockey",
    out: Annotated[Path, typer.Option(help="layout to write")] = Path("foxglove_layout.json"),
) -> None:
    """Write a Foxglove layout for a cell: inputs, signals, progress, verdict, and the calibrator's services."""
    from compass_ros.cells import load
    from compass_ros.episodes.survey import survey
    from compass_ros.operation.foxglove import layout as made
    from compass_ros.reporting.atomic import write_text

    content = made(load(cell), survey(bag) if bag is not None else ())
    write_text(out, json.dumps(content, indent=1) + "\n")
    typer.echo(f"layout: {os.path.relpath(out)}; in Foxglove: Layouts, Import from file")
