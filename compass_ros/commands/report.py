"""`compass report`: the report of an earlier calibration, drawn again."""

from __future__ import annotations

import os
from collections.abc import Mapping
from contextlib import suppress
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
    serve: Annotated[
        int | None,
        typer.Option(min=0, max=65535, help="draw nothing: show the folder on this port of localhost, as it changes"),
    ] = None,
) -> None:
    """Draw report.html again from what a calibration has left."""
    from dataclasses import replace

    from compass_ros.reporting import write_report
    from compass_ros.reporting.kept import read_all
    from compass_ros.results import REPORT

    if serve is not None:
        watch(folder, serve)
        return
    result, extras = read_all(folder)
    if truth is not None:
        extras = replace(extras, truth=read_truth(truth, result))
    path = out or folder / REPORT
    write_report(result, path, extras)
    typer.echo(f"report: {os.path.relpath(path)}")


def watch(folder: Path, port: int) -> None:
    """Serve the folder's report until Ctrl-C. Raises ConfigError: there is no such folder, or the port is taken."""
    from compass_ros.errors import ConfigError
    from compass_ros.reporting.live import LiveReport

    if not folder.is_dir():
        raise ConfigError(f"{folder}: expected the folder of a result, found none")
    with LiveReport(folder, port, computing=False) as live:
        typer.echo(f"watch it at {live.address}; Ctrl-C ends it", err=True)
        with suppress(KeyboardInterrupt):
            live.wait()


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
