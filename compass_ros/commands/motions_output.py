"""Planned motions: in words and as a table in the terminal, as JSON, as a table to play and its import."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table
from rich.text import Text

from compass_ros.cells import Cell
from compass_ros.planning.excitation import Plan, Proposal, Shown
from compass_ros.planning.motion_table import import_config, table
from compass_ros.reporting.atomic import write_text
from compass_ros.reporting.numbers import plain, unit_text
from compass_ros.reporting.table import NARROW
from compass_ros.reporting.words import told_lines

SCHEMA = "compass/motions/1"


def print_motions(found: Plan, console: Console | None = None) -> None:
    """What recordings show, in words; error bars before and after; what the proposed motions gain."""
    out = console or Console()
    for warning in found.warnings:
        out.print(Text.assemble(("Warning: ", "bold yellow"), warning))
    for shown in found.shown:
        out.print(Text(f"{_title(shown)}, before any fit:", "bold"))
        for line in told_lines(shown.told):
            out.print(Text(f"  {line}"))
    out.print(_errors(found))
    if found.proposal is not None:
        out.print(Text(gained(found), "bold"))
        out.print(Text(played(found.proposal)))


def _title(shown: Shown) -> str:
    return f"{shown.name[0].upper()}{shown.name[1:]} ({shown.seconds:.0f} s)"


def gained(found: Plan) -> str:
    """One sentence: the proposed motions beside what they are compared with."""
    before, after = found.shown[0], found.shown[1]
    smaller = float(np.exp(np.mean(np.log(found.std(before) / found.std(after)))))
    return (
        f"The proposed motions pin down {len(after.told.alone)} of {len(found.parameters)} parameters, not "
        f"{len(before.told.alone)}; error bars are {smaller:.2f} times smaller (geometric mean), "
        f"{after.gained - before.gained:+.0f} nats."
    )


def played(proposal: Proposal) -> str:
    """What to do with the table, one sentence."""
    times = [f"{e.name} {n} times" for e, n in zip(proposal.expected, proposal.times, strict=True) if n > 1]
    again = f" ({', '.join(times)})" if times else ""
    moved = "" if proposal.driven.spec.quantity == "joint_effort" else ", each from rest in its first posture"
    return (
        f"{len(proposal.times)} motions of {proposal.motions.time_s[-1]:g} s{again}{moved}. "
        "Nothing but the scene's own geometry was looked at: play them slowly first."
    )


def _errors(found: Plan) -> Table:
    """Expected error bars of all parameters."""
    caption = Text("one standard deviation; to first order at the defaults, noise alone", "dim")
    out = Table(caption=caption, caption_justify="left", **NARROW)
    out.add_column("parameter")
    for heading in ("known to", *(shown.name.partition(",")[0] for shown in found.shown)):
        out.add_column(heading, justify="right")
    std = [found.std(shown) for shown in found.shown]
    for i, parameter in enumerate(found.parameters):
        numbers = [parameter.half_width, *(float(column[i]) for column in std)]
        unit = unit_text(parameter.unit)
        name = f"{parameter.name} [{unit}]" if unit else parameter.name
        out.add_row(Text(name), *(Text(plain(number, 2)) for number in numbers))
    return out


def write_motions(found: Plan, cell: Cell, out: Path) -> None:
    """plan.json; motions.csv and import.yaml where motions are proposed. Raises ConfigError."""
    content: dict[str, Any] = {
        "schema": SCHEMA,
        "cell": cell.name,
        "cell_hash": cell.hash,
        "warnings": list(found.warnings),
        "parameters": [{"name": p.name, "unit": p.unit, "known_to": p.half_width} for p in found.parameters],
        "shown": [_json(found, shown) for shown in found.shown],
    }
    if found.proposal is not None:
        content["motions"] = [
            {"name": e.name, "times": n} for e, n in zip(found.proposal.expected, found.proposal.times, strict=True)
        ]
        write_text(out / "motions.csv", table(cell, found.proposal))
        write_text(out / "import.yaml", import_config(cell, found.proposal, "motions.csv"))
    write_text(out / "plan.json", json.dumps(content, indent=1, allow_nan=False) + "\n")


def _json(found: Plan, shown: Shown) -> Mapping[str, Any]:
    return {
        "name": shown.name,
        "seconds": shown.seconds,
        "nats": shown.gained,
        "std": found.std(shown).tolist(),
        "pinned_down": list(shown.told.alone),
        "only_together": [{"parameters": list(g.parameters), "ratios": g.ratios} for g in shown.told.together],
        "weakly": list(shown.told.weakly),
        "not_at_all": list(shown.told.not_at_all),
    }
