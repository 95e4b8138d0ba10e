"""`compass plan`: before any recording, what a set of shots could show, what it could not tell apart, a better set."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def add_to(app: typer.Typer) -> None:
    app.command()(plan)


def plan(
    cell: Annotated[str, typer.Option(help="name of a cell, or path of its YAML")] = "air_hockey",
    shots: Annotated[Path | None, typer.Option(help="YAML with a list `shots` of actions by field")] = None,
    n: Annotated[int, typer.Option(min=1, help="shots drawn from the cell's action space, without --shots")] = 12,
    propose: Annotated[bool, typer.Option(help="look for a better set of the same number (a minute)")] = False,
    rate: Annotated[float, typer.Option(min=0.1, help="frames a second of the recording")] = 60.0,
    seed: Annotated[int, typer.Option(min=0, help="decides all random numbers")] = 0,
    out: Annotated[Path, typer.Option(help="folder of plan.json, plan.png and shots.yaml")] = Path("out/plan"),
) -> None:
    """Say what planned shots could show of each parameter and effect, and what they could not tell apart."""
    from compass_ros.cells import load
    from compass_ros.commands.plan_output import print_plan, write_plan
    from compass_ros.planning.shots import look, read_shots
    from compass_ros.results import make_writable
    from compass_ros.simulation import Simulator

    loaded = load(cell)
    given = read_shots(shots, loaded) if shots else None
    make_writable(out)
    found = look(Simulator(loaded), given, n, rate, seed, propose)
    write_plan(found, loaded, out)
    print_plan(found)
    typer.echo(f"written: {out}")
