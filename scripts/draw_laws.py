"""Draws each law as it looks in data, and writes the gallery in docs/laws.md.

    python -m scripts.draw_laws                    # docs/images/laws/*.svg and the tables of docs/laws.md; some seconds
    python -m scripts.draw_laws --sheet laws.png   # all of them on one sheet, to look at

Every picture comes from the library's own formulas: forces by `evaluate`, motions by `attach` on a plain MuJoCo model,
commands and sensors by the hooks of the law. Grey, dashed: the simulator without the law; green: with it.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from compass_ros.reporting.figures import save, styled
from compass_ros.reporting.markdown import replace_between
from compass_ros.simulation.effects import EFFECTS, effect
from scripts.law_pictures.catalogue import PICTURES

ROOT = Path(__file__).parents[1]
PAGE, FOLDER = ROOT / "docs" / "laws.md", ROOT / "docs" / "images" / "laws"
BEGIN, END = "<!-- gallery: begin -->\n", "<!-- gallery: end -->\n"


def drawn(axes: Axes, name: str) -> None:
    """One law on given axes."""
    PICTURES[name].draw(axes, effect(name))


def figure_of(name: str) -> Figure:
    """The small picture of one law."""
    with styled():
        figure = Figure(figsize=(2.5, 1.55), layout="constrained")
        axes = figure.add_subplot()
        small(axes)
        drawn(axes, name)
    return figure


def small(axes: Axes) -> None:
    axes.tick_params(labelsize=6.5)
    axes.xaxis.label.set_fontsize(7)
    axes.yaxis.label.set_fontsize(7)
    axes.locator_params(nbins=4)


def gallery() -> str:
    """Markdown: a table for each channel, one line a law."""
    lines = []
    for channel in ("dynamics", "contact", "actuation", "sensing"):
        lines += [
            f"## {channel}",
            "",
            "| law: what the simulator lacks | in data | what one sees |",
            "|---|---|---|",
        ]
        for name, law in EFFECTS.items():
            if law.channel == channel:
                seen, picture = PICTURES[name].seen, f"![{name}](images/laws/{name}.svg)"
                lines.append(f"| `{name}`:<br>{law.sentence} | {picture} | {seen} |")
        lines.append("")
    return "\n".join(lines)


def sheet(path: Path) -> None:
    """All of them as one PNG."""
    columns = 6
    rows = -(-len(PICTURES) // columns)
    with styled():
        figure = Figure(figsize=(2.6 * columns, 1.75 * rows), layout="constrained")
        for place, name in enumerate(PICTURES):
            axes = figure.add_subplot(rows, columns, place + 1)
            small(axes)
            drawn(axes, name)
            axes.set_title(name, fontsize=8)
        save(figure, path)


def main(words: Sequence[str]) -> None:
    """Draw the sheet, or all pictures and the page."""
    if words[:1] == ["--sheet"]:
        sheet(Path(words[1]))
        return
    FOLDER.mkdir(parents=True, exist_ok=True)
    with rc_context({"svg.fonttype": "none", "path.simplify_threshold": 0.5}):
        for name in PICTURES:
            save(figure_of(name), FOLDER / f"{name}.svg")
    replace_between(PAGE, BEGIN, END, gallery())


if __name__ == "__main__":
    main(sys.argv[1:])
