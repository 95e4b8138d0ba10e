"""Kills a calibrating calibrator with SIGKILL at random moments and looks at what the next start says and leaves.

python -m test.faults.kill_calibrator [TIMES] [SEED]        default: 20 times

Each time: a node calibrates into a folder that holds an earlier result, and is killed, alone, 0 to 8 s after its status
said `running`; its calibration process stays behind as an orphan. The next node must say in its log and in `~/status`
where the calibration was cut off, end the orphan, and leave nothing but the earlier result. After the last kill it is
also told to begin anew, and its result must be, digit by digit, that of a calibration without any kill.
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from compass_ros_interfaces.msg import CalibrationStatus
from domain_coordinator import domain_id

from test.nodes.harness import LATCHED, NodeProcess, Probe, until
from test.nodes.recordings import record

STATUS = "/calibrator/status"
LONGEST_S = 8.0
CUT_OFF = "was cut off"


def orphans(folder: Path) -> list[int]:
    """Processes that calibrate into this folder."""
    found = []
    for process in Path("/proc").glob("[0-9]*"):
        try:
            words = (process / "cmdline").read_bytes()
        except OSError:
            continue
        if b"compass_ros.cli" in words and str(folder).encode() in words:
            found.append(int(process.name))
    return found


def running(status: CalibrationStatus) -> bool:
    return bool(status.state == CalibrationStatus.RUNNING)


def succeeded(status: CalibrationStatus) -> bool:
    return bool(status.state == CalibrationStatus.SUCCEEDED)


def parameters_of(result: Path) -> str:
    """The part of result.json that does not depend on the clock."""
    text = result.read_text()
    return text[text.index('"parameters"') :]


def calibrated(folder: Path, settings: dict[str, object], domain: int) -> NodeProcess:
    """A node that has calibrated to the end."""
    node = NodeProcess("calibrator", folder, settings, ())
    probe = Probe(domain)
    try:
        probe.wait_for(probe.listen(CalibrationStatus, STATUS, LATCHED), succeeded)
    finally:
        probe.close()
    return node


def once(folder: Path, settings: dict[str, object], domain: int, alive_s: float, finish: bool) -> str:
    """Kill one calibration; what the next node says of it. `finish`: that node calibrates anew, to the end."""
    output = Path(str(settings["output"]))
    node = NodeProcess("calibrator", folder, settings, ())
    probe = Probe(domain)
    try:
        probe.wait_for(probe.listen(CalibrationStatus, STATUS, LATCHED), running)
        time.sleep(alive_s)
        node.process.kill()  # the node alone: its calibration lives in a session of its own
        node.process.wait()
    finally:
        probe.close()
        node.kill()
    left = orphans(output.parent)
    node, probe = NodeProcess("calibrator", folder, settings | {"bags": "", "resume": finish}, ()), Probe(domain)
    try:
        heard = probe.listen(CalibrationStatus, STATUS, LATCHED)
        until(lambda: CUT_OFF in node.output(), "a line in the log")
        line = next(line for line in node.output().splitlines() if CUT_OFF in line)
        assert line.endswith("it begins anew" if finish else "it is not resumed"), line
        until(lambda: not set(left) & set(orphans(output.parent)), f"the end of the orphans {left}")
        if finish:
            probe.wait_for(heard, succeeded)
        else:
            probe.wait_for(heard, lambda status: CUT_OFF in status.message)
        names = sorted(path.name for path in output.parent.iterdir())
        assert names == [output.name], f"left behind: {names}"
        return line.partition("calibrator]: ")[2]
    finally:
        probe.close()
        node.kill()


def main(times: int = 20, seed: int = 0) -> None:
    rng = np.random.default_rng(seed)
    with domain_id() as domain, tempfile.TemporaryDirectory() as base:
        os.environ |= {"ROS_DOMAIN_ID": str(domain), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
        folder = Path(base)
        record(folder / "bags", {"puck1@dyna@friction_sliding": 0.1}, shots=4, seed=5)
        output = folder / "out" / "result"
        settings: dict[str, object] = {"bags": str(folder / "bags"), "output": str(output), "rollouts": 600, "seed": 1}
        calibrated(folder, settings, domain).kill()
        expected = parameters_of(output / "result.json")
        for number in range(times):
            alive_s = float(rng.uniform(0, LONGEST_S))
            said = once(folder, settings, domain, alive_s, finish=number == times - 1)
            print(f"{number}: killed after {alive_s:.2f} s: {said}", flush=True)
            assert parameters_of(output / "result.json") == expected, "not the result of a calibration without a kill"
    print(
        f"{times} kills, all said; no orphan, no half result, the earlier result whole, the last one repeated exactly"
    )


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
