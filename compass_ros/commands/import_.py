"""`compass import`: tables of measurements become bags."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def add_to(app: typer.Typer) -> None:
    app.command("import")(import_)


def import_(
    tables: Annotated[Path, typer.Argument(help="YAML that describes the tables (docs/foreign-bags.md)")],
    out: Annotated[Path, typer.Option(help="folder of the bags")] = Path("out/imported"),
    data: Annotated[
        Path | None, typer.Option(help="folder of the data; else COMPASS_REAL_DATA or ../shared/data")
    ] = None,
) -> None:
    """Turn CSV, NPZ, MAT or XLSX tables into bags, one an episode."""
    from compass_ros.episodes.tables import import_tables

    imported = import_tables(tables, out, data)
    for line in imported.said:
        typer.echo(f"note: {line}", err=True)
    typer.echo(f"{len(imported.bags)} bags in {out}")
