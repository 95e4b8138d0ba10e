"""The results file: one JSON object a line, one line a world and method. The repository keeps it."""

from __future__ import annotations

import ast
import hashlib
import json
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from compass_ros.errors import ConfigError
from compass_ros.reporting.atomic import write_text

Line = Mapping[str, Any]
PACKAGE = Path(__file__).parents[1]
METHOD = (
    "calibration",
    "discovery",
    "simulation",
    "cells",
    "posing.py",
    "estimation.py",
    "assembly.py",
    "pipeline.py",
    "results.py",
    "types.py",
    "config.py",
)
WORLDS = ("concealed", "worlds", "cells", "proof/one_world.py")


@dataclass(frozen=True)
class Key:
    """What a line is about."""

    suite: str
    seed: int
    method: str


def key(line: Line) -> Key:
    return Key(str(line["suite"]), int(line["seed"]), str(line["method"]))


def marks_of(line: Line) -> dict[str, Any]:
    """Of a world; none where its run failed."""
    return dict(line.get("marks") or {})


def mark_of(line: Line, name: str) -> Any:
    """One of them; None where there is none."""
    return marks_of(line).get(name)


def kind_of(line: Line) -> str:
    """How much is missing in the world."""
    return str(marks_of(line).get("kind", line.get("kind", "")))


def counted(lines: Collection[Line]) -> str:
    """How many worlds, in words."""
    return f"{len(lines)} world{'' if len(lines) == 1 else 's'}"


def read(path: Path) -> dict[Key, Line]:
    """All lines; the last one of a world counts. No file: none. Raises ConfigError with the number of a bad line."""
    if not path.exists():
        return {}
    found: dict[Key, Line] = {}
    for number, text in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
        try:
            line = json.loads(text)
            found[key(line)] = line
        except (ValueError, KeyError, TypeError) as error:
            raise ConfigError(f"{path}: line {number}: not a result of a world: {error}") from error
    return found


def write(path: Path, lines: Iterable[Line]) -> None:
    """Replace the file, whole or not at all; sorted, so that a version control shows what changed."""
    ordered = sorted(lines, key=lambda line: (line["suite"], line["method"], line["seed"]))
    write_text(path, "".join(json.dumps(line, sort_keys=True) + "\n" for line in ordered))


def sources(parts: Iterable[str]) -> str:
    """Hash of what the source files of these parts of the package do: 16 hexadecimal digits.

    Of Python its syntax tree without docstrings, so that neither a comment nor a word of them makes a line stale.
    """
    total = hashlib.sha256()
    for part in parts:
        root = PACKAGE / part
        files = [root] if root.is_file() else sorted(p for p in root.rglob("*") if p.suffix in (".py", ".c"))
        for file in files:
            content = _tree(file.read_text(encoding="utf-8")) if file.suffix == ".py" else file.read_bytes()
            total.update(str(file.relative_to(PACKAGE)).encode() + b"\0" + content)
    return total.hexdigest()[:16]


class _Bare(ast.NodeTransformer):
    """Leaves out strings that stand alone."""

    def visit_Expr(self, node: ast.Expr) -> ast.Expr | None:
        is_text = isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)
        return None if is_text else node


def _tree(text: str) -> bytes:
    """The syntax tree of a module, as this Python writes it."""
    return ast.dump(_Bare().visit(ast.parse(text))).encode()


def stale(line: Line | None, method_sources: str, world_sources: str) -> bool:
    """Whether a world has to be run (again): never run, failed to run, or by other sources."""
    return (
        line is None
        or line.get("error") is not None
        or line["method_sources"] != method_sources
        or line["world_sources"] != world_sources
    )
