"""What the pages about a working day say is there: commands, files, services, parameters."""

from __future__ import annotations

import json
import re
import sys
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType

import pytest
import yaml

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "docs" / name for name in ("robot.md", "reliability.md")]


def soak() -> ModuleType:
    spec = spec_from_file_location("soak", ROOT / "scripts" / "soak.py")
    assert spec is not None
    assert spec.loader is not None
    module = module_from_spec(spec)
    sys.modules["soak"] = module
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_files_that_are_named_exist(page: Path) -> None:
    text = page.read_text()
    named = set(re.findall(r"\b(?:test|config|compass_ros|scripts|docs)/[\w/.-]+\.(?:py|yaml|json|md)\b", text))
    assert named
    assert [path for path in named if not (ROOT / path).is_file()] == []
    modules = re.findall(r"python -m ([\w.]+)", text)
    assert [m for m in modules if not (ROOT / (m.replace(".", "/") + ".py")).is_file()] == []


def test_parameters_that_are_named_exist() -> None:
    known: set[str] = set()
    for name in ("puck_tracker", "recorder", "calibrator"):
        content = yaml.safe_load((ROOT / "config" / f"{name}.yaml").read_text())["/**"]["ros__parameters"]
        known |= set(content) | set(content.get("fiducials", {}))
    for name in ("camera_timeout_s", "moved_m", "lost_s", "false_alarm", "resume", "newest", "autostart"):
        assert name in known
        assert any(f"`{name}" in page.read_text() for page in PAGES)


@pytest.mark.ros
def test_the_table_of_the_full_load_is_the_last_result() -> None:
    script = soak()
    result = json.loads((ROOT / "docs" / "soak.json").read_text())
    assert script.table(result) in (ROOT / "docs" / "reliability.md").read_text()


@pytest.mark.ros
def test_a_broken_promise_is_said() -> None:
    script = soak()
    result = json.loads((ROOT / "docs" / "soak.json").read_text())
    good = result | {
        "latency_ms": {"p50": 5.0, "p90": 8.0, "p99": 12.0},
        "arm_poses_lost": 0,
        "recorder_said": [],
        "memory_mib": {"recorder": {"last": 100.0, "growth_an_hour": 1.0}},
    }
    assert script.broken(good) == []
    assert "latency p99 21.0 ms" in script.broken(good | {"latency_ms": {"p99": 21.0}})[0]
    assert "lost messages: 3" in script.broken(good | {"arm_poses_lost": 3})[0]
    grown = {"memory_mib": {"recorder": {"last": 100.0, "growth_an_hour": 99.0}}}
    assert script.broken(good | grown) == ["recorder grows by 99.0 MiB an hour"]
