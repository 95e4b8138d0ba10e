"""Which recordings are fitted and held out, and which windows of long ones are worth a simulation."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

from compass_ros.cells import Cell, load
from compass_ros.config import CalibrationConfig
from compass_ros.errors import DataError
from compass_ros.selection import evenly, most_windows, split, traits, unlike
from compass_ros.types import Episode, Floats, Track

START = 1_700_000_000_000_000_000
CONFIG = CalibrationConfig(seed=3, held_out_share=0.25)
NOISE = 1e-4


def named(*names: str) -> list[Episode]:
    return [Episode(name, "air_hockey", "", {}, START + i, ()) for i, name in enumerate(names)]


@pytest.fixture(scope="module")
def arm() -> Cell:
    return load("two_joint_arm_driven")


def window(cell: Cell, at: int, rates: Floats, targets: Floats | None = None) -> Episode:
    """A second at 100 Hz: each joint moves evenly, its encoder is noisy, and the targets are where they are told."""
    time_s = np.arange(100) / 100
    stamps = START + at * 1_000_000_000 + np.round(time_s * 1e9).astype(np.int64)
    noise = np.random.default_rng(at).normal(0, NOISE, (100, len(rates)))
    place = np.zeros((100, len(rates))) if targets is None else targets
    return Episode(
        f"window {at}", cell.name, cell.hash, {}, int(stamps[0]),
        (Track(cell.signals[0].name, "joint_position", stamps, np.outer(time_s, rates) + noise),),
        inputs=(Track(cell.spec.inputs[0].name, "joint_position", stamps, place),),
    )  # fmt: skip


def test_the_split_depends_on_names_and_seed_alone() -> None:
    twelve = named(*(f"shot{i}" for i in range(12)))
    fit, held_out = split(twelve, CONFIG)
    assert len(held_out) == 3
    assert sorted(e.name for e in fit + held_out) == sorted(e.name for e in twelve)
    for order in (twelve[::-1], [replace(e, source=f"/elsewhere/{e.name}") for e in twelve]):
        again = split(order, CONFIG)
        assert [[e.name for e in part] for part in again] == [[e.name for e in part] for part in (fit, held_out)]
    others = {tuple(e.name for e in split(twelve, replace(CONFIG, seed=seed))[1]) for seed in range(6)}
    assert len(others) > 3


def test_an_episode_more_leaves_most_of_the_held_out_ones_where_they_are() -> None:
    twelve = named(*(f"shot{i}" for i in range(12)))
    before = {e.name for e in split(twelve, CONFIG)[1]}
    after = {e.name for e in split(twelve + named("another"), CONFIG)[1]}
    assert len(before - after) <= 1


def test_of_too_many_episodes_an_even_choice_is_used() -> None:
    """In the order of recording, whatever the order of names or of the list."""
    many = named(*(f"shot{i % 7}_{i}" for i in range(1000)))
    chosen = evenly(many[::-1], 100)
    at = np.array([e.start_ns - START for e in chosen])
    assert (at[0], at[-1], len(at)) == (0, 999, 100)
    assert set(np.diff(at)) == {10, 11}
    assert evenly(many[:100], 100) == many[:100]
    assert evenly(many, 1) == many[:1]


@pytest.mark.parametrize(("share", "count"), [(0.0, 0), (0.25, 2), (0.5, 4)])
def test_the_share_is_kept(share: float, count: int) -> None:
    eight = named(*(f"shot{i}" for i in range(8)))
    assert len(split(eight, replace(CONFIG, held_out_share=share))[1]) == count


def test_a_single_episode_is_fitted() -> None:
    fit, held_out = split(named("only"), CONFIG)
    assert ([e.name for e in fit], held_out) == (["only"], [])
    with pytest.raises(DataError, match="no episodes"):
        split([], CONFIG)


def test_the_one_fast_window_of_a_slow_hour_is_fitted(arm: Cell) -> None:
    slow = [window(arm, i, np.array([0.1 + 0.001 * (i % 7), 0.1])) for i in range(120)]
    slow[77] = fast = window(arm, 77, np.array([2.0, 0.1]))
    assert fast in unlike(arm, slow, 5)
    assert fast not in evenly(slow, 5)


def test_a_jump_of_the_target_is_a_reason_too(arm: Cell) -> None:
    alike = [window(arm, i, np.array([0.1, 0.1])) for i in range(60)]
    jump = np.where(np.arange(100)[:, None] < 50, 0.0, [0.3, 0.0])
    alike[41] = jumping = window(arm, 41, np.array([0.1, 0.1]), jump)
    assert jumping in unlike(arm, alike, 3)


def test_the_choice_is_within_twice_the_best(arm: Cell) -> None:
    """Gonzalez 1985, beside all choices that there are: how far the farthest window is from those chosen."""
    random = np.random.default_rng(0)
    for count in (2, 3):
        some = [window(arm, i, random.normal(0, 1, 2)) for i in range(9)]
        held = traits(arm, some)
        away = np.linalg.norm(held[:, None] - held[None], axis=2)
        chosen = [some.index(one) for one in unlike(arm, some, count)]
        best = min(away[:, list(choice)].min(axis=1).max() for choice in combinations(range(9), count))
        assert away[:, chosen].min(axis=1).max() <= 2 * best


def test_a_joint_that_is_still_has_no_say(arm: Cell) -> None:
    """Its noise is as far apart as the motion of the other, in shares of its range."""
    still = [window(arm, i, np.array([1.0 + i % 5, 0.0])) for i in range(40)]
    held = traits(arm, still).reshape(40, -1, 3, 2)
    assert not held[:, 0, :, 1].any()
    assert held[:, 0, :, 0].any()


def test_the_choice_depends_on_no_order_and_all_are_taken_where_they_are_few(arm: Cell) -> None:
    random = np.random.default_rng(1)
    some = [window(arm, i, random.normal(0, 1, 2)) for i in range(12)]
    assert unlike(arm, some[::-1], 5) == unlike(arm, some, 5)
    assert unlike(arm, some[::-1], 12) == some
    alike = [replace(some[0], name=f"copy {i}", start_ns=some[0].start_ns + i) for i in range(6)]
    assert len({one.name for one in unlike(arm, alike, 4)}) == 4


def test_numbers_that_were_not_seen_are_no_reason(arm: Cell) -> None:
    some = [window(arm, i, np.array([0.1 + 0.01 * i, 0.1])) for i in range(10)]
    track = some[4].tracks[0]
    blind = replace(some[4], tracks=(replace(track, value=np.where([True, False], np.nan, track.value)),))
    held = traits(arm, [*some[:4], blind, *some[5:]])
    assert np.isfinite(held).all()
    lone = replace(some[4], tracks=(replace(track, stamp_ns=track.stamp_ns[:0], value=track.value[:0]),))
    assert np.isfinite(traits(arm, [*some[:4], lone, *some[5:]])).all()


def test_a_hundred_seconds_of_windows_are_fitted_where_nobody_says_how_many() -> None:
    assert [most_windows(length) for length in (0.5, 2.5, 5.0, 8.0, 60.0)] == [40, 40, 20, 12, 10]
