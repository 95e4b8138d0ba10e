"""`compass calibrate`: bags and a cell in; result.json, report.html, calibrated scene and effects out."""

from __future__ import annotations

import json
import math
import os
import shlex
import signal
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import replace
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from compass_ros.commands.progress import Bar
from compass_ros.types import Progress, Result

if TYPE_CHECKING:
    from compass_ros.discovery import Discovery
    from compass_ros.reporting.live import LiveReport


class ProgressStyle(str, Enum):
    """How progress is shown."""

    bar = "bar"
    json = "json"
    none = "none"


class Parameters(str, Enum):
    """What is tuned."""

    cell = "cell"
    auto = "auto"


def add_to(app: typer.Typer) -> None:
    app.command()(calibrate)


def calibrate(
    bags: Annotated[list[str], typer.Argument(help="bags, or folders of bags")],
    cell: Annotated[str, typer.Option(help="name of a cell, or path of its YAML")] = "air_hockey",
    out: Annotated[Path, typer.Option(help="folder of the result")] = Path("out/calibration"),
    method: Annotated[str, typer.Option(help="default, compass, or a rival; see `compass bench --help`")] = "default",
    parameters: Annotated[
        Parameters, typer.Option(help="what is tuned: the cell's own list, or every tunable field of its scene too")
    ] = Parameters.cell,
    seed: Annotated[int, typer.Option(min=0, help="decides which episodes are held out, and all random numbers")] = 0,
    rollouts: Annotated[
        int,
        typer.Option(
            min=0, help="most simulated rollouts of a method with a budget of them (`default` has none); 0: its own"
        ),
    ] = 0,
    held_out: Annotated[float, typer.Option(min=0, max=0.9, help="share of the episodes that is never fitted")] = 0.25,
    episodes: Annotated[int, typer.Option(min=1, help="most episodes to use; of more, an even choice")] = 100,
    config: Annotated[Path | None, typer.Option(help="YAML with any of the settings of docs/cli.md")] = None,
    discover: Annotated[bool, typer.Option(help="look for missing physics after the calibration")] = True,
    false_alarm: Annotated[
        float, typer.Option(help="probability of naming something, or `unknown`, where nothing is missing")
    ] = 0.01,
    progress: Annotated[ProgressStyle, typer.Option(help="how to show progress")] = ProgressStyle.bar,
    serve: Annotated[
        int | None,
        typer.Option(min=0, max=65535, help="show progress and report on this port of localhost; 0: any free one"),
    ] = None,
    repeat: Annotated[str, typer.Option(hidden=True, help="the command that the report gives; empty: this one")] = "",
) -> None:
    """Find which simulator parameters are wrong, what they should be, and what physics is missing."""
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # a scheduler's end says what is there, as Ctrl-C does
    given = settings(method, seed, rollouts, held_out, episodes, discover, config, parameters, false_alarm)
    run(bags, cell, out, given, progress, repeat or shlex.join(["compass", *sys.argv[1:]]), serve)


def settings(
    method: str,
    seed: int,
    rollouts: int,
    held_out: float,
    episodes: int,
    discover: bool,
    config: Path | None,
    parameters: Parameters,
    false_alarm: float,
) -> Mapping[str, object]:
    """The configuration file's fields over the command line's."""
    from compass_ros.config import calibration_config, read_yaml

    given: dict[str, object] = {
        "method": method,
        "parameters": parameters.value,
        "seed": seed,
        "rollouts": rollouts,
        "held_out_share": held_out,
        "episodes": episodes,
        "discover": discover,
        "false_alarm": false_alarm,
    }
    in_file = dict(read_yaml(config)) if config else {}
    calibration_config(in_file, str(config))  # what is wrong in a file is said with its name
    return given | in_file


def run(
    bags: list[str],
    cell_name: str,
    out: Path,
    config: Mapping[str, object],
    style: ProgressStyle,
    repeat: str,
    serve: int | None = None,
) -> None:
    """Calibrate, write everything into `out`, print the tables.

    `repeat` is the command line that the report gives; `serve` the port on which a browser can watch.
    """
    from compass_ros.cells import load
    from compass_ros.config import calibration_config
    from compass_ros.operation.current import read_usable
    from compass_ros.pipeline import calibrate as pipeline
    from compass_ros.progress import Steady
    from compass_ros.reporting import print_result
    from compass_ros.reporting.words import left_out_lines
    from compass_ros.results import make_writable, write_all

    started = time.monotonic()
    validated = calibration_config(config, "command line")
    cell = load(cell_name, validated.parameters)
    reading = read_usable(cell, bags)
    make_writable(out)  # now, and not after minutes of work

    written = False

    def write(result: Result, found: Discovery) -> Result:
        nonlocal written
        budget = replace(result.budget, wall_seconds=time.monotonic() - started)
        result = replace(result, budget=budget, left_out=(*reading.left_out, *result.left_out))
        write_all(result, found, cell, out, repeat)
        written = True
        return result

    try:
        with _shown(style) as report, _live(out, serve) as live:
            steady = Steady(live.beside(report) if live else report)

            def keep(result: Result, found: Discovery) -> Result:
                kept = write(result, found)
                report.say(f"parameters are in {out}; the search for missing physics can take longer than they did")
                return kept

            result = write(*pipeline(reading.episodes, cell, validated, steady, keep))
            steady.end("written")
            if live:
                live.end()
    except KeyboardInterrupt:
        there = f"the parameters are in {out}, missing physics was not looked for to the end"
        nothing = "nothing was written: the parameters are, as soon as they are fitted"
        typer.echo(f"stopped; {there if written else nothing}", err=True)
        raise typer.Exit(130) from None
    if style is not ProgressStyle.json:
        print_result(result)
        for line in left_out_lines(result.left_out):
            typer.echo(f"note: {line}", err=True)
        print(f"report: {os.path.relpath(out / 'report.html')}")


def _shown(style: ProgressStyle) -> AbstractContextManager[Bar | _JsonLines | _Quiet]:
    if style is ProgressStyle.bar:
        return Bar(log=True)
    return nullcontext(_JsonLines() if style is ProgressStyle.json else _Quiet())


@contextmanager
def _live(out: Path, port: int | None) -> Iterator[LiveReport | None]:
    from compass_ros.reporting.live import LiveReport

    if port is None:
        yield None
        return
    with LiveReport(out, port, computing=True) as live:
        typer.echo(f"watch it at {live.address}", err=True)
        yield live


class _Quiet:
    """Nothing, for a test or a script."""

    def say(self, line: str) -> None:
        pass

    def __call__(self, progress: Progress) -> bool:
        return True


class _JsonLines:
    """One JSON object a line on standard output, for programs that watch."""

    def say(self, line: str) -> None:
        pass

    def __call__(self, progress: Progress) -> bool:
        def number(value: float) -> float | None:
            return value if math.isfinite(value) else None

        line = {
            "stage": progress.stage,
            "iteration": progress.iteration,
            "done": progress.done,
            "gap": number(progress.gap),
            "sparsity": number(progress.sparsity),
        }
        print(json.dumps(line), flush=True)
        return True
