"""`compass evaluate`: a result judged on other recordings, before anybody applies it."""

from __future__ import annotations

import json
import math
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from compass_ros.evaluation import Evaluation


def add_to(app: typer.Typer) -> None:
    app.command()(evaluate)


def evaluate(
    result: Annotated[Path, typer.Argument(help="folder of a result, or its result.json")],
    bags: Annotated[list[str], typer.Argument(help="bags, or folders of bags, that it has not seen")],
    cell: Annotated[str, typer.Option(help="YAML of the cell, where the result's own is not there")] = "",
    as_json: Annotated[bool, typer.Option("--json", help="print JSON instead of a table")] = False,
    threads: Annotated[int, typer.Option(min=0, help="threads for rollouts; 0: all cores")] = 0,
) -> None:
    """Say how well a result predicts recordings that it has not seen, by signal.

    rms, noise floor, and the share of the mean square above the floor that is removed.
    """
    from compass_ros.cells import load
    from compass_ros.evaluation import evaluate as judge
    from compass_ros.operation.current import read_usable
    from compass_ros.reporting.result_json import read_result
    from compass_ros.reporting.words import left_out_lines

    folder = result.parent if result.name == "result.json" else result
    content = read_result(folder / "result.json")
    loaded = load(cell or cell_of(folder, content))
    reading = read_usable(loaded, bags)
    said = judge(loaded, folder, reading.episodes, threads)
    left_out = (*reading.left_out, *said.left_out)
    listed = {"left_out": [asdict(one) for one in left_out]}
    typer.echo(json.dumps(to_json(said) | listed, indent=1)) if as_json else show(said)
    fitted = content["episodes"]["fit"]  # recordings, or windows of them
    if seen := [r for r in said.recordings if any(name == r or name.startswith(f"{r} at ") for name in fitted)]:
        typer.echo(f"note: {', '.join(seen)}: fitted, so this is no test of the result", err=True)
    for line in left_out_lines(left_out):
        typer.echo(f"note: {line}", err=True)


def cell_of(folder: Path, content: dict[str, Any]) -> str:
    """Where the result says that its cell is: one of the suite's own by its name. Raises ConfigError."""
    from compass_ros.errors import ConfigError

    if not content.get("cell_file"):
        return str(content["cell"])
    path = folder / content["cell_file"]
    if not path.is_file():
        raise ConfigError(f"{folder}: its cell was {path}, which is not there; name its YAML with --cell")
    return str(path)


def to_json(said: Evaluation) -> dict[str, Any]:
    """What `--json` prints; numbers that are not defined are null."""

    def number(value: float) -> float | None:
        return value if math.isfinite(value) else None

    models = {}
    for model, judged in said.models.items():
        models[model] = {
            name: {
                "rms": number(signal.rms),
                "floor": number(signal.floor),
                "unit": signal.unit,
                "removed": number(judged.removed[name]),
                "parts": {part: number(rms) for part, rms in signal.parts.items()},
            }
            for name, signal in judged.gap.signals.items()
        }
    return {"cell": said.cell, "recordings": list(said.recordings), "windows": said.windows, "models": models}


def show(said: Evaluation) -> None:
    """Print the table: a line for each signal, and below it its joints."""
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    from compass_ros.reporting.numbers import thousandths
    from compass_ros.reporting.table import NARROW

    compared = f"recordings: {len(said.recordings)}, in {said.windows} parts"
    caption = f"{compared}; removed: share of the mean square above the floor"
    table = Table(caption=Text(caption, "dim"), caption_justify="left", **NARROW)
    table.add_column("signal")
    table.add_column("unit")
    table.add_column("floor", justify="right")
    for model in said.models:
        table.add_column(model.replace("_", " "), justify="right")
    for model in list(said.models)[1:]:
        table.add_column(f"removed, {model.replace('_', ' ')}", justify="right")
    nominal = said.models["nominal"].gap.signals
    for name, signal in nominal.items():
        values = [judged.gap.signals[name] for judged in said.models.values()]
        shares = [_share(judged.removed[name]) for judged in list(said.models.values())[1:]]
        row = [name, f"m{signal.unit}", thousandths(signal.floor), *(thousandths(v.rms) for v in values), *shares]
        table.add_row(*(Text(cell) for cell in row))
        for part in signal.parts:
            below = [f"  {part}", "", "", *(thousandths(v.parts[part]) for v in values), *("" for _ in shares)]
            table.add_row(*(Text(cell, "dim") for cell in below))
    Console().print(table)


def _share(value: float) -> str:
    return f"{100 * value:.1f} %" if math.isfinite(value) else "-"
