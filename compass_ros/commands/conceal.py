"""`compass conceal`: a cell with wrong parameters and perhaps with missing physics, as bags with a sealed answer."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

if TYPE_CHECKING:
    from collections.abc import Mapping

    from compass_ros.cells import Cell
    from compass_ros.concealed.world import Wishes
    from compass_ros.types import Episode, Floats
    from compass_ros.worlds.world import Asked

ANSWERS = Path("~/.local/share/compass_ros/answers")


def add_to(app: typer.Typer) -> None:
    app.command()(conceal)


def conceal(
    seed: Annotated[int, typer.Option(min=0, help="decides the world; the same seed gives the same bits")],
    out: Annotated[Path, typer.Option(help="folder of the bags and of the seal")],
    cell: Annotated[str, typer.Option(help="name of a cell, or path of its YAML")] = "air_hockey",
    answers: Annotated[Path, typer.Option(help="folder of the answers, never under --out")] = ANSWERS,
    noise: Annotated[
        str, typer.Option(help="air hockey: white, tracker (correlated, jittered, with outliers) or none")
    ] = "white",
    rms: Annotated[
        float | None, typer.Option(min=1e-6, help="air hockey: what is left of an effect after the best parameters [m]")
    ] = None,
    forms: Annotated[
        Literal["other", "like", "foreign"],
        typer.Option(help="air hockey: formulas unlike the library's, like them, or a table of another engine"),
    ] = "other",
    kind: Annotated[
        Literal["none", "one", "two", "outside"] | None, typer.Option(help="how much is missing; else drawn")
    ] = None,
    effect: Annotated[list[str] | None, typer.Option(help="the missing physics by name, once or twice")] = None,
    commands: Annotated[
        Path | None,
        typer.Option(help="worlds of other engines: the same world told this, next_shot.yaml or next_motion.csv"),
    ] = None,
) -> None:
    """Make recordings of a concealed cell; write the bags, and seal what is wrong with it."""
    from compass_ros.cells import load
    from compass_ros.concealed.world import Wishes
    from compass_ros.errors import ConfigError
    from compass_ros.worlds.scenes import TABLES
    from compass_ros.worlds.world import Asked

    names, loaded = tuple(effect or ()), load(cell)
    foreign = Asked(seed, kind, names, _read(commands, loaded) if commands else None)
    if forms == "foreign" and loaded.name in TABLES:
        if (noise, rms) != ("white", None):
            raise ConfigError(f"{cell}: --noise and --rms are not of --forms foreign")
        path = write_world(cell, foreign, out, answers)
    elif loaded.spec.dynamics != "air_hockey" or forms == "foreign":
        if (noise, rms, forms) != ("white", None, "other"):
            raise ConfigError(f"{cell}: --noise, --rms and --forms are of the cell air_hockey alone")
        path = write_world(cell, foreign, out, answers)
    elif commands is not None:
        raise ConfigError(f"{cell}: --commands are of --forms foreign")
    else:
        path = write(cell, Wishes(seed, noise, rms, forms, kind, names), out, answers)
    typer.echo(f"{out}: recordings and the seal; the answer is in {path.parent}")


def _read(file: Path, cell: Cell) -> Floats:
    from compass_ros.errors import ConfigError
    from compass_ros.planning.motion_table import read_commands
    from compass_ros.planning.shots import read_shots
    from compass_ros.worlds.scenes import COMMANDED

    if cell.name not in COMMANDED:
        raise ConfigError(
            f"{cell.name}: --commands: its worlds are told nothing; those that are: {', '.join(COMMANDED)}"
        )
    return read_commands(file, cell) if cell.spec.inputs else read_shots(file, cell)


def write(cell_name: str, wishes: Wishes, out: Path, answers: Path) -> Path:
    """Conceal a table into an empty folder; return the path of the answer. Raises ConfigError where it is taken."""
    from compass_ros.cells import load
    from compass_ros.concealed.world import conceal as make

    cell = load(cell_name)
    _check(out, answers)
    world = make(cell, wishes)
    return _seal(cell, world.episodes, world.answer, out, answers)


def write_world(cell_name: str, asked: Asked, out: Path, answers: Path) -> Path:
    """The same for a cell with a scene in `worlds`. Raises ConfigError where it has none."""
    from compass_ros.cells import load
    from compass_ros.errors import ConfigError
    from compass_ros.worlds.scenes import MODULES, scene_of
    from compass_ros.worlds.world import Task

    cell = load(cell_name)
    scene = scene_of(cell.name)
    if scene is None:
        raise ConfigError(f"{cell_name}: has no concealed worlds; known: air_hockey, {', '.join(MODULES)}")
    _check(out, answers)
    world = scene(Task(cell.name, cell.hash, cell.model_path, cell.parameters), asked)
    return _seal(cell, world.episodes, world.answer, out, answers)


def _check(out: Path, answers: Path) -> None:
    from compass_ros.concealed.seal import apart
    from compass_ros.errors import ConfigError

    apart(answers, out)
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise ConfigError(f"--out {out}: is not empty; a world needs a folder of its own")


def _seal(cell: Cell, episodes: tuple[Episode, ...], answer: Mapping[str, object], out: Path, answers: Path) -> Path:
    from compass_ros.concealed.seal import seal
    from compass_ros.episodes import write_episode
    from compass_ros.operation.current import sources

    where = sources(cell) if cell.spec.inputs or cell.spec.signals else ()
    bags = {episode.name: write_episode(episode, out, where) for episode in episodes}
    return seal(answer, out, bags, answers)
