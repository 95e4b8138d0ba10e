"""Ten small cells drawn at random, of every kind of joint, passive and driven: each ends in a result or in one line.

Their recordings are the scene's own: nothing is missing, and none of them says that something is.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from compass_ros.cells import load
from test.faults.fuzz_cells import attempt
from test.faults.random_cells import SMALL, drawn

pytestmark = pytest.mark.slow

SEEDS = (3, 5, 7, 8, 12, 17, 20, 22, 23, 40)


@pytest.mark.parametrize("seed", SEEDS)
def test_a_cell_ends_in_a_result_or_in_one_line(tmp_path: Path, seed: int) -> None:
    assert attempt(tmp_path, seed, SMALL).verdict in ("none", "refused", "data_bad", "not_evaluated")


def test_the_same_seed_is_the_same_cell(tmp_path: Path) -> None:
    folders = [tmp_path / name for name in ("one", "two")]
    for folder in folders:
        folder.mkdir()
        drawn(folder, 3)
    assert load(folders[0] / "cell.yaml").hash == load(folders[1] / "cell.yaml").hash
