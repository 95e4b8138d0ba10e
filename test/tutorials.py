"""The code blocks of a page: files by their titles, and commands."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

DOCS = Path(__file__).parents[1] / "docs"
_FILE = re.compile(r"^```\w+ title=\"([^\"]+)\"\n(.*?)^```", re.DOTALL | re.MULTILINE)
_COMMANDS = re.compile(r"^```bash\n(.*?)^```", re.DOTALL | re.MULTILINE)


@dataclass(frozen=True)
class Tutorial:
    """What a reader of a page copies from it."""

    files: dict[str, str]
    commands: tuple[str, ...]
    """In the order of the page, one line each, without comments."""

    def write(self, folder: Path) -> None:
        """The files of the page."""
        for name, content in self.files.items():
            (folder / name).write_text(content, encoding="utf-8")


def tutorial(path: Path) -> Tutorial:
    """What stands in a page."""
    text = path.read_text(encoding="utf-8")
    lines = (line.partition(" #")[0].strip() for block in _COMMANDS.findall(text) for line in block.splitlines())
    return Tutorial(dict(_FILE.findall(text)), tuple(line for line in lines if line and not line.startswith("#")))
