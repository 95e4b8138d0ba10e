"""What a result said of a table in MuJoCo with concealed physics, beside what is true of it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rich.console import Console
from rich.table import Table

from compass_ros.concealed.comparison import compare, general
from compass_ros.reporting.table import NARROW

Json = Mapping[str, Any]
MARKS = {True: "right", False: "wrong", None: ""}
"""Of what a result said; None: does not apply."""


def truth(answer: Json) -> str:
    """What is missing in a world, in one line: names, bodies, and what is left of each."""
    parts = [
        f"{e['name']}{' (outside the library)' if e['outside'] else ''} on {' and '.join(e['objects'])}, "
        f"{1e3 * e['rms_m']:.2f} mm rms after the best parameters"
        for e in answer["effects"]
    ]
    return "; ".join(parts) or "nothing is missing"


def show(result: Json, answer: Json) -> None:
    """The table of what a result said beside what is true."""
    marks = compare(result, answer)
    title = f"{answer['cell']}, seed {answer['seed']}: the seal is whole"
    table = Table("", "said", "true", "", title=title, title_justify="left", **NARROW)
    said = ", ".join(marks.found) or "no effect"
    table.add_row("verdict", f"{marks.verdict}: {said}", truth(answer), MARKS[marks.right])
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
            table.add_row(name, str(where.get(name, "-")), " or ".join(true), MARKS[right])
    if marks.centre_error_m is not None:
        x, y = effects[0]["centre_m"]
        table.add_row("centre", f"{1e3 * marks.centre_error_m:.0f} mm away", f"({x:.3f}, {y:.3f}) m")
    for check in marks.parameters:
        found = f"{check.found:.4g} +- {check.std:.2g}"
        table.add_row(check.name.replace(".", ": "), found, f"{check.truth:.4g}", f"{100 * check.error:.0f} %")
    shown = {check.name for check in marks.parameters}
    for e in effects:
        for name, value in e["library"].items():
            if f"{e['name']}.{name}" not in shown and not name.startswith("centre_"):
                table.add_row(f"{e['name']}: {name}", "-", f"{value:.4g}")
    for name, value in marks.held_out_m.items():
        table.add_row(f"held-out error, {name}", f"{1e3 * value:.2f} mm", "")
    if marks.ordinary_z is not None:
        table.add_row("ordinary parameters", f"median {marks.ordinary_z:.1f} error bars off", "0.7 if all is well")
    Console().print(table)
