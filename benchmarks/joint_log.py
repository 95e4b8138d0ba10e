"""A long log of a fast arm: seven joints at 1 kHz, positions, velocities and efforts, and what they were told.

    python benchmarks/joint_log.py record [--seconds 600] [--buffer 60] [--best-effort]
    python benchmarks/joint_log.py calibrate [--seconds 600] [--bag FOLDER] [--discover]

`record`: published over DDS to the recorder, a process of its own; messages that are not in its bag, its share of a
processor, its memory. In the middle of it the last seconds are saved beside. `calibrate`: the log of a simulated arm
whose parameters are drawn by chance, through `compass calibrate`; time and the most memory of that process.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import signal
import struct
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import yaml

from compass_ros.bench.driven import Routine, drawn_truth, record
from compass_ros.cells import load
from compass_ros.episodes import Source, read_episode, write_episode
from compass_ros.operation.current import sources
from compass_ros.reporting.result_json import read_result
from compass_ros.types import Episode, Track

ROOT = Path(__file__).parents[1]
JOINTS = tuple(f"joint_{i}" for i in range(1, 8))
STATES, COMMANDS = "/joint_states", "/joint_commands"
RATE_HZ = 1000
TICK = os.sysconf("SC_CLK_TCK")
PATIENCE_S = 60.0


def used_s(pid: int) -> float:
    """Processor time of a process so far."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / TICK


def memory_mb(pid: int, which: str) -> float:
    """`VmRSS` now, `VmHWM` at most."""
    lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith(which)) / 1024


@contextmanager
def recorder(folder: Path, buffer_s: int, seconds: float) -> Iterator[subprocess.Popen[bytes]]:
    """The node in a process of its own; ended by SIGINT."""
    parameters = {
        "directory": str(folder / "bags"),
        "topics": ["/joint_*"],
        "buffer_s": buffer_s,
        "max_duration_s": round(seconds) + 60,
        "cell": "kinova3",
    }
    file = folder / "recorder.yaml"
    file.write_text(yaml.safe_dump({"/**": {"ros__parameters": parameters}}))
    words = [sys.executable, "-m", "compass_ros.nodes.recorder", "--ros-args", "--params-file", str(file)]
    process = subprocess.Popen(words, start_new_session=True)
    try:
        yield process
    finally:
        process.send_signal(signal.SIGINT)
        process.wait(PATIENCE_S)


def messages() -> tuple[Callable[[int], bytes], Callable[[int], bytes]]:
    """State and command number n as bytes: stamped now, and n is the first joint's position."""
    from rclpy.serialization import serialize_message
    from sensor_msgs.msg import JointState

    def of(template: JointState) -> Callable[[int], bytes]:
        data = bytearray(serialize_message(template))
        place = data.index(struct.pack("<d", template.position[0]))

        def numbered(number: int) -> bytes:
            struct.pack_into("<iI", data, 4, *divmod(time.time_ns(), 10**9))
            struct.pack_into("<d", data, place, float(number))
            return bytes(data)

        return numbered

    numbers = [0.125 + i for i in range(7)]
    state = JointState(name=list(JOINTS), position=numbers, velocity=numbers, effort=numbers)
    return of(state), of(JointState(name=list(JOINTS), position=numbers))


def published(publish: Callable[[int], None], count: int, halfway: Callable[[], None]) -> float:
    """Publish numbers at RATE_HZ; what is late is sent at once. The longest that one was late [s]."""
    begun, latest = time.monotonic(), 0.0
    for number in range(count):
        late = time.monotonic() - begun - number / RATE_HZ
        if late < 0:
            time.sleep(-late)
        latest = max(latest, late)
        publish(number)
        if number == count // 2:
            halfway()
    return latest


