"""The documentation as a site, without building it: every page once in the navigation, links, what was generated."""

from __future__ import annotations

import json
import re
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from matplotlib.figure import Figure

from compass_ros.simulation.effects import EFFECTS
from scripts.cli_reference import PAGE, page
from scripts.draw_laws import BEGIN, END, FOLDER, drawn, gallery
from scripts.law_pictures.catalogue import PICTURES
from scripts.site_hooks import BESIDE, within_docs
from test.test_readme import DOCUMENTS

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
SITE = yaml.safe_load((ROOT / "mkdocs.yml").read_text("utf-8"))
ANCHOR = re.compile(r"\]\(([^)\s]*)#([^)\s]+)\)")
HEADING = re.compile(r"^#{1,6} +(.*?) *$", re.MULTILINE)


def pages(entry: Any) -> list[str]:
    """Files of a part of the navigation."""
    if isinstance(entry, str):
        return [entry]
    return [file for one in (entry.values() if isinstance(entry, dict) else entry) for file in pages(one)]


def test_the_navigation_names_every_page_once() -> None:
    assert sorted(pages(SITE["nav"])) == sorted([*(path.name for path in DOCS.glob("*.md")), *BESIDE])
    assert pages(SITE["nav"])[0] == "index.md"


def slugs(path: Path) -> set[str]:
    """Anchors of the headings of a page, as mkdocs and GitHub make them."""
    headings = HEADING.findall(re.sub(r"^```.*?^```", "", path.read_text("utf-8"), flags=re.DOTALL | re.MULTILINE))
    bare = [re.sub(r"[^\w\s-]", "", heading.replace("`", "")).strip().lower() for heading in headings]
    return {re.sub(r"[-\s]+", "-", heading) for heading in bare}


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: path.name)
def test_every_anchor_leads_to_a_heading(path: Path) -> None:
    for target, anchor in ANCHOR.findall(path.read_text("utf-8")):
        if "://" not in target:
            assert anchor in slugs(path.parent / target if target else path), f"{target}#{anchor}"


def test_links_to_the_two_pages_of_the_root_lead_there_in_the_site() -> None:
    assert within_docs("[a](../CHANGELOG.md) [b](docs/method.md#x) [c](many.md)") == (
        "[a](CHANGELOG.md) [b](method.md#x) [c](many.md)"
    )
    for path in DOCS.glob("*.md"):
        assert "](../" not in within_docs(path.read_text("utf-8")), path.name


def test_nothing_is_loaded_from_elsewhere_and_every_tool_is_pinned() -> None:
    assert SITE["theme"]["font"] is False
    assert all((DOCS / sheet).is_file() for sheet in SITE["extra_css"])
    assert "extra_javascript" not in SITE
    for path in DOCUMENTS:
        assert (
            re.findall(r"!\[[^]]*\]\(https?:|<(?:img|script|link|iframe)\b[^>]*https?:", path.read_text("utf-8")) == []
        )
    lines = [line for line in (DOCS / "requirements.txt").read_text().splitlines() if not line.startswith("#")]
    assert all(re.fullmatch(r"[A-Za-z0-9-]+==[0-9.]+", line) for line in lines)


def test_the_reference_of_the_command_line_is_what_it_says() -> None:
    """`python scripts/cli_reference.py` writes it anew."""
    assert PAGE.read_text("utf-8") == page().rstrip("\n") + "\n"


def test_the_reference_of_python_names_what_there_is() -> None:
    names = re.findall(r"^::: ([\w.]+)$", (DOCS / "api.md").read_text("utf-8"), re.MULTILINE)
    assert len(names) > 12
    for name in names:
        module, _, last = name.rpartition(".")
        assert hasattr(import_module(module), last) or import_module(name).__doc__, name


def test_every_law_has_its_line_and_its_picture() -> None:
    """`python -m scripts.draw_laws` draws them anew."""
    assert set(PICTURES) == set(EFFECTS)
    text = (DOCS / "laws.md").read_text("utf-8")
    assert text.split(BEGIN)[1].split(END)[0].strip() == gallery().strip()
    assert {path.stem for path in FOLDER.glob("*.svg")} == set(EFFECTS)
    assert sum(path.stat().st_size for path in FOLDER.iterdir()) < 600_000


@pytest.mark.parametrize("name", ["fan_field", "coulomb_friction", "clock_drift", "first_order_lag", "lens_distortion"])
def test_a_picture_shows_what_the_law_does(name: str) -> None:
    """Drawn, with a line where the law is, and another one where it is not; of a field arrows."""
    axes = Figure().add_subplot()
    drawn(axes, name)
    lines = [np.asarray(line.get_ydata(), dtype=float) for line in axes.lines]
    assert axes.get_xlabel()
    assert axes.collections if name == "fan_field" else not np.array_equal(lines[0], lines[-1])


def test_what_the_page_of_verdicts_quotes_was_said() -> None:
    said = {json.loads(line)["sentence"] for line in (ROOT / "proof" / "foreign.jsonl").read_text().splitlines()}
    quoted = re.findall(r"^> (.*)$", (DOCS / "verdict.md").read_text("utf-8"), re.MULTILINE)
    assert len(quoted) == 3
    assert set(quoted) <= said


def test_five_words_are_our_own_at_most() -> None:
    own = (DOCS / "glossary.md").read_text("utf-8").split("## Our own")[1].split("## The field's")[0]
    assert len(re.findall(r"^\| (?!word|---)", own, re.MULTILINE)) <= 5
