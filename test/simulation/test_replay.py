"""Recorded episodes bound to a simulator: the recorded stamps, missing frames, trajectory differences by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from compass_ros.errors import DataError
from compass_ros.simulation.replay import Replay, recordings
from compass_ros.types import Episode, Floats, Ints, Track
from test.simulation.table import DESCRIBED, cell, simulator, values

START = 1_700_000_000_000_000_000
RATE = 60.0


def stamps(first_s: float = -0.1, last_s: float = 2.6, offset_ns: int = 0) -> Ints:
    """Of a camera at RATE."""
    since = np.round(np.arange(first_s, last_s, 1 / RATE) * 1e9).astype(np.int64)
    return np.asarray(since + START + offset_ns)


def recorded(name: str = "one", action: Floats = DESCRIBED, shift: Floats | None = None) -> Episode:
    """A shot as the simulator plays it, moved by (4,) metres."""
    at = stamps()
    seen = simulator().observe(values(), action[None], (at - START)[None] * 1e-9)[0] + (0 if shift is None else shift)
    tracks = tuple(Track(obj, "xy", at, seen[:, 2 * i : 2 * i + 2]) for i, obj in enumerate(("puck1", "puck2")))
    command = dict(zip(("x", "y", "angle", "velocity"), action.tolist(), strict=True))
    return Episode(name, "air_hockey", "", command, START, tracks)


def bound(*episodes: Episode) -> Replay:
    return Replay(simulator(), recordings(cell(), episodes))


def test_the_same_values_predict_the_recording_at_its_stamps() -> None:
    replay = bound(recorded())
    predicted = replay.predict(values(), np.array([0]))[0]
    measured = replay.data.measured[0]
    assert measured.shape == predicted.shape
    np.testing.assert_allclose(predicted, measured, atol=1e-7)  # stamps are whole nanoseconds
    assert replay.data.time_s[0, 0] == pytest.approx(-0.1)
    assert replay.data.time_s[0].max() <= cell().duration + 1e-6


def test_the_difference_is_the_sum_over_control_steps_of_the_distance() -> None:
    """Puck 1 seen 3-4-5 mm beside, puck 2 1 mm beside, at 51 control steps."""
    replay = bound(recorded(shift=np.array([0.003, 0.004, 0.0, -0.001])))
    found = replay.differences(values(), np.array([0]))[0]
    np.testing.assert_allclose(found, [51 * 0.005, 51 * 0.001], rtol=3e-3)
    gap = replay.gap(values()[0])
    assert gap.d == pytest.approx({"puck1": 51 * 0.005, "puck2": 51 * 0.001}, rel=3e-3)
    assert gap.rmse_m == pytest.approx(np.sqrt((0.005**2 + 0.001**2) / 2), rel=1e-3)


def test_the_difference_of_other_values_is_what_a_loop_gives() -> None:
    replay = bound(recorded("a"), recorded("b", DESCRIBED + np.array([0.005, -0.004, 0.05, -0.05])))
    changed = values({"puck2@dyna@friction_sliding": 0.04})
    found = replay.differences(np.repeat(changed, 2, axis=0), np.array([1, 0]))
    for row, e in zip(found, (1, 0), strict=True):
        seen = simulator().observe(changed, replay.data.inputs[e : e + 1], replay.data.steps_s[None])[0]
        apart = seen - replay.data.at_steps[e]
        by_hand = np.zeros(2)
        for step in range(51):
            by_hand += np.hypot(*apart[step, :2]), np.hypot(*apart[step, 2:])
        np.testing.assert_allclose(row, by_hand, rtol=1e-12)


def test_frames_without_a_puck_are_nan_and_bridged_for_the_difference() -> None:
    whole = recorded()
    hidden = np.ones(len(whole.tracks[0].stamp_ns), bool)
    hidden[20:26] = False
    track = whole.tracks[0]
    gappy = replace(whole, tracks=(Track("puck1", "xy", track.stamp_ns[hidden], track.value[hidden]), whole.tracks[1]))
    replay = bound(gappy)
    missing = np.isnan(replay.data.measured[0])
    assert missing[20:26, :2].all()
    assert missing.sum() == 12
    assert np.isfinite(replay.data.at_steps).all()
    np.testing.assert_allclose(replay.differences(values(), np.array([0])), 0, atol=0.03)
    assert replay.gap(values()[0]).rmse_m < 1e-6


def test_pucks_seen_at_different_moments_keep_their_own_stamps() -> None:
    whole = recorded()
    late = stamps(offset_ns=5_000_000)
    seen = simulator().observe(values(), DESCRIBED[None], (late - START)[None] * 1e-9)[0][:, 2:]
    replay = bound(replace(whole, tracks=(whole.tracks[0], Track("puck2", "xy", late, seen))))
    assert np.isnan(replay.data.measured[0, ::2, 2:]).all()
    assert np.isnan(replay.data.measured[0, 1::2, :2]).all()
    assert replay.gap(values()[0]).rmse_m < 1e-6


def test_short_and_long_recordings_stand_side_by_side() -> None:
    short = recorded("short")
    cut = replace(short, tracks=tuple(Track(t.object, "xy", t.stamp_ns[:60], t.value[:60]) for t in short.tracks))
    replay = bound(recorded("long"), cut)
    assert np.isnan(replay.data.measured[1, 60:]).all()
    assert (replay.data.time_s[1, 60:] == replay.data.time_s[1, 59]).all()
    assert replay.gap(values()[0]).rmse_m < 1e-6


def test_predictions_follow_the_pairs_that_are_asked_for() -> None:
    replay = bound(recorded("a"), recorded("b", DESCRIBED + np.array([0.01, 0, 0, 0])))
    together = replay.predict(values(count=3), np.array([1, 0, 1]))
    np.testing.assert_array_equal(together[0], together[2])
    np.testing.assert_array_equal(together[1], replay.predict(values(), np.array([0]))[0])
    assert np.abs(together[0] - together[1]).max() > 1e-3


def test_what_cannot_be_compared_is_refused() -> None:
    whole = recorded()
    with pytest.raises(DataError, match="no episodes"):
        recordings(cell(), [])
    with pytest.raises(DataError, match=r"one: no track of puck2; has \['puck1'\]"):
        recordings(cell(), [replace(whole, tracks=whole.tracks[:1])])
    with pytest.raises(DataError, match=r"no frames within 2\.5 s"):
        recordings(cell(), [replace(whole, start_ns=START - 10**10)])
    late = Track("puck2", "xy", whole.tracks[1].stamp_ns + 10**10, whole.tracks[1].value)
    with pytest.raises(DataError, match=r"one: puck2 was not seen within 2\.5 s after the command"):
        recordings(cell(), [replace(whole, tracks=(whole.tracks[0], late))])