def recording(seconds: float, buffer_s: int, best_effort: bool, folder: Path) -> None:
    """Print what became of a recording."""
    import rclpy
    from compass_ros_interfaces.srv import StartEpisode, StopEpisode
    from domain_coordinator import domain_id
    from rclpy.qos import QoSProfile, qos_profile_sensor_data
    from sensor_msgs.msg import JointState
    from std_srvs.srv import Trigger

    os.environ["FASTRTPS_DEFAULT_PROFILES_FILE"] = str(ROOT / "config" / "fastdds.xml")
    with domain_id() as domain:
        os.environ |= {"ROS_DOMAIN_ID": str(domain), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
        rclpy.init()
        node = rclpy.create_node("arm")
        qos = qos_profile_sensor_data if best_effort else QoSProfile(depth=100)
        publishers = [node.create_publisher(JointState, topic, qos) for topic in (STATES, COMMANDS)]
        with recorder(folder, buffer_s, seconds) as process:
            names = {"start_episode": StartEpisode, "stop_episode": StopEpisode, "save_last": Trigger}
            clients = {name: node.create_client(kind, f"/recorder/{name}") for name, kind in names.items()}
            for client in clients.values():
                assert client.wait_for_service(PATIENCE_S)
            while not all(publisher.get_subscription_count() for publisher in publishers):
                time.sleep(0.1)
            time.sleep(1.0)  # the answers find their way back
            asked = clients["start_episode"].call_async(StartEpisode.Request())
            rclpy.spin_until_future_complete(node, asked)
            bag = asked.result().bag
            state, command = messages()
            waiting: list[rclpy.Future] = []

            def publish(number: int) -> None:
                publishers[0].publish(state(number))
                publishers[1].publish(command(number))

            def halfway() -> None:
                waiting.append(clients["save_last"].call_async(Trigger.Request()))

            count = round(seconds * RATE_HZ)
            before, before_mb = used_s(process.pid), memory_mb(process.pid, "VmRSS")
            latest = published(publish, count, halfway)
            time.sleep(1.0)
            used = used_s(process.pid) - before
            rclpy.spin_until_future_complete(node, waiting[0])
            after_mb, most_mb = memory_mb(process.pid, "VmRSS"), memory_mb(process.pid, "VmHWM")
            asked = clients["stop_episode"].call_async(StopEpisode.Request())
            rclpy.spin_until_future_complete(node, asked)
            said = asked.result()
        node.destroy_node()
        rclpy.shutdown()
    print(f"published: 2 x {count} messages in {seconds:g} s, one at most {1e3 * latest:.0f} ms late")
    for topic in (STATES, COMMANDS):
        found = read_episode(bag, [Source(topic, "joints", "joint_position", of=JOINTS)]).tracks[0].value[:, 0]
        print(f"{topic}: {count - len(np.unique(found))} lost")
    print(f"recorder: {100 * used / seconds:.0f} % of a processor; {before_mb:.0f} MB before, {after_mb:.0f} MB after, "
          f"{most_mb:.0f} MB at most; it says: {said.message or 'nothing'}")  # fmt: skip
    print(f"saved beside: {waiting[0].result().message.partition(': ')[2] or waiting[0].result().message}")
    files = sum(file.stat().st_size for file in Path(bag).glob("*.mcap"))
    print(f"bag: {files / 1e6:.0f} MB")


def log(seconds: float, folder: Path) -> Path:
    """The bag of a driven kinova3: states with velocities and efforts beside the positions, and targets."""
    cell = load("kinova3")
    routine = Routine(seconds=seconds, rate_hz=RATE_HZ, base_hz=1 / seconds, harmonics=8)
    (episode,) = record(cell, drawn_truth(cell, 0), 1, routine, 0)
    (joints,), (target,) = episode.tracks, episode.inputs
    rates = np.gradient(joints.value, 1 / RATE_HZ, axis=0)
    efforts = 100 * (target.value - joints.value)
    beside = [
        Track("rates", "joint_velocity", joints.stamp_ns, rates),
        Track("efforts", "joint_effort", joints.stamp_ns, efforts),
    ]
    whole: Episode = replace(episode, tracks=(joints, *beside))
    places = [Source(STATES, track.object, track.quantity, of=JOINTS) for track in beside]
    return write_episode(whole, folder, [*sources(cell), *places])


def calibrating(seconds: float, folder: Path, bag: Path | None, discover: bool) -> None:
    """Print what a calibration took and how good it is."""
    bag = bag or log(seconds, folder)
    files = sum(file.stat().st_size for file in bag.glob("*.mcap"))
    print(f"{bag.name}: {seconds:g} s, {files / 1e6:.0f} MB", flush=True)
    words = [sys.executable, "-m", "compass_ros.cli", "calibrate", "--cell", "kinova3", "--out", str(folder / "out")]
    words += ["--progress", "none", *([] if discover else ["--no-discover"]), str(bag)]
    begun = time.perf_counter()
    subprocess.run(words, check=True)
    took = time.perf_counter() - begun
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    result = read_result(folder / "out" / "result.json")
    gap = result["gap"]["calibrated"]["fit"]["signals"]["joints"]
    cell = load("kinova3")
    truth = drawn_truth(cell, 0)
    rows = {row["name"]: row for row in result["parameters"]}
    off = [abs(rows[p.name]["value"] - t) / rows[p.name]["std"] for p, t in zip(cell.parameters, truth, strict=True)]
    print(
        f"calibrate: {took:.0f} s, {used.ru_utime + used.ru_stime:.0f} s of processors, {used.ru_maxrss / 1024:.0f} MB "
        f"at most; {len(result['episodes']['used'])} windows; "
        f"{1e3 * gap['rms']:.3f} mrad, {gap['rms'] / gap['floor']:.3f} of the floor; "
        f"90 % intervals hold {100 * np.mean(np.array(off) < 1.645):.0f} %"
    )
    print(json.dumps(result["budget"]))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parts = parser.add_subparsers(dest="part", required=True)
    one, two = parts.add_parser("record"), parts.add_parser("calibrate")
    for part in (one, two):
        part.add_argument("--seconds", type=float, default=600.0)
        part.add_argument("--folder", type=Path, help="where everything is kept; otherwise nothing is")
    one.add_argument("--buffer", type=int, default=60, help="buffer_s of the recorder [s]")
    one.add_argument("--best-effort", action="store_true", help="sensor QoS; otherwise reliable")
    two.add_argument("--bag", type=Path, help="one that was made before")
    two.add_argument("--discover", action="store_true", help="look for missing physics too")
    given = parser.parse_args()
    with TemporaryDirectory() as temporary:
        folder = given.folder or Path(temporary)
        folder.mkdir(parents=True, exist_ok=True)
        if given.part == "record":
            recording(given.seconds, given.buffer, given.best_effort, folder)
        else:
            calibrating(given.seconds, folder, given.bag, given.discover)


if __name__ == "__main__":
    main()
