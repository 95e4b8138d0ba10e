"""`compass record --recover`: bags that a crash cut off become whole."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from compass_ros.episodes.recovery import Recovery


def add_to(app: typer.Typer) -> None:
    app.command()(record)


def record(
    recover: Annotated[list[Path] | None, typer.Option(help="a bag, or a folder of bags, to make whole")] = None,
) -> None:
    """Make bags whole that a crash cut off. Recording itself is the node `recorder` (docs/recording.md)."""
    from compass_ros.episodes import recover as make_whole
    from compass_ros.episodes import unfinished

    if not recover:
        raise typer.BadParameter("give --recover BAG; to record, run the node: ros2 run compass_ros recorder")
    for path in recover:
        bags = unfinished(path) if path.is_dir() and unfinished(path) else (path,)
        for bag in bags:
            typer.echo(f"{bag}: {_said(make_whole(bag))}")


def _said(recovery: Recovery) -> str:
    return "was whole" if recovery.was_whole else f"whole again, {recovery.messages} messages kept"
