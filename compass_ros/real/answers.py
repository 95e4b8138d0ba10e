"""What is expected of recordings of others, and what an answer is worth against it."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import field
from pathlib import Path
from typing import Any, Literal

from pydantic import ConfigDict, Field, TypeAdapter, ValidationError
from pydantic.dataclasses import dataclass

from compass_ros.config import read_yaml
from compass_ros.errors import ConfigError, shown

ANSWERS = Path(__file__).parents[2] / "config" / "league.yaml"
PROBABLE = 0.05
"""An explanation of an ambiguous verdict counts from this probability on: the usual level of significance."""
Mark = Literal["right", "class", "unknown", "wrong", "no verdict"]
_strict = ConfigDict(extra="forbid")


@dataclass(frozen=True, config=_strict)
class Entry:
    """Recordings of one robot, and the answer that was expected before they were judged."""

    name: str
    kind: str
    """What counts once: the balls are several entries of one kind."""
    tables: str
    """YAML in config/import that makes bags of them."""
    recordings: tuple[str, ...]
    """Patterns of the bags' names."""
    cell: str
    right: tuple[tuple[str, ...], ...]
    """Sets of laws; the empty one is the verdict `none`."""
    source: str
    """Why that is the answer."""
    of_class: tuple[str, ...] = Field(default=(), alias="class")
    """Laws that a published taxonomy calls the same kind of thing."""
    within: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    """Ranges of quantities, by LAW.QUANTITY, that a right answer must lie in."""
    settings: Mapping[str, float] = field(default_factory=dict)
    """Fields of the calibration's configuration."""


@dataclass(frozen=True, config=_strict)
class League:
    """All entries of a file."""

    entries: tuple[Entry, ...]


def read_answers(path: Path = ANSWERS) -> tuple[dict[str, Entry], str]:
    """Entries by name, and the file's SHA-256. Raises ConfigError naming the field, what was expected and found."""
    try:
        league = TypeAdapter(League).validate_python(dict(read_yaml(path)))
    except ValidationError as error:
        first = error.errors()[0]
        name = ".".join(str(part) for part in first["loc"])
        raise ConfigError(f"{path}: {name}: {first['msg']}, found {shown(first['input'])}") from error
    return {entry.name: entry for entry in league.entries}, hashlib.sha256(path.read_bytes()).hexdigest()


def mark(entry: Entry, mismatch: Mapping[str, Any]) -> Mark:
    """What the `mismatch` of a result is worth: the set of laws itself, something of its class, `unknown`, or wrong."""
    verdict = mismatch["verdict"]
    if verdict not in ("none", "named", "ambiguous", "unknown"):
        return "no verdict"
    if verdict == "unknown":
        return "unknown"
    right = {frozenset(laws) for laws in entry.right}
    if verdict == "ambiguous":
        return "class" if any(_laws(e) in right for e in _probable(mismatch)) else "wrong"
    said = frozenset(effect["name"] for effect in mismatch["effects"])
    if said in right:
        return "right" if _within(entry, mismatch["effects"]) else "class"
    return "class" if said and said <= frozenset(entry.of_class) else "wrong"


def _probable(mismatch: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    return [e for e in mismatch["explanations"] if e["probability"] >= PROBABLE]


def _laws(explanation: Mapping[str, Any]) -> frozenset[str]:
    return frozenset(law["name"] for law in explanation["laws"])


def _within(entry: Entry, effects: list[Mapping[str, Any]]) -> bool:
    values = {f"{e['name']}.{n}": q["value"] for e in effects for n, q in e["parameters"].items()}
    return all(low <= values[name] <= high for name, (low, high) in entry.within.items() if name in values)
