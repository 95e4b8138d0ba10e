"""Worlds by other hands know nothing of what will judge them."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

from test.test_layering import PACKAGE, imports

WORLDS = sorted((PACKAGE / "worlds").rglob("*.py"))
JUDGES = ("simulation", "discovery", "calibration", "concealed")
FORBIDDEN = ("mujoco", "robosuite", *(f"compass_ros.{part}" for part in (*JUDGES, "cells", "bench")))


def breaches(tree: ast.AST) -> list[str]:
    return [name for name in imports(tree) if any(f"{name}.".startswith(f"{bad}.") for bad in FORBIDDEN)]


@pytest.mark.parametrize("path", WORLDS, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_a_world_imports_nothing_of_what_judges_it(path: Path) -> None:
    assert breaches(ast.parse(path.read_text(encoding="utf-8"))) == []


def test_the_rule_notices_a_breach() -> None:
    sources = (
        "import mujoco",
        "from compass_ros.simulation import Simulator",
        "import compass_ros.discovery.floor",
        "def f():\n    from compass_ros.cells import load",
        "from mujoco import rollout",
    )
    for source in sources:
        assert len(breaches(ast.parse(source))) == 1


def bodies(path: Path) -> set[str]:
    """Bodies of all functions of two statements or more, without docstrings and without their names of variables."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.FunctionDef):
            body = node.body[1:] if ast.get_docstring(node) else node.body
            if len(body) >= 2:
                found.add("\n".join(_shape(statement) for statement in body))
    return found


def _shape(node: ast.AST) -> str:
    for part in ast.walk(node):
        if isinstance(part, ast.Name):
            part.id = "_"
    return ast.dump(node)


def test_no_function_is_shared_with_what_judges() -> None:
    ours = set().union(*(bodies(path) for path in WORLDS))
    theirs = set().union(*(bodies(path) for part in JUDGES for path in sorted((PACKAGE / part).rglob("*.py"))))
    assert len(theirs) > 100
    assert ours & theirs == set()
