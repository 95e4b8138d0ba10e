"""The answers are whole, and a verdict is worth what the page says."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest
from pydantic import TypeAdapter

from compass_ros.cells import load
from compass_ros.errors import ConfigError
from compass_ros.real.answers import ANSWERS, Entry, mark, read_answers
from compass_ros.simulation.effects import EFFECTS

ENTRIES, _ = read_answers()


def entry_of(right: list[list[str]], kind: str, **also: object) -> Entry:
    about = {"name": "n", "kind": "k", "tables": "t", "recordings": ["*"], "cell": "ball_drop", "source": "s"}
    return TypeAdapter(Entry).validate_python({**about, "right": right, "class": [kind], **also})


DRAG = entry_of([["drag"], ["drag", "scale"]], "wind")
HEAVY = entry_of([[]], "scale")
DRY = entry_of([["dry"]], "sticks", within={"dry.size": [1, 2]})


def said(verdict: str, *laws: str, also: Mapping[str, float] | None = None, size: float = 1.5) -> dict[str, Any]:
    """The `mismatch` of a result. `also`: probabilities of explanations, their laws joined by +."""
    effects = [{"name": law, "parameters": {"size": {"value": size}}} for law in laws]
    rows = (also or {}).items()
    explanations = [{"laws": [{"name": law} for law in names.split("+") if law], "probability": p} for names, p in rows]
    return {"verdict": verdict, "effects": effects, "explanations": explanations}


@pytest.mark.parametrize(
    ("entry", "mismatch", "worth"),
    [
        (DRAG, said("named", "drag"), "right"),
        (DRAG, said("named", "scale", "drag"), "right"),
        (DRAG, said("named", "wind"), "class"),
        (DRAG, said("named", "scale"), "wrong"),
        (DRAG, said("named", "drag", "wind"), "wrong"),
        (DRAG, said("none"), "wrong"),
        (DRAG, said("unknown"), "unknown"),
        (DRAG, said("fit_failed"), "no verdict"),
        (DRAG, said("not_evaluated"), "no verdict"),
        (DRAG, said("ambiguous", "scale", also={"scale": 0.6, "drag": 0.4}), "class"),
        (DRAG, said("ambiguous", "scale", also={"scale": 0.97, "drag": 0.03}), "wrong"),
        (HEAVY, said("none"), "right"),
        (HEAVY, said("named", "scale"), "class"),
        (HEAVY, said("named", "drag"), "wrong"),
        (HEAVY, said("ambiguous", "drag", also={"": 0.4, "drag": 0.6}), "class"),
        (DRY, said("named", "dry"), "right"),
        (DRY, said("named", "dry", size=3.0), "class"),
        (DRY, said("named", "sticks"), "class"),
    ],
)
def test_what_a_verdict_is_worth(entry: Entry, mismatch: dict[str, Any], worth: str) -> None:
    assert mark(entry, mismatch) == worth


def test_six_kinds() -> None:
    assert len({entry.kind for entry in ENTRIES.values()}) == 6


@pytest.mark.parametrize("entry", ENTRIES.values(), ids=ENTRIES)
def test_an_answer_speaks_of_what_there_is(entry: Entry) -> None:
    """Laws of the library, a cell that loads, tables that are described, ranges of quantities of a right law."""
    load(entry.cell)
    assert (ANSWERS.parent / "import" / f"{entry.tables}.yaml").is_file()
    laws = {law for laws in entry.right for law in laws}
    assert {*laws, *entry.of_class} <= set(EFFECTS)
    for name in entry.within:
        law, _, quantity = name.partition(".")
        assert law in laws
        assert quantity in {q.name for q in EFFECTS[law].quantities}
    assert len(entry.source) > 20 or entry.source.startswith("as for")


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("name: so101", "nome: so101", r"entries\.7\.name: Field required"),
        ("right: [[]]", "right: 3", r"entries\.\d\..*right.*found 3"),
        ("cell: cube_toss\n", "cello: cube_toss\n", r"entries\.0\.cell"),
        ("[0.26, 0.32]", "[low]", r"entries\.\d\..*within"),
        ("entries:", "entrys:", "entrys"),
    ],
)
def test_a_mistake_in_the_answers_is_one_line(old: str, new: str, expected: str, tmp_path: Path) -> None:
    path = tmp_path / "league.yaml"
    path.write_text(ANSWERS.read_text(encoding="utf-8").replace(old, new), encoding="utf-8")
    with pytest.raises(ConfigError, match=expected) as caught:
        read_answers(path)
    assert "\n" not in str(caught.value)


def test_the_hash_is_that_of_the_file(tmp_path: Path) -> None:
    path = tmp_path / "league.yaml"
    path.write_text(ANSWERS.read_text(encoding="utf-8") + "\n", encoding="utf-8")
    assert read_answers(path)[1] != read_answers()[1]
