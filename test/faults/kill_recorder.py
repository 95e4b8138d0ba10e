"""Kills a recording recorder with SIGKILL at random moments and counts what was lost.

    python -m test.faults.kill_recorder [TIMES] [SEED]        default: 200 times

Each time: a recorder of its own process receives poses at 500 Hz over DDS, is killed 0.05 to 1.5 s after the start of
an episode, and its bag is recovered. It must not claim to be whole before, and hold every pose sent earlier than 100 ms
before the kill afterwards.
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from compass_ros_interfaces.srv import StartEpisode
from domain_coordinator import domain_id
from geometry_msgs.msg import PoseWithCovarianceStamped

from compass_ros.episodes import read_episode, recover
from compass_ros.errors import BagError
from test.episodes.planted import PUCK1
from test.nodes.harness import NodeProcess, Probe

RATE_HZ = 500
ALLOWED_LOSS_S = 0.1


def claims_to_be_whole(bag: Path) -> bool:
    try:
        read_episode(bag, PUCK1)
    except BagError as error:
        return "truncated" not in str(error)
    return True


def once(probe: Probe, folder: Path, alive_s: float) -> tuple[int, float, bool]:
    """Poses sent, age at the kill of the oldest pose that was lost [s], and whether the bag claimed to be whole."""
    parameters = {"directory": str(folder / "bags"), "topics": [PUCK1[0].topic], "min_free_mb": 1}
    node = NodeProcess("recorder", folder, parameters, ())
    try:
        publish = probe.publisher(PoseWithCovarianceStamped, PUCK1[0].topic)
        bag = Path(probe.call(StartEpisode, "/recorder/start_episode").bag)
        sent_at: list[float] = []
        begun = time.monotonic()
        while (now := time.monotonic()) < begun + alive_s:
            message = PoseWithCovarianceStamped()
            message.header.stamp.sec, message.header.stamp.nanosec = divmod(10**9 + len(sent_at) * 10**6, 10**9)
            message.pose.pose.position.x = float(len(sent_at))
            publish(message)
            sent_at.append(now)
            time.sleep(max(0.0, begun + len(sent_at) / RATE_HZ - time.monotonic()))
        node.process.kill()
        killed_at = time.monotonic()
        node.process.wait()
    finally:
        node.kill()
    claimed = claims_to_be_whole(bag)
    recover(bag)
    try:
        kept = read_episode(bag, PUCK1).tracks[0].value[:, 0].astype(int).tolist()
    except BagError:
        kept = []  # killed before the first pose
    assert kept == list(range(len(kept))), "a hole in the middle"
    return len(sent_at), killed_at - sent_at[len(kept)] if len(kept) < len(sent_at) else 0.0, claimed


def main(times: int = 200, seed: int = 0) -> int:
    """Returns how often a promise was broken."""
    rng = np.random.default_rng(seed)
    broken = sent = 0
    ages = []
    with domain_id() as domain, tempfile.TemporaryDirectory() as base:
        os.environ |= {"ROS_DOMAIN_ID": str(domain), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
        for number in range(times):
            folder = Path(base, str(number))
            folder.mkdir()
            probe = Probe(domain)
            count, age_s, claimed = once(probe, folder, float(rng.uniform(0.05, 1.5)))
            probe.close()
            sent += count
            ages.append(age_s)
            broken += claimed or age_s > ALLOWED_LOSS_S
            if claimed or age_s > ALLOWED_LOSS_S:
                print(f"{number}: claimed whole: {claimed}; oldest lost pose {age_s * 1e3:.0f} ms before the kill")
    worst, typical = max(ages) * 1e3, float(np.median(ages)) * 1e3
    print(
        f"{times} kills, {sent} poses; oldest lost pose: median {typical:.1f} ms, worst {worst:.1f} ms before the kill"
    )
    print(f"{broken} broken promises")
    return broken


if __name__ == "__main__":
    raise SystemExit(main(*map(int, sys.argv[1:])) > 0)
