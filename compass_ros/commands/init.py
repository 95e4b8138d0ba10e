"""`compass init`: a first cell from a model and recordings."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated

import typer


def add_to(app: typer.Typer) -> None:
    app.command()(init)


def init(
    model: Annotated[Path, typer.Argument(help="MJCF or URDF of the robot")],
    bags: Annotated[list[str], typer.Argument(help="bags, or folders of bags")],
    out: Annotated[Path, typer.Option(help="YAML of the cell")] = Path("cell.yaml"),
    links: Annotated[bool, typer.Option("--links", help="also tune mass, centre and inertia of each link")] = False,
) -> None:
    """Write a cell for a robot and its recordings: topics, joints, noise, windows and what to tune, with comments."""
    from compass_ros.cells import load
    from compass_ros.starter.cell import start

    begun = time.monotonic()
    started = start(model, bags, out, links)
    cell = load(out)
    for line in started.said:
        typer.echo(f"note: {line}", err=True)
    typer.echo(
        f"{' and '.join(str(file) for file in started.files)}: {len(cell.spec.inputs)} inputs, {len(cell.signals)} "
        f"signals, {len(cell.parameters)} parameters, in {time.monotonic() - begun:.1f} s"
    )
    typer.echo(f"next: compass calibrate --cell {out} {' '.join(bags)}")
