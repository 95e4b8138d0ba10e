"""Writes the table of effects into docs/effects.md, from the registry and the docstrings of the effects.

python scripts/effects_table.py
"""

from __future__ import annotations

import sys
from pathlib import Path

from compass_ros.reporting.markdown import replace_between
from compass_ros.simulation.effects import EFFECTS, Effect, Quantity
from compass_ros.simulation.extents import unit_sizes
from compass_ros.simulation.site_kinds import SIGNALS, SINGLE_DRIVES, SiteKind, in_words

PAGE = Path(__file__).parents[1] / "docs" / "effects.md"
BEGIN, END = "<!-- table: begin -->\n", "<!-- table: end -->\n"


def formula(name: str) -> str:
    """The second paragraph of an effect's docstring up to its source, in one line."""
    text = sys.modules[f"compass_ros.simulation.effects.{name}"].__doc__ or ""
    return " ".join(text.split("\n\n")[1].split("Source:")[0].split())


def table() -> str:
    """Markdown, a section for each channel."""
    lines = []
    for channel in ("dynamics", "contact", "actuation", "sensing"):
        lines += [f"### {channel}", "", "| name | acts on | formula | parameters: bounds [unit] |", "|---|---|---|---|"]
        for name, effect in EFFECTS.items():
            if effect.channel == channel:
                sized = {kind: "as unsure as the number is: `deviation`" for kind in effect.on if effect.apart}
                sized = sized or _sized(effect)
                absolute = [] if set(effect.on) <= set(sized) else [_described(q) for q in effect.quantities]
                parameters = absolute + list(dict.fromkeys(sized.values()))
                row = (f"`{name}`", in_words(effect.on), formula(name).replace("|", "&#124;"), "<br>".join(parameters))
                lines.append(f"| {' | '.join(row)} |")
        lines.append("")
    return "\n".join(lines)


def _sized(effect: Effect) -> dict[SiteKind, str]:
    """By kind of site, the quantities of an effect whose sizes follow from the cell."""
    words = {"hinge": "on a hinge", "body": "on a body"}
    out: dict[SiteKind, str] = {}
    for kind in effect.on:
        shown = "hinge" if kind == "slide" else kind
        sizes = () if kind == "tool_drive" else unit_sizes(shown)
        numbers = effect.at(sizes[0]).quantities if sizes else effect.quantities
        if numbers is not effect.quantities:
            of_command = kind in (*SINGLE_DRIVES, *SIGNALS)  # whose units the scene decides
            units = ", ".join(f"`{q.name}`" + ("" if of_command else f" [{q.unit}]") for q in numbers)
            out[kind] = f"{words.get(shown, 'as large as the cell has it')}: {units}"
    return out


def _described(quantity: Quantity) -> str:
    kind = "" if quantity.amplitude else f", shape, from {quantity.start:g}"
    return f"`{quantity.name}`: {quantity.low:g} to {quantity.high:g} [{quantity.unit}]{kind}"


if __name__ == "__main__":
    replace_between(PAGE, BEGIN, END, table())
