"""The calibrator's parameters, and what a goal asks for where it leaves them in force."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from compass_ros_interfaces.action import Calibrate
from rcl_interfaces.msg import FloatingPointRange, IntegerRange

from compass_ros.calibration.methods import method
from compass_ros.cells import load
from compass_ros.episodes import find_each
from compass_ros.errors import ConfigError, shown
from compass_ros.nodes.job import FALSE_ALARM, Request
from compass_ros.nodes.managed import ManagedNode
from compass_ros.nodes.requests import checked_output, checked_paths, wrong_text


def declare_calibrator(node: ManagedNode) -> None:
    """All parameters; a value that makes no sense is refused when it is set."""
    natural = [IntegerRange(from_value=0, to_value=2**63 - 1, step=1)]
    declare = node.declare_described
    # One path is accepted where a list is expected, hence the dynamic type.
    paths = "paths of bags, or of folders that hold bags: one, or a list; empty: only what the recorder finishes"
    declare("bags", "", paths, _wrong_bags, dynamic_typing=True)
    declare("seed", 0, "seed of all random numbers", integer_range=natural)
    declare("rollouts", 0, "budget of simulated rollouts [count]; 0: the method's default", integer_range=natural)
    declare("method", "default", "as `compass calibrate --method`", _wrong_method)
    rate = "probability of a verdict other than `none` where nothing is missing, as `compass calibrate --false-alarm`"
    limits = [FloatingPointRange(from_value=1e-4, to_value=0.49)]
    declare("verdict_false_alarm", FALSE_ALARM, rate, floating_point_range=limits)
    newest = "of the episodes that the recorder finishes, only so many of the newest are read; of more than 100 "
    newest += "a calibration uses an even choice of 100"
    declare("newest", 100, newest, integer_range=[IntegerRange(from_value=1, to_value=10_000, step=1)])
    declare("calibrate_at_start", True, "calibrate when the node becomes active, if `bags` names any")
    declare("resume", True, "calibrate anew when the node was killed in a calibration; false: only say so")
    node.declare_fixed("cell", "air_hockey", "name of a cell, or path of its YAML", wrong_text)
    frame = "frame of positions in the cell; a cell that tracks joints has none"
    node.declare_fixed("frame", "table", frame, wrong_text)
    node.declare_data_dir()
    output = "folder of the result; an earlier result there is replaced when the new one is complete. Goals of the "
    output += "action may name other folders beside it, or deeper; empty: `calibration` in data_dir"
    node.declare_fixed("output", "", output, wrong_text)
    versions = "folder of the versions of the parameters that a person has applied; empty: `versions` in data_dir"
    node.declare_fixed("versions", "", versions, wrong_text)
    node.declare_fixed("running_check", True, "compare each new episode with the simulator in force")
    rate = "the running check: probability of ever asking for a calibration though nothing has changed"
    limits = [FloatingPointRange(from_value=1e-6, to_value=0.5)]
    node.declare_fixed("false_alarm", 0.01, rate, floating_point_range=limits)


def bags_of(node: ManagedNode) -> tuple[str, ...]:
    """The paths that the parameter `bags` names."""
    value = node.get_parameter("bags").value
    return tuple(bag for bag in ([value] if isinstance(value, str) else value) if bag)


def output_of(node: ManagedNode) -> Path:
    """Where the result goes, absolute."""
    return node.place("output", "calibration")


def request_of(node: ManagedNode, goal: Calibrate.Goal, recorded: Sequence[str]) -> Request:
    """What a goal asks for; the parameters where it leaves a field empty. `recorded`: bags, the newest last.

    Raises CompassError for a cell that is none, for paths that no process takes, and where there is no bag at all.
    """
    checked_paths(goal)
    newest = recorded[-int(node.get_parameter("newest").value) :]
    paths = tuple(goal.bags) or (*bags_of(node), *newest)
    if not paths:
        raise ConfigError("no bags: name them in the goal or in the parameter `bags`, or record episodes")
    bags = tuple(str(Path(path).expanduser().absolute()) for path in paths)
    output = checked_output(goal.output, output_of(node))
    cell = goal.cell or node.get_parameter("cell").value
    load(cell)
    find_each(bags)
    return Request(
        bags=bags,
        cell=cell,
        seed=goal.seed or node.get_parameter("seed").value,
        rollouts=goal.rollouts or node.get_parameter("rollouts").value,
        output=output,
        method=node.get_parameter("method").value,
        false_alarm=node.get_parameter("verdict_false_alarm").value,
    )


def _wrong_bags(value: object) -> str:
    bags = [value] if isinstance(value, str) else value
    if not isinstance(bags, (list, tuple)) or not all(isinstance(bag, str) for bag in bags):
        return f"expected a path or a list of paths, found {shown(value)}"
    return next(filter(None, map(wrong_text, bags)), "")


def _wrong_method(value: str) -> str:
    try:
        method(value)
    except ConfigError as error:
        return str(error)
    return ""
