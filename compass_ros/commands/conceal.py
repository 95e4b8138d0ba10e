"""`compass conceal`: a table with wrong parameters and perhaps with missing physics, as bags with a sealed answer."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

if TYPE_CHECKING:
    from compass_ros.concealed.world import Wishes

ANSWERS = Path("~/.local/share/compass_ros/answers")


def add_to(app: typer.Typer) -> None:
    app.command()(conceal)


def conceal(
    seed: Annotated[int, typer.Option(min=0, help="decides the world; the same seed gives the same bits")],
    out: Annotated[Path, typer.Option(help="folder of the bags and of the seal")],
    cell: Annotated[str, typer.Option(help="name of a cell, or path of its YAML")] = "air_hockey",
    answers: Annotated[Path, typer.Option(help="folder of the answers, never under --out")] = ANSWERS,
    noise: Annotated[str, typer.Option(help="white, tracker (correlated, jittered, with outliers) or none")] = "white",
    rms: Annotated[
        float | None, typer.Option(min=1e-6, help="what is left of an effect after the best parameters [m]")
    ] = None,
    forms: Annotated[
        Literal["other", "like"], typer.Option(help="other: formulas unlike the library's; like: as there")
    ] = "other",
    kind: Annotated[
        Literal["none", "one", "two", "outside"] | None, typer.Option(help="how much is missing; else drawn")
    ] = None,
    effect: Annotated[list[str] | None, typer.Option(help="the missing physics by name, once or twice")] = None,
) -> None:
    """Play twelve shots on a concealed table; write the bags, and seal what is wrong with it."""
    from compass_ros.concealed.world import Wishes

    wishes = Wishes(seed, noise, rms, forms, kind, tuple(effect or ()))
    path = write(cell, wishes, out, answers)
    typer.echo(f"{out}: twelve shots and the seal; the answer is in {path.parent}")


def write(cell_name: str, wishes: Wishes, out: Path, answers: Path) -> Path:
    """Conceal into an empty folder; return the path of the answer. Raises ConfigError where the folder is taken."""
    from compass_ros.cells import load
    from compass_ros.concealed.seal import apart, seal
    from compass_ros.concealed.world import conceal as make
    from compass_ros.episodes import write_episode
    from compass_ros.errors import ConfigError

    apart(answers, out)
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise ConfigError(f"--out {out}: is not empty; a world needs a folder of its own")
    world = make(load(cell_name), wishes)
    bags = {episode.name: write_episode(episode, out) for episode in world.episodes}
    return seal(world.answer, out, bags, answers)
