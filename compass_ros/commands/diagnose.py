"""`compass diagnose`: what an earlier calibration found, explained again in words and figures."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer


def add_to(app: typer.Typer) -> None:
    app.command()(diagnose)


def diagnose(
    folder: Annotated[Path, typer.Argument(help="folder of a result")],
    figures: Annotated[
        Path | None, typer.Option(help="folder of the PNG figures; else `figures` in the folder")
    ] = None,
    truth: Annotated[Path | None, typer.Option(help="YAML of true values by parameter, to show beside")] = None,
) -> None:
    """Explain a result: what is left, where and when, which physics, and whether to believe it."""
    from dataclasses import replace

    from compass_ros.commands.report import read_truth
    from compass_ros.reporting.diagnosis import print_diagnosis
    from compass_ros.reporting.kept import read_all
    from compass_ros.results import make_writable

    result, extras = read_all(folder)
    if truth is not None:
        extras = replace(extras, truth=read_truth(truth, result))
    print_diagnosis(result, extras)
    from compass_ros.reporting.gallery import write_figures  # what it needs is an extra, and the words need none

    out = figures or folder / "figures"
    make_writable(out)
    for path in write_figures(result, extras, out):
        typer.echo(f"figure: {os.path.relpath(path)}")
