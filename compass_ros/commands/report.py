"""`compass report`: the report of an earlier calibration, drawn again."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from compass_ros.types import Result


def add_to(app: typer.Typer) -> None:
    app.command()(report)


def report(
    folder: Annotated[Path, typer.Argument(help="folder of a result")],
    out: Annotated[Path | None, typer.Option(help="file to write; else report.html in the folder")] = None,
    truth: Annotated[Path | None, typer.Option(help="YAML of true values by parameter, to show beside")] = None,
) -> None:
    """Draw report.html again from what a calibration has left."""
    from dataclasses import replace

    from compass_ros.reporting import write_report
    from compass_ros.reporting.kept import read_all
    from compass_ros.results import REPORT

    result, extras = read_all(folder)
    if truth is not None:
        extras = replace(extras, truth=read_truth(truth, result))
    path = out or folder / REPORT
    write_report(result, path, extras)
    typer.echo(f"report: {os.path.relpath(path)}")


def read_truth(path: Path, result: Result) -> Mapping[str, float]:
    """True values of parameters of this result. Raises ConfigError naming what is no number, or no parameter."""
    from compass_ros.config import read_yaml
    from compass_ros.errors import ConfigError, nearest

    known = {row.name for row in result.parameters}
    truth = {}
    for name, value in read_yaml(path).items():
        if name not in known:
            raise ConfigError(f"{path}: unknown parameter '{name}'{nearest(name, known)}")
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise ConfigError(f"{path}: {name}: expected a number, found {type(value).__name__}")
        truth[name] = float(value)
    return truth
