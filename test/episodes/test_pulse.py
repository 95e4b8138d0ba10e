"""Which topic has stopped: seven ways to publish, and what is said of each."""

from __future__ import annotations

import numpy as np
import pytest

from compass_ros.episodes.pulse import Pulse
from compass_ros.types import Floats

RNG = np.random.default_rng(0)


@pytest.mark.parametrize(
    ("times_s", "asked_s", "silent_s"),
    [
        (np.arange(60) / 60, 1.5, None),  # half a second later
        (np.arange(60) / 60, 4.0, 4.0 - 59 / 60),
        (np.arange(40) * 1.0, 45.0, None),  # one a second: six missed
        (np.arange(40) * 1.0, 60.0, 21.0),
        (np.cumsum(RNG.exponential(0.5, 100)), None, None),  # no rhythm: its own longest pause was never ten times
        (np.array([0.1]), 100.0, None),  # a shot
        (np.array([0.0, 5.0, 11.0, 13.0]), 1000.0, None),  # shots of a day
        (np.concatenate([np.arange(20) / 60, 5 + np.arange(20) / 60]), 8.0, 8.0 - (5 + 19 / 60)),  # came back, stopped
    ],
)
def test_a_rhythm_that_ends_is_noticed_and_nothing_else(
    times_s: Floats, asked_s: float | None, silent_s: float | None
) -> None:
    pulse = Pulse()
    for at_s in times_s:
        pulse.beat("/a", round(at_s * 1e9))
    asked_s = times_s[-1] + 2.5 * np.diff(times_s).max() if asked_s is None else asked_s
    found = pulse.stopped(round(asked_s * 1e9))
    assert found == ({} if silent_s is None else {"/a": pytest.approx(silent_s, abs=1e-6)})


def test_topics_are_told_apart_and_forgotten() -> None:
    pulse = Pulse()
    assert not pulse
    for frame in range(300):
        pulse.beat("/steady", frame * 10_000_000)
        if frame < 50:
            pulse.beat("/dies", frame * 10_000_000)
    assert pulse
    assert set(pulse.stopped(3_000_000_000)) == {"/dies"}
    pulse.forget("/dies")
    assert pulse.stopped(3_000_000_000) == {}
