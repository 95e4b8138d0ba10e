"""`compass real`: studies of real recordings that others measured (docs/real-data.md)."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def add_to(app: typer.Typer) -> None:
    app.command()(real)


def real(
    study: Annotated[
        list[str] | None,
        typer.Option(help="cube_tosses, ball_drops, pendulum_single or pendulum_double; else all"),
    ] = None,
    data: Annotated[
        Path | None, typer.Option(help="folder of the data; else COMPASS_REAL_DATA or ../shared/data")
    ] = None,
    search: Annotated[int, typer.Option(min=0, help="cube tosses: search anew with so many evaluations")] = 0,
    out: Annotated[Path, typer.Option(help="folder of the bags and the tables")] = Path("out/real"),
) -> None:
    """Calibrate against cubes, balls and pendulums that others recorded, beside their own fits."""
    from compass_ros.real.studies import chosen

    for name, run in chosen(study or [], search).items():
        text = run(out, data, typer.echo).markdown()
        (out / f"{name}.md").write_text(text, encoding="utf-8")
        typer.echo(text)
