"""A whole world: repeatable, as strong as asked for, with the answer that belongs to its bags."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from compass_ros.concealed import world as whole
from compass_ros.concealed.laws import KNOWN, OUTSIDE
from compass_ros.concealed.recording import NOISES, episodes
from compass_ros.concealed.shots import FARTHEST, NEAREST, choose_shots
from compass_ros.concealed.world import ODDS, Wishes, World, _kind, conceal
from compass_ros.errors import ConfigError
from compass_ros.types import Episode, Floats
from test.concealed.scene import INPUTS, cell

ASKED_M = 2e-3


@pytest.fixture(scope="module", autouse=True)
def six_shots() -> Iterator[None]:
    """Half of a world's shots: the same code in half of the time. Whole worlds: test_sealed_set."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(whole, "SHOTS", 6)
        yield


def sure(wishes: Wishes) -> World:
    return conceal(cell(), wishes)


@pytest.fixture(scope="module")
def tilted() -> World:
    return sure(Wishes(3, noise="none", rms_m=ASKED_M, names=("table_tilt",)))


@pytest.fixture(scope="module")
def untouched() -> World:
    return sure(Wishes(3, noise="none", kind="none"))


def positions(episode: Episode) -> Floats:
    return np.concatenate([track.value for track in episode.tracks], axis=1)


def effects(world: World) -> Any:
    return world.answer["effects"]


@pytest.mark.nightly
def test_the_same_seed_gives_the_same_bits(tilted: World) -> None:
    again = sure(Wishes(3, noise="none", rms_m=ASKED_M, names=("table_tilt",)))
    assert again.answer == tilted.answer
    for one, other in zip(again.episodes, tilted.episodes, strict=True):
        np.testing.assert_array_equal(positions(one), positions(other))
        assert one.action == other.action


@pytest.mark.nightly
def test_an_effect_is_as_strong_as_asked_and_moves_more_before_parameters_swallow_it(tilted: World) -> None:
    (effect,) = effects(tilted)
    assert effect["rms_m"] == pytest.approx(ASKED_M, rel=0.06)
    assert effect["rms_before_m"] > effect["rms_m"]
    tilts = effect["library"]
    assert np.hypot(tilts["tilt_x"], tilts["tilt_y"]) == pytest.approx(1e-3 * effect["size"], rel=0.15)


@pytest.mark.nightly
def test_a_world_with_and_without_an_effect_differ_by_the_effect_alone(tilted: World, untouched: World) -> None:
    """Same parameters, shots and frames; what differs is what the answer says."""
    assert tilted.answer["parameters"] == untouched.answer["parameters"]
    gaps = []
    for one, other in zip(tilted.episodes, untouched.episodes, strict=True):
        assert one.action == other.action
        np.testing.assert_array_equal(one.tracks[0].stamp_ns, other.tracks[0].stamp_ns)
        after = one.tracks[0].stamp_ns >= one.start_ns
        gaps.append((positions(one) - positions(other))[after])
    moved = float(np.sqrt(np.mean(np.concatenate(gaps) ** 2) * 2))
    assert moved == pytest.approx(effects(tilted)[0]["rms_before_m"], rel=0.05)
    assert effects(untouched) == []
    assert untouched.answer["kind"] == "none"


@pytest.mark.slow
def test_parameters_are_wrong_within_their_half_widths(untouched: World) -> None:
    found: Any = untouched.answer["parameters"]
    shares = [(found[p.name] - p.default) / p.half_width for p in cell().parameters]
    assert max(np.abs(shares)) <= 1 + 1e-9
    assert np.std(shares) > 0.3
    assert all(p.low <= found[p.name] <= p.high for p in cell().parameters)


@pytest.mark.nightly
def test_what_a_finer_clock_leaves_after_the_parameters_is_small(untouched: World) -> None:
    numerics: Any = untouched.answer["numerics_rms_m"]
    assert numerics < 0.3e-3


@pytest.mark.nightly
@pytest.mark.parametrize("rms_m", [ASKED_M, 6e-3])  # 6 mm are 56 ms: much more than a small step can tell
def test_latency_of_the_camera_and_delay_of_the_arm_are_twins(rms_m: float) -> None:
    (effect,) = effects(sure(Wishes(5, names=("camera_latency",), rms_m=rms_m)))
    assert effect["twins"]["actuation_delay"] > 0.99
    assert effect["channels_right"] == ["actuation", "sensing"]


