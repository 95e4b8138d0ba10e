"""Two publishers of one topic whose clocks differ: the line says what it looks like."""

from __future__ import annotations

import numpy as np
import pytest

from compass_ros.episodes.rows import Rows, Stream
from compass_ros.episodes.sources import Source
from compass_ros.episodes.tracks import tracks
from compass_ros.errors import BagError
from compass_ros.types import Quantity

JOINT = Source("/joint_states", "swing", "joint")


def rows(stamps: list[int], size: int = 1) -> Rows:
    time, n = np.array(stamps, np.int64), len(stamps)
    return Rows(time, time, time, np.ones(n, bool), np.arange(n * size, dtype=float).reshape(n, size), np.zeros(n))


@pytest.mark.parametrize("behind_ms", [1, 20, 500, 10_000, 3_600_000])
def test_stamps_that_go_back_again_and_again(behind_ms: int) -> None:
    stamps = [10**13 + k * 16_000_000 - (k % 2) * behind_ms * 10**6 - (k % 2) * 16_000_000 for k in range(20)]
    with pytest.raises(BagError, match=r"out of order: .*; 10 stamps go back: two publishers on the topic\?"):
        tracks(JOINT, {Stream("", ""): rows(stamps)}, None)


@pytest.mark.parametrize(("quantity", "size"), [("joint", 1), ("xy", 2), ("xyz", 3)])
def test_a_clock_that_is_set_back_once_is_not_two(quantity: Quantity, size: int) -> None:
    stamps = [10**13 + k * 16_000_000 - (k > 9) * 10**9 for k in range(20)]
    with pytest.raises(BagError, match=r"out of order: .* before the one before it$"):
        tracks(Source("/pose", "thing", quantity), {Stream("", ""): rows(stamps, size)}, None)
