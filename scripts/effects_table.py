"""Writes the table of effects into docs/effects.md, from the registry and the docstrings of the effects.

python scripts/effects_table.py
"""

from __future__ import annotations

import sys
from pathlib import Path

from compass_ros.reporting.markdown import replace_between
from compass_ros.simulation.effects import EFFECTS, Quantity
from compass_ros.simulation.sites import JOINTS, in_words
from compass_ros.simulation.sizes import unit_joint

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
                only_joints = set(effect.on) <= set(JOINTS)
                parameters = [] if only_joints else [_described(q) for q in effect.quantities]
                if effect.on_joint is not None:
                    of_joint = [f"`{q.name}` [{q.unit}]" for q in effect.on_joint(unit_joint("hinge"))]
                    parameters.append(f"on a hinge: {', '.join(of_joint)}")
                row = (f"`{name}`", in_words(effect.on), formula(name).replace("|", "&#124;"), "<br>".join(parameters))
                lines.append(f"| {' | '.join(row)} |")
        lines.append("")
    return "\n".join(lines)


def _described(quantity: Quantity) -> str:
    kind = "" if quantity.amplitude else f", shape, from {quantity.start:g}"
    return f"`{quantity.name}`: {quantity.low:g} to {quantity.high:g} [{quantity.unit}]{kind}"


if __name__ == "__main__":
    replace_between(PAGE, BEGIN, END, table())
