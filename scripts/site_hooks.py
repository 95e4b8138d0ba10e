"""What mkdocs does beyond its settings: two files of the root become pages, and links to them and from them lead there.

`docs/` is also read as it is, in a repository's browser; there CHANGELOG.md and CONTRIBUTING.md are one folder up.
"""

from __future__ import annotations

import re
from importlib import import_module
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
BESIDE = ("CHANGELOG.md", "CONTRIBUTING.md")
"""Pages that lie in the root."""


def on_files(files: Any, config: Any) -> Any:
    """Adds the pages of the root."""
    make = import_module("mkdocs.structure.files").File.generated  # mkdocs is in the site's own environment alone
    for name in BESIDE:
        content = within_docs((ROOT / name).read_text("utf-8"))
        files.append(make(config, name, content=content))
    return files


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Links of a page to those of the root."""
    return within_docs(markdown)


def within_docs(markdown: str) -> str:
    """The text with links as they are where all pages lie in one folder."""
    markdown = re.sub(rf"\]\(\.\./({'|'.join(map(re.escape, BESIDE))})", r"](\1", markdown)
    return re.sub(r"\]\(docs/", "](", markdown)


def on_post_page(output: str, **_: Any) -> str:
    """The one script that the theme would load from elsewhere lies in docs/assets."""
    return output.replace("https://unpkg.com/iframe-worker/shim", "assets/iframe-worker.js")


def on_post_template(output_content: str, **_: Any) -> str:
    """The same of pages that are none of ours, as that for what is not found."""
    return on_post_page(output_content)
