"""`compass unseal`: the answer of a concealed world, beside what a calibration said."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from compass_ros.concealed.comparison import Comparison

ANSWERS = Path("~/.local/share/compass_ros/answers")


def add_to(app: typer.Typer) -> None:
    app.command()(unseal)


def unseal(
    path: Annotated[Path, typer.Argument(help="result.json or its folder; or a world, for its answer alone")],
    world: Annotated[Path | None, typer.Option(help="folder with seal.json; else searched above the result")] = None,
    answers: Annotated[Path, typer.Option(help="folder of the answers")] = ANSWERS,
) -> None:
    """Open the seal of a concealed world, check that nothing was altered, and compare a result with the truth."""
    from compass_ros.commands import unseal_scene
    from compass_ros.concealed.comparison import compare
    from compass_ros.concealed.seal import unseal as open_seal
    from compass_ros.reporting import read_result

    result = _result_of(path)
    opened = open_seal(world or _world_of(path), answers)
    of_scene = "laws" in opened.answer  # of another engine; else of the table in MuJoCo
    if result is None:
        typer.echo(f"true: {unseal_scene.truth(opened.answer) if of_scene else _truth(opened.answer)}")
        return
    content = read_result(result)
    if of_scene:
        unseal_scene.show(content, opened.answer)
    else:
        show(content, opened.answer, compare(content, opened.answer))


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


def _truth(answer: Any) -> str:
    parts = [
        f"{e['name']}{' (outside the library)' if e['outside'] else ''} on {' and '.join(e['objects'])}, "
        f"{1e3 * e['rms_m']:.2f} mm rms after the best parameters"
        for e in answer["effects"]
    ]
    return "; ".join(parts) or "nothing is missing"


def show(result: Any, answer: Any, marks: Comparison) -> None:
    """The table of what a result said beside what is true."""
    from rich.console import Console
    from rich.table import Table

    from compass_ros.concealed.comparison import general
    from compass_ros.reporting.table import NARROW

    console = Console()
    title = f"{answer['cell']}, seed {answer['seed']}: the seal is whole"
    table = Table("", "said", "true", "", title=title, title_justify="left", **NARROW)
    said = ", ".join(marks.found) or "no effect"
    table.add_row("verdict", f"{marks.verdict}: {said}", _truth(answer), _mark(marks.right))
    if len(marks.twins) > 1:
        table.add_row("class", "", "recordings cannot tell apart: " + ", ".join(marks.twins))
    where, effects = result["mismatch"]["where"] or {}, answer["effects"]
    if len(effects) == 1:
        for name, right in (
            ("object", marks.object_right),
            ("phase", marks.phase_right),
            ("channel", marks.channel_right),
        ):
            true = dict.fromkeys(map(general, effects[0][f"{name}s_right"]))
            table.add_row(name, str(where.get(name, "-")), " or ".join(true), _mark(right))
    if marks.centre_error_m is not None:
        x, y = effects[0]["centre_m"]
        table.add_row("centre", f"{1e3 * marks.centre_error_m:.0f} mm away", f"({x:.3f}, {y:.3f}) m")
    for check in marks.parameters:
        found = f"{check.found:.4g} +- {check.std:.2g}"
        table.add_row(check.name, found, f"{check.truth:.4g}", f"{100 * check.error:.0f} %")
    shown = {check.name for check in marks.parameters}
    for e in effects:
        for name, value in e["library"].items():
            if f"{e['name']}.{name}" not in shown and not name.startswith("centre_"):
                table.add_row(f"{e['name']}.{name}", "-", f"{value:.4g}")
    for name, value in marks.held_out_m.items():
        table.add_row(f"held-out error, {name}", f"{1e3 * value:.2f} mm", "")
    if marks.ordinary_z is not None:
        table.add_row("ordinary parameters", f"median {marks.ordinary_z:.1f} error bars off", "0.7 if all is well")
    console.print(table)


def _mark(right: bool | None) -> str:
    return {True: "right", False: "wrong", None: ""}[right]
