"""What the documents claim: links lead somewhere, commands exist, the Python example runs."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
DOCUMENTS = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md"), ROOT / "bags" / "README.md"])
LINK = re.compile(r"\]\(([^)#\s]+)")
COMMAND = re.compile(r"(?:^|[\s`/])(compass (?:[a-z]+) ?[^`|\n#&\\]*)")


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: path.name)
def test_every_link_leads_to_a_file(path: Path) -> None:
    links = [link for link in LINK.findall(path.read_text("utf-8")) if "://" not in link]
    assert [link for link in links if not (path.parent / link).exists()] == []


def commands() -> list[str]:
    """Names of the subcommands and their options, as the command line itself lists them."""
    found = {line for path in DOCUMENTS for line in COMMAND.findall(path.read_text("utf-8"))}
    return sorted({line.strip().rstrip(".,;:)") for line in found})


def test_every_command_of_the_documents_exists_with_its_options() -> None:
    from typer.main import get_command

    from compass_ros.cli import app

    known = {
        name: {option for parameter in command.params for option in [*parameter.opts, *parameter.secondary_opts]}
        for name, command in get_command(app).commands.items()  # type: ignore[attr-defined]
    }
    assert len(commands()) > 8
    for line in commands():
        _, name, *words = shlex.split(line.replace("'", ""))
        assert name in known, line
        options = {word.partition("=")[0] for word in words if word.startswith("--")} - {"--help"}
        assert options <= known[name], line


@pytest.mark.slow
def test_the_python_example_of_the_readme_runs() -> None:
    (code,) = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text("utf-8"), re.DOTALL)
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=True, capture_output=True, text=True)
    assert "vel_discount" in done.stdout
