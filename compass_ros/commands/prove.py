"""`compass prove`: many sealed worlds, each calibrated blindly and then unsealed, as one table."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from collections.abc import Iterable

    from compass_ros.proof.lines import Key, Line


def add_to(app: typer.Typer) -> None:
    app.command()(prove)


def prove(
    worlds: Annotated[int, typer.Option(min=1, help="of each suite")] = 120,
    suite: Annotated[
        list[str] | None,
        typer.Option(help="main, small (0.5 mm), tracker (its noise) or like (the library's formulas)"),
    ] = None,
    cell: Annotated[
        list[str] | None, typer.Option(help="worlds from another engine: of this cell, or of all; instead of a suite")
    ] = None,
    out: Annotated[Path, typer.Option(help="results, one line a world")] = Path("proof/results.jsonl"),
    jobs: Annotated[int, typer.Option(min=1, help="worlds at a time")] = 1,
    threads: Annotated[int, typer.Option(min=1, help="threads of the simulator for each world")] = 1,
    ray: Annotated[
        str, typer.Option(help="on a ray cluster instead of this machine: auto, local, or the address of its head")
    ] = "",
    method: Annotated[str, typer.Option(help="method of the calibration; others stand beside ours")] = "default",
    first_seed: Annotated[int | None, typer.Option(min=0, help="seed of the first world; else the suite's own")] = None,
    table: Annotated[bool, typer.Option("--table", help="only print the table of the results that are there")] = False,
    page: Annotated[Path | None, typer.Option(help="Markdown file whose table is replaced")] = None,
    rivals: Annotated[bool, typer.Option("--rivals", help="the same worlds through other methods instead")] = False,
    rivals_out: Annotated[Path, typer.Option(help="what those say, one line a world")] = Path("proof/rivals.jsonl"),
) -> None:
    """Conceal, calibrate blindly, unseal, count. A run that was stopped goes on where it was."""
    from compass_ros.errors import ConfigError, nearest
    from compass_ros.executors import executor
    from compass_ros.proof import lines
    from compass_ros.proof.campaign import Plan, in_processes
    from compass_ros.proof.campaign import prove as campaign
    from compass_ros.proof.one_world import FOREIGN, SUITES
    from compass_ros.proof.page import groups, write_page

    suites = (*(suite or ()), *_of_cells(cell or ())) or ("main",)
    for name in suites:
        if name not in SUITES:
            raise ConfigError(f"unknown suite '{name}'; known: {', '.join(SUITES)}{nearest(name, SUITES)}")
    by = executor(jobs, ray, threads, computes=False)
    if rivals and not table:
        from compass_ros.proof import rivals as others

        plan = Plan(suites, worlds, others.METHOD, first_seed, others.PARTS)
        campaign(plan, rivals_out, by, _tell_rivals, others.in_processes(threads))
    elif not table:
        campaign(Plan(suites, worlds, method, first_seed), out, by, _tell, in_processes(threads))
    found = list(lines.read(out).values())
    if not found and not rivals:
        raise ConfigError(f"{out}: no results; `compass prove` without --table makes them")
    for (name, calibrator), among in groups(found).items():
        _print(f"{name}, method {calibrator}: {lines.counted(among)}", among)
    foreign = [line for line in found if line["suite"] in FOREIGN]
    if foreign:
        _print(f"worlds from other engines, all scenes: {lines.counted(foreign)}", foreign)
    theirs = list(lines.read(rivals_out).values())
    _print_rivals(theirs, found)
    if page:
        write_page(page, found)
    if page and theirs:
        from compass_ros.proof import rivals_table

        rivals_table.write_page(page, theirs, found)


def _of_cells(cells: Iterable[str]) -> tuple[str, ...]:
    """Suites of other engines by cells."""
    from compass_ros.errors import ConfigError, nearest
    from compass_ros.proof.one_world import FOREIGN, SUITES

    of = {SUITES[name].cell: name for name in FOREIGN}
    out: list[str] = []
    for cell in cells:
        if cell != "all" and cell not in of:
            raise ConfigError(
                f"--cell {cell}: has no worlds from another engine; known: all, {', '.join(of)}{nearest(cell, of)}"
            )
        out += FOREIGN if cell == "all" else [of[cell]]
    return tuple(dict.fromkeys(out))


def _tell(key: Key, line: Line, done: int, total: int) -> None:
    marks = line.get("marks")
    if marks:
        truth = " + ".join(marks["truth"]) or "nothing"
        names = ", ".join(marks["found"])
        said = f"{marks['verdict']}{': ' + names if names else ''}"
        text = f"{'right' if marks['right'] else 'WRONG'}  true: {truth}; said: {said}"
    else:
        text = f"FAILED {line['error']}"
    seconds = (line.get("seconds") or {}).get("calibrate", 0.0)
    typer.echo(f"[{done}/{total}] {key.suite} {key.seed}  {seconds:.0f} s  {text}")


def _tell_rivals(key: Key, line: Line, done: int, total: int) -> None:
    truth = " + ".join(line.get("truth", ())) or "nothing"
    said = [
        f"{n}: {', '.join(r['names']) or 'nothing'}"
        for n, r in line.get("rivals", {}).items()
        if r["names"] is not None
    ]
    said += [f"{n}: p = {r['p_value']:.3f}" for n, r in line.get("rivals", {}).items() if r["p_value"] is not None]
    seconds = (line.get("seconds") or {}).get("rivals", 0.0)
    text = f"FAILED {line['error']}" if line["error"] else "; ".join(said)
    typer.echo(f"[{done}/{total}] {key.suite} {key.seed}  {seconds:.0f} s  true: {truth}; {text}")


def _print_rivals(theirs: list[Line], ours: list[Line]) -> None:
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    from compass_ros.proof.lines import counted
    from compass_ros.proof.rivals_table import HEAD, NAMED, by_suite, rows

    for suite, among in by_suite(theirs).items():
        found = rows(among, ours)
        for first, last in ((1, NAMED), (NAMED, len(HEAD))):  # in two parts: nine columns are too many for a terminal
            shown = Table(title=f"{suite}: {counted(among)} through other methods" if first == 1 else None)
            shown.add_column(HEAD[0], no_wrap=True)
            for head in HEAD[first:last]:
                shown.add_column(escape(head), justify="right", overflow="fold")
            for row in found:
                shown.add_row(row[0], *row[first:last])
            Console().print(shown)


def _print(title: str, among: list[Line]) -> None:
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    from compass_ros.proof.page import rows_of

    shown = Table("", "to reach", "reached", "95 % interval", "of", "", title=title)
    for row in rows_of(among):
        verdict = {True: "yes", False: "no", None: ""}[row.reached]
        shown.add_row(escape(row.what), row.bar, row.value, row.interval, row.count, verdict)
    Console().print(shown)
