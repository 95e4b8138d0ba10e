"""`compass real`: the league of recordings that others measured (docs/real-data.md)."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from compass_ros.real.league import Line


def add_to(app: typer.Typer) -> None:
    app.command()(real)


def real(
    entry: Annotated[list[str] | None, typer.Option(help="name or kind of an entry of config/league.yaml")] = None,
    data: Annotated[
        Path | None, typer.Option(help="folder of the data; else COMPASS_REAL_DATA or ../shared/data")
    ] = None,
    out: Annotated[Path, typer.Option(help="folder of the bags and the results")] = Path("out/real"),
    lines: Annotated[Path, typer.Option(help="what came out, one line an entry")] = Path("proof/league.jsonl"),
    threads: Annotated[int, typer.Option(min=0, help="threads of the simulator; 0: all cores")] = 0,
    table: Annotated[bool, typer.Option("--table", help="only print the table of what is there")] = False,
    page: Annotated[Path | None, typer.Option(help="Markdown file whose table is replaced")] = None,
) -> None:
    """Judge recordings of others by `compass calibrate`, against answers written down before.

    A run that was stopped goes on where it was.
    """
    from compass_ros.real.answers import read_answers
    from compass_ros.real.league import chosen, read_lines, run
    from compass_ros.real.page import markdown, write_page

    entries, answers = read_answers()
    among = chosen(entries, entry or [])
    typer.echo(f"answers: sha256 {answers}")
    if not table:
        run(among, answers, lines, out, data, threads, _tell)
    known = read_lines(lines).values()
    typer.echo(markdown(known))
    if page:
        write_page(page, known)


def _tell(line: Line) -> None:
    said = line["error"] or line["sentence"]
    typer.echo(f"{line['name']}  {line['seconds']:.0f} s  {line['mark']}: {said}")
