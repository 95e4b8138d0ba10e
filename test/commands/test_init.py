"""`compass init`, then `compass calibrate`: from a URDF without drives and bags to a report, and nothing edited."""

from __future__ import annotations

import json
import math
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from compass_ros.commands.init import named
from test.starter.recorded import URDF, moved, record, stamps, state

# By the module, so that the sources of this checkout run.
COMPASS = (sys.executable, "-m", "compass_ros.cli")
ENVIRONMENT = os.environ | {"PYTHONPATH": str(Path(__file__).parents[2])}


def compass(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    command = [*COMPASS, *words]
    return subprocess.run(
        command, cwd=folder, env=ENVIRONMENT, capture_output=True, text=True, check=False, timeout=300
    )


def test_a_newcomer_edits_nothing(tmp_path: Path, hear_ctrl_c: None) -> None:
    (tmp_path / "arm.urdf").write_text(URDF.format("panda_joint1", "panda_joint2"))
    for seed in range(3):
        time, target, got = moved(seed, 5.0, 0.02)
        stamp, names = stamps(time, seed), ["joint_1", "joint_2"]
        shown = state("a", "/joint_states", names[::-1], stamp, got[:, ::-1])
        record(tmp_path / "bags", seed, [shown, state("b", "/joint_commands", names, stamp, target)])
    begun = compass(tmp_path, "init", "arm.urdf", "bags", "--out", "cell.yaml")
    assert begun.returncode == 0, begun.stderr
    assert "1 inputs, 1 signals, 11 parameters" in begun.stdout
    assert "2 mesh files are not there" in begun.stderr
    again = compass(tmp_path, "init", "arm.urdf", "bags", "--out", "cell.yaml")
    assert again.returncode == 1
    assert "cell.yaml: is there already" in again.stderr
    assert compass(tmp_path, "init", "arm.urdf", "bags", "--out", "cell.yaml", "--force").returncode == 0
    done = compass(tmp_path, "calibrate", "--cell", "cell.yaml", "--no-discover", "--out", "out", "bags")
    assert done.returncode == 0, done.stderr
    stages = [line.split(",")[0] for line in done.stderr.splitlines() if line.endswith("% done")]
    assert stages == ["screen", "refine", "written"]
    result = json.loads((tmp_path / "out" / "result.json").read_text())
    found = {row["name"]: row for row in result["parameters"]}
    for name, true in (
        ("panda_joint1@actuation@gain", 60.0),
        ("panda_joint2@actuation@gain", 30.0),
        ("panda_joint1@dyna@damping", 4.5),
        ("target@actuation@delay", 0.02),
    ):
        assert found[name]["value"] == pytest.approx(true, rel=0.05), name
    gap = result["gap"]["calibrated"]["held_out"]["signals"]["joints"]
    assert gap["rms"] < 1.2 * max(gap["floor"], 0.0005)
    assert math.isfinite(gap["rms"])
    fitted = min(name.split(" at ")[0] for name in result["episodes"]["used"])
    judged = compass(tmp_path, "evaluate", "out", f"bags/{fitted}")
    assert judged.returncode == 0, judged.stderr
    assert f"{fitted}: fitted, so this is no test" in judged.stderr

    words = ("calibrate", "--cell", "cell.yaml", "--progress", "json", "--out", "out2", "bags")
    for by in (signal.SIGINT, signal.SIGTERM):
        stopped = interrupted(tmp_path, by, *words)
        assert stopped.returncode == 130
        assert stopped.stderr.splitlines()[-1].startswith("stopped; nothing was written")


def interrupted(folder: Path, by: signal.Signals, *words: str) -> subprocess.CompletedProcess[str]:
    """Ended from outside at the first line on standard output."""
    command, pipe = [*COMPASS, *words], subprocess.PIPE
    with subprocess.Popen(command, cwd=folder, env=ENVIRONMENT, text=True, stdout=pipe, stderr=pipe) as process:
        assert process.stdout is not None
        process.stdout.readline()
        process.send_signal(by)
        out, err = process.communicate(timeout=60)
    return subprocess.CompletedProcess(command, process.returncode, out, err)


def test_what_is_wrong_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text("<robot")
    for words in (("init", "gone.xml", "bags"), ("init", "arm.urdf", "bags")):
        done = compass(tmp_path, *words)
        assert done.returncode == 1
        assert len(done.stderr.strip().splitlines()) == 1
        assert words[1] in done.stderr


def test_the_next_command_names_a_whole_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("one", "two", "three"):
        (tmp_path / "bags" / name).mkdir(parents=True)
    assert named(["bags/two/", "bags/one", "bags/three"]) == "bags"
    assert named(["bags/two/", "bags/one"]) == "bags/two/ bags/one"
    assert named(["bags"]) == "bags"
