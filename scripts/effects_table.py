"""Writes the table of effects into docs/effects.md, from the registry and the docstrings of the effects.

python scripts/effects_table.py
"""

from __future__ import annotations

import sys
from pathlib import Path

from compass_ros.reporting.markdown import replace_between
from compass_ros.simulation.effects import EFFECTS, Quantity

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
        lines += [f"### {channel}", "", "| name | formula | parameters: bounds [unit] |", "|---|---|---|"]
        for name, effect in EFFECTS.items():
            if effect.channel == channel:
                parameters = "<br>".join(_described(q) for q in effect.quantities)
                lines.append(f"| `{name}` | {formula(name).replace('|', '&#124;')} | {parameters} |")
        lines.append("")
    return "\n".join(lines)


def _described(quantity: Quantity) -> str:
    kind = "" if quantity.amplitude else f", shape, from {quantity.start:g}"
    return f"`{quantity.name}`: {quantity.low:g} to {quantity.high:g} [{quantity.unit}]{kind}"


if __name__ == "__main__":
    replace_between(PAGE, BEGIN, END, table())
