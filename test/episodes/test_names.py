"""Names of episodes: safe for folders and for ROS, and apart where the texts are."""

from __future__ import annotations

import re
import unicodedata
from itertools import combinations

import pytest

from compass_ros.episodes.names import episode_name, safe_name

TEXTS = (
    "ä", "ö", "a", "o", "投げ1", "投げ2", "1", "2", "бросок", "مقذوف", "Würfe 3", "Wurfe 3", "🎾", "🏀", "_hidden",
    "hidden", ".dot", "-dash", "a..b", "", "x" * 101, "x" * 102, "Ⅷ", "a\udce4", "a\udcf6", "ångström", "angstrom",
)  # fmt: skip


@pytest.mark.parametrize("text", TEXTS)
def test_any_text_becomes_a_name(text: str) -> None:
    found = safe_name(text)
    assert episode_name(found) == found
    assert found == safe_name(text)
    assert re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_.-]*", found)


def test_they_stay_apart() -> None:
    for one, other in combinations(TEXTS, 2):
        assert safe_name(one) != safe_name(other), (one, other)


@pytest.mark.parametrize("text", ["throw_1", "a", "2024-05-01.b", "Bowling_Ball-drop"])
def test_what_is_a_name_already_stays(text: str) -> None:
    assert safe_name(text) == text


def test_letters_stay_readable_and_spaces_become_lines() -> None:
    assert safe_name("drop #1 (left)") == "drop_1_left_"
    assert safe_name("Würfel groß").startswith("Wurfel_gro-")


def test_a_file_has_one_name_however_a_disk_stores_its_accents() -> None:
    assert safe_name(unicodedata.normalize("NFD", "Würfe")) == safe_name(unicodedata.normalize("NFC", "Würfe"))
