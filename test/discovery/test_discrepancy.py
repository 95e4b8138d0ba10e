"""A force that no law has is explained by a process of its own length, in all directions or along the motion."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from compass_ros.discovery.discrepancy import free, spread, spreads
from compass_ros.discovery.sized import sized
from compass_ros.discovery.where import whereabouts
from test.discovery.test_weigh import plain

SHARE = 0.1
"""Of what a wrong length loses, that one of those that are asked may."""


@pytest.mark.parametrize("moving", [False, True])
@pytest.mark.parametrize("memory_s", [0.2, 1.0, 4.0])
def test_a_force_of_any_length_is_nearly_as_probable_as_with_its_own(
    tmp_path: Path, memory_s: float, moving: bool
) -> None:
    response = plain(tmp_path, 0).response
    sizes = 0.1 * response.unit * response.forces
    own = spread(response, sizes, memory_s, moving)
    assert own is not None
    rng = np.random.default_rng(1)
    episodes = len(response.tangent.residual)
    pushed = np.broadcast_to(own.root, (episodes, *own.root.shape[-2:])) @ rng.standard_normal(
        (episodes, own.root.shape[-1], 1)
    )
    moved = (response.tangent.pushes @ pushed)[..., 0]
    tangent = replace(response.tangent, residual=response.tangent.residual + moved)
    wrong = spread(response, sizes, 100.0 if memory_s < 2 else 0.05, moving)
    other = spread(response, sizes, memory_s, not moving)
    true, of_wrong, of_other, *asked = (
        f.log for f in sized(tangent, [own, wrong, other, *spreads(response, sizes)], [1.0])
    )
    assert min(true - of_wrong, true - of_other) > 10
    assert true - max(asked) < SHARE * min(true - of_wrong, true - of_other)


def test_where_no_signal_changes_a_discrepancy_is_one_of_forces(tmp_path: Path) -> None:
    """As of a joint that hangs still: an error of a signal has the size of what moves, and nothing does."""
    response = plain(tmp_path, 0).response
    still = replace(response, unit=response.unit * response.forces)
    found = free(still)
    assert not found.signals
    assert np.isfinite(found.log)
    assert whereabouts(still, found).channel == "dynamics"
