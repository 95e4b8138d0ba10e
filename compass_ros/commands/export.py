"""`compass export`: a result as plain MJCF, as URDF and as parameters of a controller."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer


def add_to(app: typer.Typer) -> None:
    app.command()(export)


def export(
    folder: Annotated[Path, typer.Argument(help="folder of a result")],
    cell: Annotated[str, typer.Option(help="name of its cell, or path of its YAML; else what the result says")] = "",
    urdf: Annotated[Path | None, typer.Option(help="URDF that the cell's scene was made from")] = None,
) -> None:
    """Write what was found for other simulators: plain MJCF with laws, URDF, gains; and say what each cannot say."""
    from compass_ros.cells import load
    from compass_ros.commands.evaluate import cell_of
    from compass_ros.reporting import read_result
    from compass_ros.targets.export import export as write

    known = load(cell or cell_of(folder, read_result(folder / "result.json")))
    for path, said in write(folder, known, urdf).items():
        typer.echo(os.path.relpath(path))
        for one in said:
            typer.echo(f"  {one.line()}")
