"""`compass unseal`: the answer of a concealed world, beside what a calibration said."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

ANSWERS = Path("~/.local/share/compass_ros/answers")


def add_to(app: typer.Typer) -> None:
    app.command()(unseal)


def unseal(
    path: Annotated[Path, typer.Argument(help="result.json or its folder; or a world, for its answer alone")],
    world: Annotated[Path | None, typer.Option(help="folder with seal.json; else searched above the result")] = None,
    answers: Annotated[Path, typer.Option(help="folder of the answers")] = ANSWERS,
) -> None:
    """Open the seal of a concealed world, check that nothing was altered, and compare a result with the truth."""
    from compass_ros.commands import unseal_scene, unseal_table
    from compass_ros.concealed.seal import unseal as open_seal
    from compass_ros.reporting import read_result

    result = _result_of(path)
    answer = open_seal(world or _world_of(path), answers).answer
    of_world = unseal_scene if "laws" in answer else unseal_table
    if result is None:
        typer.echo(f"true: {of_world.truth(answer)}")
    else:
        of_world.show(read_result(result), answer)


def _result_of(path: Path) -> Path | None:
    if path.is_file():
        return path
    return next((p for p in (path / "result.json", path / "result" / "result.json") if p.is_file()), None)


def _world_of(path: Path) -> Path:
    """The nearest folder at or above the path that holds a seal. Raises ConfigError where there is none."""
    from compass_ros.concealed.seal import SEAL
    from compass_ros.errors import ConfigError

    for folder in (path, *path.resolve().parents):
        if (folder / SEAL).is_file():
            return folder
    raise ConfigError(f"{path}: no {SEAL} there or above; say --world FOLDER")
