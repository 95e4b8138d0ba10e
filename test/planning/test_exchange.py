"""Choosing shots, against all sets that there are."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from compass_ros.discovery.candidates import Candidate
from compass_ros.planning.exchange import choose, worth
from compass_ros.planning.information import Column, Information
from compass_ros.simulation.effects import EFFECTS, Attached
from compass_ros.types import Floats


def made_up(tangents: Floats) -> Information:
    """(E, D, 1 + 2) tangents of one parameter and of two effects, shot by shot."""
    names = ("viscous_drag", "magnus")
    asked = tuple(Candidate(Attached(EFFECTS[name], ("puck1",))) for name in names)
    columns = tuple(Column(i, 0, c.attached.effect.quantities[0]) for i, c in enumerate(asked))
    gram = tangents.transpose(0, 2, 1) @ tangents
    parameter = EFFECTS["magnus"].quantities[0]
    return Information(asked, columns, Attached(EFFECTS["magnus"], ("puck1",)).parameters()[:1],
                       np.array([parameter.scale]), gram, 1.0)  # fmt: skip


def test_the_choice_is_as_good_as_any_of_all_sets() -> None:
    for seed in range(5):
        rng = np.random.default_rng(seed)
        known = made_up(rng.normal(size=(8, 6, 3)) * rng.uniform(0.1, 3, (8, 1, 1)))
        best = max(worth(known, np.array(shots)) for shots in combinations(range(8), 3))
        found = choose(known, 3)
        assert len(set(found.shots.tolist())) == 3
        assert found.worth == worth(known, found.shots)
        assert found.worth > 0.98 * best


def test_a_shot_that_tells_twins_apart_is_worth_more_than_one_more_of_the_same() -> None:
    same = np.zeros((4, 3))
    same[:, 1:] = 1.0  # both effects look alike
    other = same.copy()
    other[:, 2] *= -1.0
    known = made_up(np.stack([same, same, same, other]))
    assert 3 in choose(known, 2).shots


def test_a_shot_whose_effect_the_parameter_absorbs_is_worth_little() -> None:
    absorbed = np.zeros((4, 3))
    absorbed[:, 0] = 100.0
    absorbed[:, 1] = 5.0
    clear = np.zeros((4, 3))
    clear[:, 1] = 2.0
    known = made_up(np.stack([absorbed, absorbed, clear]))
    assert choose(known, 1).shots.tolist() == [2]
