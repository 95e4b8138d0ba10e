"""The job that changes each deciding number finds it where it stands (`python scripts/mutate.py`, nightly)."""

from __future__ import annotations

import pytest

from scripts.mutate import DISCOVERY, MUTATIONS, ROOT, TESTS, Mutation, mutated


@pytest.mark.parametrize("mutation", MUTATIONS, ids=lambda m: m.name)
def test_a_deciding_number_can_be_changed(mutation: Mutation) -> None:
    source = (ROOT / DISCOVERY / mutation.file).read_text(encoding="utf-8")
    changed = mutated(source, mutation)
    assert changed != source
    compile(changed, mutation.file, "exec")


def test_there_are_at_most_ten_of_them_and_the_tests_are_there() -> None:
    assert len(MUTATIONS) <= 10
    assert all((ROOT / "test" / "discovery" / name).is_file() for name in TESTS)
