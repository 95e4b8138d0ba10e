"""A plan as a table in the terminal, as JSON, as a figure, and as a list of shots that can be planned with again."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, cast

import numpy as np
import yaml
from matplotlib import rc_context
from matplotlib.figure import Figure
from rich.console import Console
from rich.table import Table
from rich.text import Text

from compass_ros.cells import Cell
from compass_ros.planning.plan import TWIN, Plan, Seen, Visible, widest
from compass_ros.planning.shots import Planned
from compass_ros.reporting.atomic import write_text
from compass_ros.reporting.figures import STYLE, save
from compass_ros.reporting.palette import LIGHT
from compass_ros.types import Floats

SCHEMA = "compass/plan/1"


def print_plan(found: Planned, console: Console | None = None) -> None:
    """Effects that the shots could show, those they could not, parameters that they feel, and the better set."""
    out = console or Console()
    for warning in found.warnings:
        out.print(Text.assemble(("Warning: ", "bold yellow"), warning))
    better = found.better
    out.print(_effects(found.plan, better))
    out.print(_parameters(found.plan, better))
    if found.plan.undetectable:
        out.print(Text.assemble(("These shots cannot show: ", "bold"), ", ".join(found.plan.undetectable)))
    if better is not None:
        seen = [np.log([_part(v) for v in _shown(p)]) for p in (found.plan, better)]
        lost = [sum(not v.detectable for v in _shown(p)) for p in (found.plan, better)]
        smaller = float(np.exp(np.mean(seen[0] - seen[1])))
        said = (
            f"The proposed shots see effects {smaller:.1f} times smaller; {lost[1]} instead of {lost[0]} stay unseen."
        )
        out.print(Text(said, "bold"))


def _shown(plan: Plan) -> list[Visible]:
    """Effects on all that they can act on together; walls one by one."""
    return [plan.effects[i] for i in widest([(v.name, v.objects) for v in plan.effects])]


def _effects(plan: Plan, better: Plan | None) -> Table:
    caption = (
        f"absorbed: what ordinary parameters would take; not told from: cosine over {TWIN:g}; never: beyond bounds"
    )
    table = Table(caption=Text(caption, "dim"), caption_justify="left")
    proposed = ["proposed"] if better else []
    for heading in ("effect", "at 5 sigma", *proposed, "absorbed", "not told from"):
        right = heading in ("at 5 sigma", "proposed", "absorbed")
        table.add_column(heading, justify="right" if right else "left", overflow="fold")
    others = _shown(better) if better else []
    for i, v in enumerate(_shown(plan)):
        twins = [t for t in v.twins if " of " not in t or len(v.objects) == 1]
        for k, seen in enumerate(v.amplitudes):
            style = "" if v.detectable else "dim"
            cells = [f"{_title(v)} {seen.name} {_unit(seen)}", _number(seen)]
            cells += [_number(others[i].amplitudes[k])] if better else []
            cells += [f"{seen.absorbed:.1%}", ", ".join(twins) if not k else ""]
            table.add_row(*(Text(c, style) for c in cells))
    return table


def _title(v: Visible) -> str:
    return f"{v.name} ({v.objects[0]})" if len(v.objects) == 1 else v.name


def _unit(seen: Seen) -> str:
    return f"[{seen.unit}]" if seen.unit != "1" else ""


def _number(seen: Seen) -> str:
    return f"{seen.at_five_sigma:.2g}" if seen.at_five_sigma <= seen.bound else "never"


def _parameters(plan: Plan, better: Plan | None) -> Table:
    """Parameters that become known better than they are."""
    felt = [i for i, s in enumerate(plan.parameters) if s.at_five_sigma < 5 * s.bound]
    hidden = len(plan.parameters) - len(felt)
    caption = Text(f"{hidden} further parameters stay as unknown as they are" if hidden else "", "dim")
    table = Table(caption=caption, caption_justify="left")
    proposed = ["proposed"] if better else []
    for heading in ("parameter", "at 5 sigma", *proposed, "known to", "absorbed"):
        table.add_column(heading, justify="left" if heading == "parameter" else "right", overflow="fold")
    for i in felt:
        seen = plan.parameters[i]
        cells = [f"{seen.name} {_unit(seen)}", f"{seen.at_five_sigma:.2g}"]
        cells += [f"{better.parameters[i].at_five_sigma:.2g}"] if better else []
        table.add_row(*(Text(c) for c in (*cells, f"{seen.bound:.2g}", f"{seen.absorbed:.1%}")))
    return table


def write_plan(found: Planned, cell: Cell, out: Path) -> None:
    """plan.json, plan.png, and shots.yaml with the proposed (else the planned) shots. Raises ConfigError."""
    content: dict[str, Any] = {
        "schema": SCHEMA,
        "cell": cell.name,
        "cell_hash": cell.hash,
        "warnings": list(found.warnings),
        "planned": _json(found.plan, _actions(cell, found.shots)),
    }
    if found.better is not None and found.proposed is not None:
        content["proposed"] = _json(found.better, _actions(cell, found.proposed))
    write_text(out / "plan.json", json.dumps(content, indent=1, allow_nan=False) + "\n")
    shots = found.shots if found.proposed is None else found.proposed
    listed = yaml.safe_dump({"shots": _actions(cell, shots)}, sort_keys=False, default_flow_style=None)
    write_text(out / "shots.yaml", listed)
    save(figure(found), out / "plan.png")


def _actions(cell: Cell, shots: Floats) -> list[dict[str, float]]:
    names = [a.name for a in cell.action]
    return [dict(zip(names, np.round(shot, 4).tolist(), strict=True)) for shot in shots]


def _json(plan: Plan, shots: list[dict[str, float]]) -> Mapping[str, Any]:
    return {
        "shots": shots,
        "parameters": [_seen(s) for s in plan.parameters],
        "effects": [
            {
                "name": v.name,
                "objects": list(v.objects),
                "detectable": v.detectable,
                "amplitudes": [_seen(s) for s in v.amplitudes],
                "twins": list(v.twins),
            }
            for v in plan.effects
        ],
        "undetectable": list(plan.undetectable),
    }


def _seen(seen: Seen) -> Mapping[str, Any]:
    """Null where no amplitude, however large, would be seen."""
    five = seen.at_five_sigma if math.isfinite(seen.at_five_sigma) and seen.at_five_sigma < 1e100 else None
    return {"name": seen.name, "unit": seen.unit, "at_five_sigma": five, "absorbed": seen.absorbed, "bound": seen.bound}


def _part(v: Visible) -> float:
    """Amplitude at 5 sigma in parts of the largest that is physical, at most 1."""
    return min(v.at_five_sigma / v.best.bound, 1.0)


def figure(found: Planned) -> Figure:
    """Amplitude at 5 sigma of each effect, in parts of the largest that is physical; logarithmic, 1: never seen."""
    better = {(v.name, v.objects): v for v in found.better.effects} if found.better else {}
    rows = [v for v in _shown(found.plan) if v.detectable or (better and better[v.name, v.objects].detectable)]
    order = np.argsort([_part(v) for v in rows], kind="stable")
    with rc_context(cast(Any, STYLE)):
        drawn = Figure(figsize=(6.4, 0.9 + 0.19 * len(rows)), layout="constrained")
        axes = drawn.add_subplot()
        for place, i in enumerate(order):
            v = rows[i]
            planned = _part(v)
            told = "o" if not v.twins else "D"
            axes.plot(planned, place, told, color=LIGHT["nominal"], ms=4.5)
            if better:
                other = better[v.name, v.objects]
                there = _part(other)
                axes.plot([planned, there], [place, place], color=LIGHT["line"], lw=2, zorder=0)
                axes.plot(there, place, "o" if not other.twins else "D", color=LIGHT["with_effects"], ms=4.5)
        axes.set_yticks(range(len(rows)), [_title(rows[i]) for i in order], size=7)
        axes.set_xscale("log")
        axes.set_xlabel("seen at 5 sigma, in parts of the largest that is physical; diamond: not told from another")
        if better:
            axes.set_title("planned (orange) and proposed shots (green)")
    return drawn
