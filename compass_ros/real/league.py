"""The runs: tables become bags, `compass calibrate` judges them, the verdict meets the answer; a JSON line an entry."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterable, Mapping
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

from compass_ros.episodes.tables import import_tables
from compass_ros.errors import ConfigError, nearest
from compass_ros.proof.campaign import commit
from compass_ros.proof.lines import METHOD, sources
from compass_ros.proof.one_world import timed
from compass_ros.real.answers import ANSWERS, Entry, mark
from compass_ros.reporting import read_result
from compass_ros.reporting.atomic import write_text

Line = Mapping[str, Any]
Tell = Callable[[Line], None]
LIMIT_S = 6 * 3600
"""A calibration that takes longer counts as failed [s]: an arm with 30 windows takes an hour of a core."""


def run(
    entries: Iterable[Entry], answers: str, lines: Path, out: Path, data: Path | None, threads: int, tell: Tell
) -> None:
    """Judge what `lines` has not yet by these answers and sources; the file is whole after each entry.

    `answers`: hash of the file that they come from. `out`: folder of bags and results.
    """
    made_by = {"answers": answers, "method_sources": sources(METHOD)}
    for entry in entries:
        known = read_lines(lines)
        if any(known.get(entry.name, {}).get(key) != value for key, value in made_by.items()):
            line = {"name": entry.name, "kind": entry.kind, "commit": commit(), "threads": threads}
            known[entry.name] = line | made_by | judged(entry, out, data, threads)
            write_text(lines, "".join(json.dumps(known[name], sort_keys=True) + "\n" for name in sorted(known)))
        tell(known[entry.name])


def judged(entry: Entry, out: Path, data: Path | None, threads: int) -> dict[str, Any]:
    """What `compass calibrate` says of an entry's recordings, and its mark; `error` where it ended without a result."""
    folder = (out / entry.name).absolute()
    folder.mkdir(parents=True, exist_ok=True)
    config = folder / "settings.json"
    config.write_text(json.dumps({**entry.settings, "threads": threads}), encoding="utf-8")
    words = ["calibrate", "--cell", entry.cell, "--config", str(config), "--progress", "none", "--out", str(folder)]
    command = [sys.executable, "-m", "compass_ros.cli", *words, *map(str, bags(entry, out, data))]
    error, seconds = timed(command, folder, LIMIT_S)
    if error:
        return {"error": error, "seconds": seconds, "mark": "no verdict"}
    result = read_result(folder / "result.json")
    mismatch = result["mismatch"]
    kept = {key: mismatch[key] for key in ("verdict", "sentence", "effects", "explanations", "where")}
    kept |= {name: len(result["episodes"][name]) for name in ("fit", "held_out")}
    return {"error": None, "seconds": seconds, "mark": mark(entry, mismatch), "gap": _gaps(result["gap"]), **kept}


def bags(entry: Entry, out: Path, data: Path | None) -> list[Path]:
    """The bags of an entry; tables are turned into bags once. Raises ConfigError where no name fits."""
    folder = (out / "bags" / entry.tables).absolute()
    if not folder.is_dir():
        import_tables(ANSWERS.parent / "import" / f"{entry.tables}.yaml", folder, data)
    bags = sorted(p for p in folder.iterdir() if any(fnmatchcase(p.name, one) for one in entry.recordings))
    if not bags:
        raise ConfigError(f"{entry.name}: recordings: no bag in {folder} is called {' or '.join(entry.recordings)}")
    return bags


def _gaps(gap: Mapping[str, Any]) -> dict[str, Any]:
    """rms on the held-out recordings, by model, and the noise."""
    models = {name: gap[name] and gap[name]["held_out"] for name in ("nominal", "calibrated", "with_effects")}
    rms = {name: parts and parts["rmse_m"] for name, parts in models.items()}
    return rms | {"noise": gap["noise_floor_m"], "unit": gap["unit"]}


def read_lines(path: Path) -> dict[str, Line]:
    """Lines by the name of their entry. No file: none. Raises ConfigError with the number of a bad line."""
    found: dict[str, Line] = {}
    for number, text in enumerate(path.read_text(encoding="utf-8").splitlines() if path.exists() else (), 1):
        try:
            line = json.loads(text)
            found[line["name"]] = line
        except (ValueError, KeyError, TypeError) as error:
            raise ConfigError(f"{path}: line {number}: not a result of the league: {error}") from error
    return found


def chosen(entries: Mapping[str, Entry], names: Iterable[str]) -> list[Entry]:
    """The entries of these names or kinds, all where there is none. Raises ConfigError with the nearest known name."""
    out: list[Entry] = []
    for name in names:
        own = [e for e in entries.values() if name in (e.name, e.kind)]
        if not own:
            raise ConfigError(f"unknown entry '{name}'; known: {', '.join(entries)}{nearest(name, entries)}")
        out += own
    return out or list(entries.values())
