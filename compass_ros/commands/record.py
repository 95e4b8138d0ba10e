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
    """Mend bags. Recording itself is the node `recorder` (docs/recording.md).

    A bag that cannot be mended is said, and does not keep the others from it; the status is then 1.
    """
    from compass_ros.episodes import find_bags, unfinished
    from compass_ros.episodes import recover as make_whole
    from compass_ros.episodes import reindex as index
    from compass_ros.errors import BagError

    if not recover and not reindex:
        raise typer.BadParameter("give --recover BAG or --reindex BAG; to record: ros2 run compass_ros recorder")
    cut = [bag for path in recover or () for bag in (unfinished(path) if path.is_dir() else ()) or (path,)]
    whole = find_bags(reindex) if reindex else ()
    failed = []
    for bag, mend, before, after in (
        *((bag, make_whole, "was whole", "whole again, {} messages kept") for bag in cut),
        *((bag, index, "has its index", "indexed, {} messages") for bag in whole),
    ):
        try:
            found = mend(bag)
            typer.echo(f"{bag}: {before if found.was_whole else after.format(found.messages)}")
        except BagError as error:
            failed.append(str(error))
    if failed:
        raise BagError("; ".join(failed))
