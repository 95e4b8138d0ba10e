"""`compass bench`: calibration methods side by side on simulated real cells."""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from compass_ros.commands.calibrate import Parameters
from compass_ros.commands.progress import Bar

if TYPE_CHECKING:
    from compass_ros.bench.case import Case

ALL = "all"
BEGIN, END = "<!-- bench: begin -->\n", "<!-- bench: end -->"
METHODS_HELP = (
    "default (causal-map, ours), compass, npdr, exi-net, tune-net, mujoco-sysid, cma-es, random, or all; "
    "can be given several times"
)


class Start(str, Enum):
    """First guess of the parameters."""

    default = "default"
    random = "random"


def add_to(app: typer.Typer) -> None:
    app.command()(bench)


def bench(
    task: Annotated[list[str] | None, typer.Option(help="cell whose YAML has targets [air_hockey]; several")] = None,
    method: Annotated[list[str] | None, typer.Option(help=METHODS_HELP)] = None,
    seeds: Annotated[int, typer.Option(min=1, help="seeds 0 to this, less one")] = 5,
    iterations: Annotated[int, typer.Option(min=1, help="iterations of a method")] = 10,
    real: Annotated[int, typer.Option(min=1, help="N: recorded shots")] = 10,
    sim: Annotated[int, typer.Option(min=2, help="M: simulated rollouts for each of them in an iteration")] = 64,
    noise: Annotated[
        list[float] | None, typer.Option(min=0, help="standard deviation of the tracker [m]; several")
    ] = None,
    missing: Annotated[float, typer.Option(min=0, max=0.9, help="share of the frames without an object")] = 0.0,
    start: Annotated[Start, typer.Option(help="first guess")] = Start.default,
    parameters: Annotated[
        Parameters, typer.Option(help="what is tuned: the cell's own list, or every tunable field of its scene too")
    ] = Parameters.cell,
    ablations: Annotated[
        bool, typer.Option("--ablations", help="instead: N, M, lambda and first guesses varied one at a time")
    ] = False,
    out: Annotated[Path, typer.Option(help="folder of results.jsonl and figures")] = Path("out/bench"),
    threads: Annotated[int, typer.Option(min=0, help="threads of the simulator; 0: all cores")] = 0,
    jobs: Annotated[int, typer.Option(min=1, help="cases at a time, each in a process of its own")] = 1,
    ray: Annotated[
        str, typer.Option(help="on a ray cluster instead of this machine: auto, local, or the address of its head")
    ] = "",
    table: Annotated[bool, typer.Option("--table", help="only print the tables of what is there")] = False,
    figures: Annotated[bool, typer.Option("--figures", help="only draw the figures of what is there")] = False,
    page: Annotated[Path | None, typer.Option(help="Markdown file whose tables are replaced")] = None,
) -> None:
    """Run what is not there yet, one line of results.jsonl a case; a run that was stopped goes on where it was."""
    from compass_ros.bench.case import Case
    from compass_ros.bench.run import run_bench
    from compass_ros.executors import executor

    varied = start is not Start.default or parameters is not Parameters.cell or (real, sim) != (10, 64)
    if ablations and (noise or missing or varied):
        raise typer.BadParameter(
            "it varies N, M and the first guess itself, of the cell's own parameters", param_hint="--ablations"
        )
    if not table and not figures:
        base = Case("", "", 0, iterations, real, sim, 0.0, missing, start.value, parameters=parameters.value)
        cases = chosen(task or ["air_hockey"], method or ["default"], seeds, noise or [0.0], base, ablations)
        with Bar() as bar:
            many = executor(jobs, ray, max(threads, 1), computes=True) if ray or jobs > 1 else None
            ran = run_bench(cases, out, bar, threads, many)
        typer.echo(f"{ran} cases run, {len(cases) - ran} were there already: {out}")
    _show(out, table or not figures, figures, page)


def chosen(
    tasks: Sequence[str], methods: Sequence[str], seeds: int, noises: Sequence[float], base: Case, ablations: bool
) -> tuple[Case, ...]:
    """The cases of a command line. Raises ConfigError for an unknown task or method."""
    from compass_ros.bench import case
    from compass_ros.calibration.methods import METHODS
    from compass_ros.calibration.methods import method as find
    from compass_ros.cells import load

    for task in tasks:
        load(task, base.parameters)
    names = [name for given in methods for name in (METHODS if given == ALL else (find(given).name,))]
    unique = tuple(dict.fromkeys(names))
    if ablations:
        return tuple(c for task in tasks for c in case.ablations(task, unique, range(seeds), base.iterations))
    return case.grid(tasks, unique, range(seeds), noises, base)


def _show(out: Path, table: bool, figures: bool, page: Path | None) -> None:
    from compass_ros.bench.outcome import read
    from compass_ros.bench.run import RESULTS
    from compass_ros.errors import DataError

    rows = read(out / RESULTS)
    if not rows:
        raise DataError(f"{out / RESULTS}: no results; run `compass bench --out {out}` first")
    if table:
        from compass_ros.bench.table import tables

        text = tables(rows)
        typer.echo(text)
        if page:
            from compass_ros.reporting.markdown import replace_between

            replace_between(page, BEGIN, END, f"\n{text}\n\n")
    if figures:
        from compass_ros.bench.figures import write_figures

        for path in write_figures(rows, out):
            typer.echo(f"figure: {path}")
