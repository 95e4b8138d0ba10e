"""Writes docs/cli.md from the command line itself.

python scripts/cli_reference.py
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter
from typer.main import get_command

from compass_ros.cli import app
from compass_ros.config import CalibrationConfig, CompassConfig

PAGE = Path(__file__).parents[1] / "docs" / "cli.md"
HEAD = """# Command line

Every command of `compass`, as `compass COMMAND --help` says it (`python scripts/cli_reference.py` writes this page).
Exit status 0: done; 1: the input is bad, and one line on standard error says which file, what was expected and what was
found; 2: wrong use. The fields of `calibrate --config` stand at [the end](#settings).

"""
SETTINGS = """
## Settings

`compass calibrate --config SETTINGS.yaml` takes any of these; what the file says counts, and not the command line. A
name that is not among them is refused, with the nearest one that is.

    episodes: 24
    windows: 12
    compass: {n_round: 5}

"""


def page() -> str:
    """Markdown: a table of the commands, then a section for each."""
    commands: dict[str, Any] = get_command(app).commands  # type: ignore[attr-defined]
    shown = {name: command for name, command in commands.items() if not command.hidden}
    rows = [f"| [`{name}`](#{name}) | {_first_line(command)} |" for name, command in shown.items()]
    listed = "\n".join(["| command | |", "|---|---|", *rows]) + "\n\n" + "\n".join(map(_section, shown.values()))
    return HEAD + listed + SETTINGS + _settings(CalibrationConfig, "") + _settings(CompassConfig, "compass.")


def _settings(of: type, before: str) -> str:
    """A table of the fields of a configuration."""
    rows = []
    for name, field in TypeAdapter(of).json_schema()["properties"].items():
        default = f"`{json.dumps(field['default'])}`".replace('"', "") if "default" in field else ""
        rows.append(f"| `{before}{name}` | {_cell(field['description'])} | {default} |")
    return "\n".join(["| | | default |", "|---|---|---|", *rows, ""]) + "\n"


def _first_line(command: Any) -> str:
    return _cell((command.help or "").strip().split("\n\n")[0])


def _section(command: Any) -> str:
    words, rows = [], []
    for parameter in command.params:
        if parameter.param_type_name == "option":
            if parameter.hidden:
                continue
            names = "`, `".join([*parameter.opts, *parameter.secondary_opts])
            rows.append(f"| `{names}` | {_cell(parameter.help or '')} | {_default(parameter)} |")
        else:
            word = (parameter.name or "").upper()
            many = "..." if parameter.nargs == -1 else ""
            words.append(f"{word}{many}" if parameter.required else f"[{word}{many}]")
            rows.append(f"| {word} | {_cell(getattr(parameter, 'help', None) or '')} | |")
    text = "\n\n".join(" ".join(part.split()) for part in (command.help or "").split("\n\n"))
    lines = [
        f"## {command.name}",
        "",
        text,
        "",
        f"    compass {' '.join([command.name or '', '[OPTIONS]', *words])}",
        "",
    ]
    return "\n".join([*lines, "| | | default |", "|---|---|---|", *rows, ""]) + "\n"


def _default(option: Any) -> str:
    value = option.default() if callable(option.default) else option.default
    if value is None or value == "" or "Sentinel" in type(value).__name__:
        return "required" if option.required else ""
    if isinstance(value, bool):
        return ("yes" if value else "no") if option.secondary_opts else ""
    return f"`{getattr(value, 'value', value)}`"


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "&#124;")


if __name__ == "__main__":
    PAGE.write_text(page().rstrip("\n") + "\n", encoding="utf-8")
