"""The concealed physics and the library's know nothing of each other; read from the syntax trees."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

from test.test_layering import PACKAGE, imports

CONCEALED = sorted((PACKAGE / "concealed").rglob("*.py"))
LIBRARY = sorted(p for part in ("simulation", "discovery", "calibration") for p in (PACKAGE / part).rglob("*.py"))
FORBIDDEN_HERE = tuple(
    f"compass_ros.{part}"
    for part in ("simulation.effects", "simulation.native", "discovery", "calibration", "pipeline")
)
FORBIDDEN_THERE = ("compass_ros.concealed",)


def breaches(source: str, forbidden: tuple[str, ...]) -> list[str]:
    """Imports of a forbidden module or of something in it, also by name at run time."""
    tree = ast.parse(source)
    texts = [node.value for node in ast.walk(tree) if isinstance(node, ast.Constant) and isinstance(node.value, str)]
    names = [*imports(tree), *texts]
    return [name for name in names if any(name == f or name.startswith(f"{f}.") for f in forbidden)]


@pytest.mark.parametrize("path", CONCEALED, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_concealed_worlds_do_not_import_the_library_s_physics(path: Path) -> None:
    assert breaches(path.read_text(encoding="utf-8"), FORBIDDEN_HERE) == []


@pytest.mark.parametrize("path", [*LIBRARY, PACKAGE / "pipeline.py", PACKAGE / "commands" / "calibrate.py"], ids=str)
def test_the_library_does_not_import_concealed_worlds(path: Path) -> None:
    assert breaches(path.read_text(encoding="utf-8"), FORBIDDEN_THERE) == []


@pytest.mark.parametrize(
    "source",
    [
        "from compass_ros.simulation.effects import EFFECTS",
        "import compass_ros.simulation.native.program",
        "def f():\n    from compass_ros.discovery import discover",
        "import_module('compass_ros.simulation.effects.swirl')",
    ],
)
def test_each_kind_of_breach_is_noticed(source: str) -> None:
    assert len(breaches(source, FORBIDDEN_HERE)) == 1


def test_there_is_something_to_look_at() -> None:
    assert len(CONCEALED) > 15
    assert len(LIBRARY) > 30
