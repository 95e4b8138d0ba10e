"""`compass demo`: the main job on a virtual robot cell."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from compass_ros.commands.progress import Bar

if TYPE_CHECKING:
    from compass_ros.cells import Cell

ANSWERS = Path("~/.local/share/compass_ros/answers")
DEFAULT_EFFECT = "anisotropic_friction"
"""What is concealed where neither a seed nor an effect is asked for."""


def add_to(app: typer.Typer) -> None:
    app.command()(demo)


def demo(
    shots: Annotated[int, typer.Option(min=4, help="shots to play and record")] = 12,
    seed: Annotated[
        int | None,
        typer.Option(
            min=0,
            help=f"draws parameters, effect and shots; without: the paper's parameters and {DEFAULT_EFFECT}",
        ),
    ] = None,
    effect: Annotated[
        str | None, typer.Option(help="the concealed effect by name; none: wrong parameters alone")
    ] = None,
    out: Annotated[Path, typer.Option(help="folder of bags, result and logs; an earlier demonstration there goes")] = (
        Path("out/demo")
    ),
    method: Annotated[str, typer.Option(help="as for `compass calibrate`")] = "default",
    cell: Annotated[str, typer.Option(help="name of the cell, or path of its YAML")] = "air_hockey",
    answers: Annotated[Path, typer.Option(help="folder of the sealed answers, never under --out")] = ANSWERS,
) -> None:
    """Play shots in a cell with hidden parameters and physics, find both from its camera, then open the answer."""
    from rich.console import Console

    from compass_ros.cells import load
    from compass_ros.commands.unseal_table import show
    from compass_ros.demo.processes import NodeGroup
    from compass_ros.demo.session import Plan, calibrate, conceal, play, prepare, reveal
    from compass_ros.reporting import read_result
    from compass_ros.reporting.from_json import from_json
    from compass_ros.reporting.table import parameter_table, print_verdict

    signal.signal(signal.SIGTERM, signal.default_int_handler)  # what ends it ends its nodes first, as Ctrl-C does
    started = time.monotonic()
    drawn = "" if seed is not None else DEFAULT_EFFECT
    plan = Plan(load(cell), shots, seed, drawn if effect is None else effect, method, out, answers)
    prepare(plan)
    answer_file = conceal(plan)
    typer.echo(f"What is wrong with the cell is sealed: SHA-256 {answer_file.stem}... ({out}/seal.json)")
    sealed = time.monotonic()
    with NodeGroup(plan.logs) as nodes:
        typer.echo(f"A virtual robot cell plays {shots} shots; its camera sees them, the tracker follows the pucks.")
        with Bar() as bar:
            messages = play(plan, answer_file, nodes, bar)
        recorded = time.monotonic()
        typer.echo(
            f"{len(messages)} episodes in {plan.bags}, {sum(messages)} messages, "
            f"{recorded - sealed:.0f} s. The calibrator reads them."
        )
        with Bar() as bar:
            calibrate(plan, nodes, bar)
    content = read_result(plan.result / "result.json")
    result, console = from_json(content), Console()
    print_verdict(result, console)
    typer.echo(difference_line(content["gap"]))
    answer = reveal(plan)
    typer.echo("\nNow the answer is opened. Its hash is the one that was sealed before the first shot.")
    console.print(parameter_table(result, worth_showing(content, answer["parameters"], plan.cell)))
    show(content, answer)
    typer.echo(
        f"Sealed in {sealed - started:.0f} s, recorded in {recorded - sealed:.0f} s, "
        f"calibrated in {time.monotonic() - recorded:.0f} s."
    )
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
