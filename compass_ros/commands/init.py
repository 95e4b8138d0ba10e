"""`compass init`: a first cell from a model and recordings."""

from __future__ import annotations

import time
from collections.abc import Sequence
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
    force: Annotated[bool, typer.Option("--force", help="write over a YAML that is there")] = False,
) -> None:
    """Write a cell for a robot and its recordings: topics, joints, noise, windows and what to tune, with comments."""
    from compass_ros.cells import load
    from compass_ros.errors import ConfigError
    from compass_ros.starter.cell import start

    if out.exists() and not force:
        raise ConfigError(f"{out}: is there already, and may have been edited; another --out, or --force")
    begun = time.monotonic()
    started = start(model, bags, out, links)
    cell = load(out)
    for line in started.said:
        typer.echo(f"note: {line}", err=True)
    typer.echo(
        f"{' and '.join(str(file) for file in started.files)}: {len(cell.spec.inputs)} inputs, {len(cell.signals)} "
        f"signals, {len(cell.parameters)} parameters, in {time.monotonic() - begun:.1f} s"
    )
    typer.echo(f"next: compass check --cell {out} {named(bags)}, then compass calibrate likewise")


def named(bags: Sequence[str]) -> str:
    """Bags as words of a command; all that one folder holds by its name."""
    folders = {Path(bag).resolve().parent for bag in bags}
    own = {Path(bag).resolve() for bag in bags}
    if len(bags) > 1 and len(folders) == 1:
        (folder,) = folders
        if own == {one for one in folder.iterdir() if one.is_dir()}:
            return str(Path(bags[0]).parent)
    return " ".join(bags)
