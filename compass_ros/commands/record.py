"""`compass record`: bags that a crash cut off become whole; bags without an index get one."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def add_to(app: typer.Typer) -> None:
    app.command()(record)


def record(
    recover: Annotated[list[Path] | None, typer.Option(help="a bag, or a folder of bags, to make whole")] = None,
    reindex: Annotated[
        list[Path] | None, typer.Option(help="a whole bag, or a folder of bags, of version 0.1: add chunks and index")
    ] = None,
) -> None:
    """Mend bags. Recording itself is the node `recorder` (docs/recording.md)."""
    from compass_ros.episodes import find_bags, unfinished
    from compass_ros.episodes import recover as make_whole
    from compass_ros.episodes import reindex as index

    if not recover and not reindex:
        raise typer.BadParameter("give --recover BAG or --reindex BAG; to record: ros2 run compass_ros recorder")
    for path in recover or ():
        for bag in (unfinished(path) if path.is_dir() else ()) or (path,):
            found = make_whole(bag)
            typer.echo(f"{bag}: {'was whole' if found.was_whole else f'whole again, {found.messages} messages kept'}")
    for bag in find_bags(reindex or ()) if reindex else ():
        found = index(bag)
        typer.echo(f"{bag}: {'has its index' if found.was_whole else f'indexed, {found.messages} messages'}")