@pytest.mark.nightly
def test_shots_start_where_the_arm_can_and_are_unlike() -> None:
    own = cell()
    shots = choose_shots(own, own.defaults, 12, np.random.default_rng(0))
    low, high = own.reach.T
    assert np.all((shots >= low) & (shots <= high))
    away = np.linalg.norm(shots[:, :2] - np.array([-0.15, 0.0]), axis=1)
    assert away.min() > NEAREST
    assert away.max() < FARTHEST
    assert np.ptp(shots[:, 3]) > 0.4
    sides = np.sign(shots[:, :2] - np.array([-0.15, 0.0]))
    assert len(np.unique(sides, axis=0)) >= 3


def test_kinds_come_with_their_odds() -> None:
    kinds = [_kind(Wishes(0), np.random.default_rng([seed, 0])) for seed in range(4000)]
    for kind, odds in ODDS.items():
        assert kinds.count(kind) / len(kinds) == pytest.approx(odds, abs=0.025)


@pytest.mark.parametrize(
    ("names", "kind"), [(("swirl",), "one"), (("swirl", "magnus"), "two"), (("ring_bump",), "outside")]
)
def test_names_decide_the_kind(names: tuple[str, ...], kind: str) -> None:
    assert _kind(Wishes(0, names=names), np.random.default_rng(0)) == kind
    assert set(names) <= {*KNOWN, *OUTSIDE}


@pytest.mark.parametrize(
    "wishes", [Wishes(0, noise="pink"), Wishes(0, names=("a_ghost",)), Wishes(0, names=("swirl",) * 3)]
)
def test_what_no_world_can_hold_is_refused(wishes: Wishes) -> None:
    with pytest.raises(ConfigError, match=r"known: |may hold: |two effects at most"):
        sure(wishes)


def recorded(noise: str, frames: int = 4000) -> tuple[list[Episode], dict[str, float], Floats]:
    """Pucks that stand still, for a long time."""
    time = np.tile(-0.25 + np.arange(frames) / 60, (len(INPUTS), 1))
    where = np.zeros((len(INPUTS), frames, 4))
    return (*episodes(cell(), INPUTS, time, where, NOISES[noise], np.random.default_rng(0)), time)


def test_white_noise_is_one_millimetre_on_every_coordinate() -> None:
    found, floor, _ = recorded("white")
    noise = positions(found[0])
    np.testing.assert_allclose(noise.std(axis=0), 1e-3, rtol=0.05)
    assert abs(np.corrcoef(noise[1:, 0], noise[:-1, 0])[0, 1]) < 0.05
    np.testing.assert_allclose(list(floor.values()), 2**0.5 * 1e-3, rtol=0.05)
    assert len(found[0].tracks[0].stamp_ns) == 4000


def test_a_tracker_s_noise_is_correlated_jittered_wild_and_gappy() -> None:
    found, _, time = recorded("tracker")
    track = found[0].tracks[0]
    assert len(track.stamp_ns) == pytest.approx(0.97 * 4000, rel=0.02)
    assert np.all(np.diff(track.stamp_ns) > 0)
    core = track.value[np.abs(track.value[:, 0]) < 3.5e-3, 0]
    assert np.corrcoef(core[1:], core[:-1])[0, 1] == pytest.approx(0.6, abs=0.08)
    assert np.mean(np.linalg.norm(track.value, axis=1) > 6e-3) == pytest.approx(0.007 * 0.75, abs=0.003)
    nominal = np.round(time[0] * 1e9) + found[0].start_ns
    late = track.stamp_ns[:, None] - nominal
    jitter = late[np.arange(len(track.stamp_ns)), np.abs(late).argmin(axis=1)]
    assert np.std(jitter) == pytest.approx(1.5e6, rel=0.1)


def test_there_are_still_frames_before_the_command() -> None:
    found, _, _ = recorded("white", frames=165)
    before = found[0].tracks[0].stamp_ns < found[0].start_ns
    assert before.sum() == 15
