"""`compass demo`: the main job on a virtual robot cell."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Mapping
from pathlib import Path
from types import FrameType
from typing import Annotated, Any

import typer

from compass_ros.cells import Cell
from compass_ros.commands.progress import Bar


def add_to(app: typer.Typer) -> None:
    app.command()(demo)


def demo(
    shots: Annotated[int, typer.Option(min=4, help="shots to play and record")] = 12,
    seed: Annotated[
        int | None, typer.Option(min=0, help="draws the hidden parameters and the shots; without: the paper's values")
    ] = None,
    out: Annotated[Path, typer.Option(help="folder of bags, result and logs; an earlier demonstration there goes")] = (
        Path("out/demo")
    ),
    method: Annotated[str, typer.Option(help="as for `compass calibrate`")] = "default",
    cell: Annotated[str, typer.Option(help="name of the cell, or path of its YAML")] = "air_hockey",
) -> None:
    """Play shots in a cell with hidden parameters, follow them by camera, find the parameters, then look them up."""
    from compass_ros.cells import load
    from compass_ros.demo.processes import NodeGroup
    from compass_ros.demo.session import Plan, calibrate, play, prepare
    from compass_ros.reporting import print_result, read_result
    from compass_ros.reporting.from_json import from_json

    signal.signal(signal.SIGTERM, _interrupt)
    started = time.monotonic()
    plan = Plan(load(cell), shots, seed, method, out)
    prepare(plan)
    with NodeGroup(plan.logs) as nodes:
        typer.echo(f"A virtual robot cell plays {shots} shots; its camera sees them, the tracker follows the pucks.")
        with Bar() as bar:
            played = play(plan, nodes, bar)
        recorded = time.monotonic()
        typer.echo(
            f"{len(played.messages)} episodes in {plan.bags}, {sum(played.messages)} messages, "
            f"{recorded - started:.0f} s. The calibrator reads them."
        )
        with Bar() as bar:
            calibrate(plan, nodes, bar)
    content = read_result(plan.result / "result.json")
    print_result(from_json(content), worth_showing(content, played.truth, plan.cell))
    typer.echo(difference_line(content["gap"]))
    typer.echo(f"Recorded in {recorded - started:.0f} s, calibrated in {time.monotonic() - recorded:.0f} s.")
    typer.echo(f"report: {os.path.relpath(plan.result / 'report.html')}")


def worth_showing(content: Mapping[str, Any], truth: Mapping[str, float], cell: Cell) -> dict[str, float]:
    """The true values of what was found and of what the cell hides on purpose, not of all that is near its default."""
    hidden = {parameter.name for parameter in cell.spec.parameters if parameter.target is not None}
    shown = hidden | {row["name"] for row in content["parameters"] if row["active"]}
    return {name: value for name, value in truth.items() if name in shown}


def difference_line(gap: Mapping[str, Any]) -> str:
    """Held-out trajectory difference before and after, from the part `gap` of a result.json."""
    nominal = sum(gap["nominal"]["held_out"]["d"].values())
    best = sum((gap["with_effects"] or gap["calibrated"])["held_out"]["d"].values())
    return (
        f"Held-out trajectory difference: {nominal:.3f} m with the defaults, {best:.3f} m now, "
        f"{best / nominal:.3f} of it."
    )


def _interrupt(number: int, frame: FrameType | None) -> None:
    """What ends the command ends its nodes first, as Ctrl-C does."""
    raise KeyboardInterrupt
