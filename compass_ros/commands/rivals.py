"""`compass rivals`: what other methods say about the same recordings."""

from __future__ import annotations

import json
import math
import time
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from compass_ros.rivals.run import Opinion


def add_to(app: typer.Typer) -> None:
    app.command()(rivals)


def rivals(
    bags: Annotated[list[str], typer.Argument(help="bags, or folders of bags")],
    cell: Annotated[str, typer.Option(help="name of a cell, or path of its YAML")] = "air_hockey",
    out: Annotated[Path, typer.Option(help="JSON file of what they say")] = Path("out/rivals.json"),
    rival: Annotated[list[str] | None, typer.Option(help="one of them; else all")] = None,
    seed: Annotated[int, typer.Option(min=0, help="decides which episodes are held out, and all random numbers")] = 0,
    rollouts: Annotated[int, typer.Option(min=0, help="most of COMPASS and mujoco.sysid; 0: their own")] = 0,
    held_out: Annotated[float, typer.Option(min=0, max=0.9, help="share of the episodes that is never fitted")] = 0.25,
    threads: Annotated[int, typer.Option(min=0, help="threads for rollouts; 0: all cores")] = 0,
    quiet: Annotated[bool, typer.Option("--quiet", help="print no table")] = False,
) -> None:
    """Let parameters alone, sparse regression, a misspecification test and a Gaussian process judge the recordings."""
    from compass_ros.cells import load
    from compass_ros.config import calibration_config
    from compass_ros.errors import ConfigError, nearest
    from compass_ros.operation.current import read_usable
    from compass_ros.reporting.atomic import write_text
    from compass_ros.rivals.run import RIVALS, Recorded

    names = rival or list(RIVALS)
    for name in names:
        if name not in RIVALS:
            raise ConfigError(f"unknown rival '{name}'; known: {', '.join(RIVALS)}{nearest(name, RIVALS)}")
    known = load(cell)
    config = calibration_config(
        {"seed": seed, "rollouts": rollouts, "held_out_share": held_out, "threads": threads}, "command line"
    )
    reading = read_usable(known, bags)
    given = Recorded(reading.episodes, known, config)
    said: dict[str, tuple[Opinion, float]] = {}
    for name in names:
        began = time.monotonic()
        said[name] = RIVALS[name](given), time.monotonic() - began
    content = {
        "schema": "compass/rivals/1",
        "cell": known.name,
        "episodes": {
            "fit": given.data.names,
            "held_out": given.judge.names,
            "left_out": [asdict(one) for one in reading.left_out],
        },
        "rivals": {name: asdict(opinion) | {"seconds": round(s, 2)} for name, (opinion, s) in said.items()},
    }
    out.parent.mkdir(parents=True, exist_ok=True)
    write_text(out, json.dumps(content, indent=1) + "\n")
    if not quiet:
        _print(said)


def _print(said: dict[str, tuple[Opinion, float]]) -> None:
    from rich.console import Console
    from rich.table import Table

    table = Table("rival", "names", "something is missing", "held out [mm]", "time [s]", "")
    for name, (opinion, seconds) in said.items():
        names = "-" if opinion.names is None else ", ".join(opinion.names) or "nothing"
        alarm = {None: "-", True: "yes", False: "no"}[opinion.alarm]
        p = "" if opinion.p_value is None else f", p = {opinion.p_value:.3f}"
        error = math.nan if opinion.held_out_m is None else 1e3 * opinion.held_out_m
        shown = "-" if math.isnan(error) else f"{error:.2f}"
        table.add_row(name, names, alarm + p, shown, f"{seconds:.0f}", opinion.note)
    Console().print(table)
