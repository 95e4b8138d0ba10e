"""What a result said of a world from another engine, beside what is true of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from rich.console import Console
from rich.table import Table

from compass_ros.commands.unseal_table import MARKS
from compass_ros.concealed.comparison import ordinary
from compass_ros.proof.marks import FAINT, judge
from compass_ros.reporting.table import NARROW

Json = Mapping[str, Any]


def truth(answer: Json) -> str:
    """What is missing in a world, in one line: names, sites, and how much more than the noise each moves."""
    parts = [f"{_named(law)}, {law['strength']:.3g} times the noise" for law in answer["laws"]]
    return "; ".join(parts) or "nothing is missing"


def show(result: Json, answer: Json) -> None:
    """The table of what a result said beside what is true."""
    marks, laws, explanations = judge(result, answer), answer["laws"], result["mismatch"]["explanations"]
    found = explanations[0]["laws"] if marks.verdict in ("named", "ambiguous") else []
    title = f"{answer['cell']}, seed {answer['seed']}: the seal is whole"
    table = Table("", "said", "true", "", title=title, title_justify="left", **NARROW)
    probability = f" (probability {explanations[0]['probability']:.2f})" if found else ""
    said = f"{marks.verdict}: {' and '.join(map(_named, found))}{probability}" if found else marks.verdict
    table.add_row("verdict", said, truth(answer), MARKS[marks.right])
    if marks.verdict == "ambiguous":
        table.add_row("left open", ", ".join(marks.found), "")
    for law in laws:
        faint = f", or none: less than {FAINT:g} times the noise" if law["strength"] < FAINT else ""
        table.add_row(f"{law['name']}: may be called", "", " or ".join(law["class"]) + faint)
    if marks.sites_right is not None:
        sites = [site for law in found for site in law["sites"]]
        table.add_row("sites", ", ".join(dict.fromkeys(sites)), ", ".join(laws[0]["sites"]), MARKS[marks.sites_right])
    for law in found:
        for name, q in law["quantities"].items():
            error = f" +- {q['std']:.2g}" if q["std"] is not None else ""
            table.add_row(f"{_named(law)}: {name}", f"{q['value']:.4g}{error} {q['unit']}".rstrip(), "")
    for law in laws:
        for name, value in law["quantities"].items():
            table.add_row(f"{law['name']}: {name}", "", _number(value))
    held = next((e["held_out"] for e in explanations if e["held_out"]), None)
    if held:
        rows = {"calibrated": "before", **({"with laws": "after"} if found else {}), "floor": "floor"}
        for name, key in rows.items():
            if held[key] is not None:
                table.add_row(f"held-out error, {name}", f"{held[key]:.3g} {held['unit']}", "")
    z = ordinary(result["parameters"], answer["parameters"])
    if z is not None:
        table.add_row("ordinary parameters", f"median {z:.1f} error bars off", "0.7 if all is well")
    Console().print(table)


def _named(law: Json) -> str:
    return f"{law['name']}{_on(law['sites'])}"


def _on(sites: Sequence[str]) -> str:
    return f" on {' and '.join(sites)}" if sites else ""


def _number(value: object) -> str:
    """A quantity as a world says it: one number, one of each site, or a word."""
    if isinstance(value, list):
        return ", ".join(map(_number, value))
    return f"{value:.4g}" if isinstance(value, float) else str(value)
