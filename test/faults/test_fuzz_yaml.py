"""A small share of `python -m test.faults.fuzz_yaml`."""

from __future__ import annotations

from pathlib import Path

from test.faults.fuzz_yaml import attempt, prepare


def test_damaged_yaml_is_a_value_or_one_line(tmp_path: Path) -> None:
    prepare(tmp_path)
    before = sorted(path.name for path in Path.cwd().iterdir())
    said = [attempt(tmp_path, seed) for seed in range(50)]
    assert any(said)
    assert not all(said)
    assert sorted(path.name for path in Path.cwd().iterdir()) == before, "no code was run, no file appeared"
