"""`compass plan`: before any fit, what shots or recordings can show, what not or only together, and better ones."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from compass_ros.cells import Cell
    from compass_ros.planning.driven import Wishes


def add_to(app: typer.Typer) -> None:
    app.command()(plan)


def plan(
    bags: Annotated[
        list[str] | None, typer.Argument(help="recordings of a driven cell: what they show, and what would show more")
    ] = None,
    cell: Annotated[str, typer.Option(help="name of a cell, or path of its YAML")] = "air_hockey",
    shots: Annotated[Path | None, typer.Option(help="YAML with a list `shots` of actions by field")] = None,
    n: Annotated[
        int, typer.Option(min=0, help="shots or motions; 0: 12 shots, or motions as long as the recordings (else 8)")
    ] = 0,
    propose: Annotated[
        bool | None,
        typer.Option(help="look for a better set of the same number (a minute); driven cells: unless it is forbidden"),
    ] = None,
    rate: Annotated[float, typer.Option(min=0.1, help="shots: frames a second of the recording")] = 60.0,
    speed: Annotated[float, typer.Option(min=1e-3, help="motions: largest speed of a joint [rad/s or m/s]")] = 1.0,
    effort: Annotated[
        float, typer.Option(min=0, help="motions: largest force of a joint [N m or N]; 0: what the scene says")
    ] = 0.0,
    tries: Annotated[int, typer.Option(min=1, help="motions that are tried")] = 24,
    seed: Annotated[int, typer.Option(min=0, help="decides all random numbers")] = 0,
    out: Annotated[
        Path, typer.Option(help="folder of plan.json and of shots.yaml and plan.png, or motions.csv and import.yaml")
    ] = Path("out/plan"),
) -> None:
    """Say what planned shots, or recordings of a driven cell, could show of each parameter, and propose better ones."""
    from compass_ros.cells import load
    from compass_ros.errors import ConfigError
    from compass_ros.planning.driven import Wishes
    from compass_ros.results import make_writable

    loaded = load(cell)
    if loaded.spec.inputs:
        if shots is not None:
            raise ConfigError(f"{cell}: --shots: it is driven by recorded inputs and has no shots")
        make_writable(out)
        _motions(loaded, bags or [], Wishes(n, speed, effort or float("inf"), tries, propose is not False, seed), out)
    else:
        if bags:
            raise ConfigError(f"{cell}: {bags[0]}: its shots are planned from --shots, or drawn")
        make_writable(out)
        _shots(loaded, shots, n or 12, rate, seed, bool(propose), out)
    typer.echo(f"written: {out}")


def _shots(cell: Cell, shots: Path | None, n: int, rate: float, seed: int, propose: bool, out: Path) -> None:
    from compass_ros.commands.plan_output import print_plan, write_plan
    from compass_ros.planning.shots import look, read_shots
    from compass_ros.simulation import Simulator

    given = read_shots(shots, cell) if shots else None
    found = look(Simulator(cell), given, n, rate, seed, propose)
    write_plan(found, cell, out)
    print_plan(found)


def _motions(cell: Cell, bags: list[str], wishes: Wishes, out: Path) -> None:
    from compass_ros.commands.motions_output import print_motions, write_motions
    from compass_ros.commands.progress import Bar
    from compass_ros.operation.current import read_usable
    from compass_ros.planning.driven import plan_driven
    from compass_ros.simulation import Simulator

    episodes = read_usable(cell, bags).episodes if bags else ()
    with Bar() as bar:
        found = plan_driven(Simulator(cell), episodes, wishes, bar)
    write_motions(found, cell, out)
    print_motions(found)
