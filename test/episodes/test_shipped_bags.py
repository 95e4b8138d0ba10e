"""The bags in `bags/`: recorded by the nodes, read by this package and by rosbags alike."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from rosbags.highlevel import AnyReader

from compass_ros.episodes import find_bags, read_episodes
from test.episodes.planted import PUCKS

REST = {"puck1": (-0.15, 0.0), "puck2": (-0.075, -0.075)}
"""Where the pucks lie before a shot [m]."""
BIAS = (0.03, -0.02)
"""By how much the camera of these bags is off [m]."""

BAGS = Path(__file__).parents[2] / "bags"


def test_every_episode_is_a_shot_on_the_table() -> None:
    episodes = read_episodes([BAGS], PUCKS, "air_hockey")
    assert len(episodes) == 4
    for episode in episodes:
        assert set(episode.action) == {"x", "y", "angle", "velocity"}
        for track in episode.tracks:
            seconds = (track.stamp_ns - episode.start_ns) * 1e-9
            assert -2 < seconds[0] < 0, "the recorder ran before the shot"
            assert seconds[-1] > 2
            rest = track.value[seconds < 0]
            np.testing.assert_allclose(rest, np.broadcast_to(np.add(REST[track.object], BIAS), rest.shape), atol=0.001)
            assert (np.abs(track.value - BIAS) < (0.45, 0.225)).all()
            assert track.std is not None
            assert (track.std < 0.05).all()


@pytest.mark.parametrize("bag", find_bags([BAGS]), ids=lambda bag: bag.name)
def test_rosbags_reads_them_and_their_hashes_are_right(bag: Path) -> None:
    with AnyReader([bag]) as reader:
        assert sum(1 for _ in reader.messages()) == reader.message_count > 100
