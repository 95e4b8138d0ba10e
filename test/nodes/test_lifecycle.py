"""Tracker, recorder and calibrator as lifecycle nodes, moved by a manager like any other participant."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from compass_ros_interfaces.srv import StartEpisode
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import SetParameters
from std_srvs.srv import Trigger

from test.nodes.conftest import StartNode
from test.nodes.harness import Probe

pytestmark = pytest.mark.ros

CONFIGURE, CLEANUP = Transition.TRANSITION_CONFIGURE, Transition.TRANSITION_CLEANUP
ACTIVATE, DEACTIVATE = Transition.TRANSITION_ACTIVATE, Transition.TRANSITION_DEACTIVATE
OWN_SERVICE = {"puck_tracker": "accept_table", "recorder": "discard_episode", "calibrator": "recalibrate"}


def change(probe: Probe, node: str, transition: int = 0, label: str = "") -> bool:
    request = ChangeState.Request(transition=Transition(id=transition, label=label))
    return bool(probe.call(ChangeState, f"/{node}/change_state", request).success)


def state(probe: Probe, node: str) -> str:
    return str(probe.call(GetState, f"/{node}/get_state").current_state.label)


def services(probe: Probe, node: str) -> set[str]:
    prefix = f"/{node}/"
    return {name.removeprefix(prefix) for name, _ in probe.node.get_service_names_and_types() if prefix in name}


@pytest.mark.parametrize("name", ["puck_tracker", "recorder", "calibrator"])
def test_a_node_goes_through_its_states_and_back(
    name: str, start_node: StartNode, probe: Probe, tmp_path: Path
) -> None:
    own: dict[str, Any] = {"recorder": {"directory": str(tmp_path / "bags"), "min_free_mb": 1}}.get(name, {})
    own |= {"calibrator": {"output": str(tmp_path / "result"), "versions": str(tmp_path / "versions")}}.get(name, {})
    node = start_node(name, autostart=False, **own)
    assert state(probe, name) == "unconfigured"
    assert OWN_SERVICE[name] not in services(probe, name)
    for transition, expected in (
        (CONFIGURE, "inactive"),
        (ACTIVATE, "active"),
        (DEACTIVATE, "inactive"),
        (ACTIVATE, "active"),
        (DEACTIVATE, "inactive"),
        (CLEANUP, "unconfigured"),
        (CONFIGURE, "inactive"),
    ):
        assert change(probe, name, transition)
        assert state(probe, name) == expected
    assert probe.node.create_client(Trigger, f"/{name}/{OWN_SERVICE[name]}").wait_for_service(5)

    # what the state does not allow, and what does not exist, is refused in one line; the node goes on
    for wrong in ({"transition": CONFIGURE}, {"transition": 77}, {"label": "explode"}, {"label": "x\n" * 500}):
        assert not change(probe, name, **wrong)
    assert node.output().count("refused: no transition") == 4
    assert change(probe, name, label="activate")
    assert state(probe, name) == "active"
    assert node.stop() == 0
    assert "Traceback" not in node.output()


def test_a_configuration_that_fails_leaves_a_node_that_can_be_configured(
    start_node: StartNode, probe: Probe, tmp_path: Path
) -> None:
    (tmp_path / "file").write_text("")
    node = start_node("recorder", autostart=False, directory=str(tmp_path / "file" / "bags"), min_free_mb=1)
    assert not change(probe, "recorder", CONFIGURE)
    assert state(probe, "recorder") == "unconfigured"
    assert "cannot be written: Not a directory" in node.output()
    value = ParameterValue(type=ParameterType.PARAMETER_STRING, string_value=str(tmp_path / "bags"))
    request = SetParameters.Request(parameters=[Parameter(name="directory", value=value)])
    assert probe.call(SetParameters, "/recorder/set_parameters", request).results[0].successful
    assert change(probe, "recorder", CONFIGURE)
    (late,) = probe.call(SetParameters, "/recorder/set_parameters", request).results
    assert late.reason == "directory can be changed only while the node is not configured, it is inactive"

    refused = probe.call(StartEpisode, "/recorder/start_episode")
    assert refused.message == "the recorder is inactive; activate it first"
    assert change(probe, "recorder", ACTIVATE)
    assert probe.call(StartEpisode, "/recorder/start_episode").success
    assert not change(probe, "recorder", DEACTIVATE), "an episode is running"
    assert state(probe, "recorder") == "active"
    assert "is being recorded; stop or discard it first" in node.output()
    assert change(probe, "recorder", label="shutdown")
    assert [path.name for path in (tmp_path / "bags" / "episode_0001").iterdir()] == ["episode_0001_0.mcap"]
