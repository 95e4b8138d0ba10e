"""Half an hour of full load: images at 90 Hz, poses at 1 kHz, recording while calibrating; `make soak`.

    python scripts/soak.py [--minutes 30] [--prefix "chrt --fifo 20"] [--json soak.json] [--page docs/reliability.md]

Measured are the memory of each node, lost messages, and the time from an image to its poses. The last result is kept as
JSON and shown in the page. Status 1 where a promise is broken.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import shlex
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import rclpy
import yaml
from compass_ros_interfaces.msg import CalibrationStatus
from compass_ros_interfaces.srv import StartEpisode, StopEpisode
from diagnostic_msgs.msg import DiagnosticArray
from domain_coordinator import domain_id
from geometry_msgs.msg import PoseWithCovarianceStamped
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from std_srvs.srv import Trigger

from compass_ros.episodes import Source, read_episode
from compass_ros.nodes.images import stamp_ns
from compass_ros.nodes.qos import LATCHED
from compass_ros.reporting.markdown import markdown_table, replace_between

ROOT = Path(__file__).parents[1]
EPISODE_S, SAMPLE_S, WARM_UP_S = 10.0, 2.0, 20.0
PATIENCE_S = 120.0
"""An answer that takes longer will not come [s]."""
LATENCY_P99_MS, GROWTH_MIB_PER_HOUR = 20.0, 30.0
ARM = "/arm/pose"
PROMPT = ("puck_tracker", "recorder")
TRACKED = [f"/puck_tracker/{name}/pose" for name in ("puck1", "puck2", "pusher")]
BEGIN, END = "<!-- soak: written by scripts/soak.py -->\n", "<!-- /soak -->"


@dataclass
class Heard:
    """What was measured while it ran."""

    latency_ms: list[float] = field(default_factory=list)
    missed_images: int = 0
    calibrations: int = 0
    failed_calibrations: int = 0
    memory: dict[str, list[tuple[float, float]]] = field(default_factory=dict)
    """By node: seconds since the beginning, MiB."""
    bags: list[Path] = field(default_factory=list)
    said: list[str] = field(default_factory=list)
    """What the recorder said about its episodes."""


@contextmanager
def processes(folder: Path, prefix: Sequence[str]) -> Iterator[Mapping[str, subprocess.Popen[str]]]:
    """All nodes, in a DDS domain of their own; ended by SIGINT. `prefix`: before tracker's and recorder's commands."""
    parameters: dict[str, dict[str, Any]] = {
        "puck_tracker": {},
        "recorder": {"directory": str(folder / "bags"), "topics": [*TRACKED, ARM], "depth": 5000},
        "calibrator": {
            "bags": str(ROOT / "bags"),
            "output": str(folder / "calibration"),
            "versions": str(folder / "versions"),
            "rollouts": 2000,
        },
    }
    running: dict[str, subprocess.Popen[str]] = {}

    def start(name: str, *words: str) -> None:
        log = (folder / f"{name}.log").open("w")
        before = prefix if name in PROMPT else ()
        running[name] = subprocess.Popen(
            [*before, sys.executable, *words], stdout=subprocess.PIPE, stderr=log, text=True, start_new_session=True
        )

    for name, own in parameters.items():
        file = folder / f"{name}.yaml"
        file.write_text(yaml.safe_dump({"/**": {"ros__parameters": own}}))
        start(name, "-m", f"compass_ros.nodes.{name}", "--ros-args", *(["--params-file", str(file)] if own else []))
    for role in ("camera", "arm"):
        start(role, str(ROOT / "scripts" / "soak_sources.py"), role)
    try:
        yield running
    finally:
        for process in running.values():
            process.send_signal(signal.SIGINT)
        for process in running.values():
            process.wait(PATIENCE_S)


class Watcher:
    """Listens, records one episode after the other, and starts a calibration whenever none runs."""

    def __init__(self, heard: Heard) -> None:
        self.node = Node("soak")
        self._heard = heard
        self.node.create_subscription(PoseWithCovarianceStamped, TRACKED[0], self._on_pose, qos_profile_sensor_data)
        self.node.create_subscription(DiagnosticArray, "/diagnostics", self._on_diagnostics, 10)
        self.node.create_subscription(CalibrationStatus, "/calibrator/status", self._on_status, LATCHED)
        self._again = self.node.create_client(Trigger, "/calibrator/recalibrate")
        self._start = self.node.create_client(StartEpisode, "/recorder/start_episode")
        self._stop = self.node.create_client(StopEpisode, "/recorder/stop_episode")
        self.measuring = False

    def _on_pose(self, pose: PoseWithCovarianceStamped, info: Mapping[str, int]) -> None:
        if self.measuring:
            self._heard.latency_ms.append(1e-6 * (info["source_timestamp"] - stamp_ns(pose.header.stamp)))

    def _on_diagnostics(self, array: DiagnosticArray) -> None:
        for status in array.status:
            if self.measuring and status.name.endswith("tracking"):
                self._heard.missed_images += int({v.key: v.value for v in status.values}["missed images"])

    def _on_status(self, status: CalibrationStatus) -> None:
        if status.state in (CalibrationStatus.SUCCEEDED, CalibrationStatus.FAILED):
            self._heard.calibrations += status.state == CalibrationStatus.SUCCEEDED
            self._heard.failed_calibrations += status.state == CalibrationStatus.FAILED
            self._again.call_async(Trigger.Request())

    def episode(self, seconds: float, meanwhile: Callable[[], None]) -> None:
        """Record one."""
        self._call(self._start, StartEpisode.Request(cell="soak"))
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            rclpy.spin_once(self.node, timeout_sec=0.1)
            meanwhile()
        answer = self._call(self._stop, StopEpisode.Request())
        self._heard.bags.append(Path(answer.info.bag))
        self._heard.said += [answer.message] if answer.message else []

    def _call(self, client: Any, request: Any) -> Any:
        if not client.wait_for_service(PATIENCE_S):
            raise SystemExit(f"soak: no service {client.srv_name}")
        future = client.call_async(request)
        rclpy.spin_until_future_complete(self.node, future, timeout_sec=PATIENCE_S)
        if future.result() is None or not future.result().success:
            raise SystemExit(f"soak: {client.srv_name}: {future.result()}")
        return future.result()


def resident_mib(pid: int) -> float:
    """Resident memory of a process."""
    return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 2**20


def growth(samples: list[tuple[float, float]]) -> float:
    """MiB an hour: slope over the second half, when everything has been touched once."""
    half = np.array(samples[len(samples) // 2 :])
    return float(np.polyfit(half[:, 0], half[:, 1], 1)[0] * 3600) if len(half) > 2 else float("nan")


def recorded(bags: list[Path]) -> tuple[int, int]:
    """Poses of the arm in all bags, and how many are missing between the first and the last of a bag."""
    found = holes = 0
    for bag in bags:
        numbers = read_episode(bag, [Source(ARM, "arm")]).tracks[0].value[:, 0]
        found += len(numbers)
        holes += int(numbers[-1] - numbers[0]) + 1 - len(numbers)
    return found, holes


def soak(minutes: float, folder: Path, prefix: Sequence[str] = ()) -> dict[str, Any]:
    """Run the load; what was measured."""
    heard = Heard()
    rclpy.init()
    watcher = Watcher(heard)
    with processes(folder, prefix) as running:
        watcher.episode(WARM_UP_S, lambda: None)
        heard.bags.clear()
        heard.said.clear()
        watcher.measuring = True
        begun = time.monotonic()
        nodes = {name: running[name].pid for name in ("puck_tracker", "recorder", "calibrator")}

        def sample() -> None:
            now = time.monotonic() - begun
            for name, pid in nodes.items():
                known = heard.memory.setdefault(name, [])
                if not known or now - known[-1][0] > SAMPLE_S:
                    known.append((now, resident_mib(pid)))

        while (left := begun + 60 * minutes - time.monotonic()) > 0:
            watcher.episode(min(EPISODE_S, max(left, 1.0)), sample)
        watcher.measuring = False
        seconds = time.monotonic() - begun
    rclpy.try_shutdown()
    sent = {role: int((running[role].stdout or sys.stdin).read()) for role in ("camera", "arm")}
    kept, holes = recorded(heard.bags)
    latency = np.array(heard.latency_ms)
    return {
        "minutes": round(seconds / 60, 1),
        "cores": len(os.sched_getaffinity(0)),
        "load_average": round(os.getloadavg()[1], 1),
        "machine": platform.machine(),
        "prefix": " ".join(prefix),
        "images_sent_with_warm_up": sent["camera"],
        "images_tracked": len(latency),
        "images_missed": heard.missed_images,
        "latency_ms": {f"p{q}": round(float(np.quantile(latency, q / 100)), 1) for q in (50, 90, 99)},
        "arm_poses_sent_with_warm_up": sent["arm"],
        "arm_poses_recorded": kept,
        "arm_poses_lost": holes,
        "episodes": len(heard.bags),
        "recorder_said": heard.said[:5],
        "calibrations": heard.calibrations,
        "failed_calibrations": heard.failed_calibrations,
        "memory_mib": {
            name: {"last": round(known[-1][1], 1), "growth_an_hour": round(growth(known), 1)}
            for name, known in heard.memory.items()
        },
    }


def table(result: Mapping[str, Any]) -> str:
    """The result for people."""
    memory = "; ".join(
        f"{name} {m['last']} MiB, {m['growth_an_hour']:+} MiB an hour" for name, m in result["memory_mib"].items()
    )
    rows = {
        "time": f"{result['minutes']} minutes on {result['cores']} cores, load average {result['load_average']}",
        "tracker and recorder started by": f"`{result['prefix']}`" if result["prefix"] else "nothing special",
        "image to poses": ", ".join(f"{name} {ms} ms" for name, ms in result["latency_ms"].items()),
        "images": f"{result['images_tracked']} tracked, {result['images_missed']} missed",
        "poses at 1 kHz": f"{result['arm_poses_recorded']} recorded, {result['arm_poses_lost']} lost",
        "episodes": f"{result['episodes']}; the recorder complained about {len(result['recorder_said'])}",
        "calibrations meanwhile": f"{result['calibrations']} ended well, {result['failed_calibrations']} failed",
        "memory": memory,
    }
    return markdown_table(("", ""), rows.items())


def broken(result: Mapping[str, Any]) -> list[str]:
    """Promises that were not kept."""
    said = []
    if result["latency_ms"]["p99"] > LATENCY_P99_MS:
        said.append(f"latency p99 {result['latency_ms']['p99']} ms, promised are {LATENCY_P99_MS} ms")
    if result["arm_poses_lost"] or result["recorder_said"]:
        said.append(f"the recorder lost messages: {result['arm_poses_lost']} {result['recorder_said']}")
    for name, memory in result["memory_mib"].items():
        if memory["growth_an_hour"] > GROWTH_MIB_PER_HOUR:
            said.append(f"{name} grows by {memory['growth_an_hour']} MiB an hour")
    return said


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--minutes", type=float, default=30.0)
    parser.add_argument("--prefix", default="", help="before the commands of tracker and recorder: 'chrt --fifo 20'")
    parser.add_argument("--json", type=Path, default=ROOT / "docs" / "soak.json")
    parser.add_argument("--page", type=Path, default=ROOT / "docs" / "reliability.md")
    options = parser.parse_args()
    with domain_id() as domain, tempfile.TemporaryDirectory(prefix="soak-") as folder:
        os.environ |= {
            "ROS_DOMAIN_ID": str(domain),
            "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
            "FASTRTPS_DEFAULT_PROFILES_FILE": str(ROOT / "config" / "fastdds.xml"),
        }
        result = soak(options.minutes, Path(folder), shlex.split(options.prefix))
    options.json.write_text(json.dumps(result, indent=1) + "\n")
    if options.page.exists():
        replace_between(options.page, BEGIN, END, table(result) + "\n")
    print(table(result))
    for promise in (promises := broken(result)):
        print(f"BROKEN: {promise}")
    return bool(promises)


if __name__ == "__main__":
    raise SystemExit(main())
