"""A Foxglove layout for a cell: what drives it, what is measured, what the nodes say of it, and their services.

A message path names a place in a list, and the cell names joints: their order in the messages is read from a bag, or
taken to be the cell's. A type that is not known is read from a bag too, or taken to be the usual one of its quantity.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from compass_ros.cells import Cell
from compass_ros.cells.series import InputSpec, SignalSpec
from compass_ros.episodes.sources import default_topic
from compass_ros.episodes.survey import Held
from compass_ros.types import NUMBERS, Quantity

Json = dict[str, Any]
LISTS: Mapping[str, Mapping[str, str]] = {
    "sensor_msgs/msg/JointState": {"position": "position", "velocity": "velocity", "effort": "effort"},
    "trajectory_msgs/msg/JointTrajectory": {
        "position": "points[0].positions", "velocity": "points[0].velocities", "effort": "points[0].effort",
    },
    "control_msgs/msg/JointTrajectoryControllerState": {
        "position": "{part}.positions", "velocity": "{part}.velocities", "effort": "{part}.effort",
    },
}  # fmt: skip
"""Where the numbers of joints are, by type of message."""
BEFORE: Mapping[str, str] = {
    "geometry_msgs/msg/Pose": "",
    "geometry_msgs/msg/PoseStamped": "pose.",
    "geometry_msgs/msg/PoseWithCovarianceStamped": "pose.pose.",
    "nav_msgs/msg/Odometry": "pose.pose.",
    "geometry_msgs/msg/PointStamped": "point.",
    "geometry_msgs/msg/TwistStamped": "twist.",
    "geometry_msgs/msg/WrenchStamped": "wrench.",
    "tf2_msgs/msg/TFMessage": 'transforms[:]{child_frame_id=="NAME"}.transform.',
}
"""What stands before `position`, `linear`, `force` in a message."""
USUAL: Mapping[Quantity, str] = {
    **dict.fromkeys(("joint", "joint_position", "joint_velocity", "joint_effort"), "sensor_msgs/msg/JointState"),
    **dict.fromkeys(("xyz", "pose", "position"), "geometry_msgs/msg/PoseStamped"),
    "xy": "geometry_msgs/msg/PoseWithCovarianceStamped",  # the tracker's
    "scalar": "std_msgs/msg/Float64MultiArray",
    "twist": "geometry_msgs/msg/TwistStamped",
    "wrench": "geometry_msgs/msg/WrenchStamped",
    **dict.fromkeys(("gyro", "accelerometer"), "sensor_msgs/msg/Imu"),
}
FIELDS = {"v": "linear.", "w": "angular.", "f": "force.", "t": "torque."}
"""`vx` is `linear.x`."""
SERVICES = ("recalibrate", "apply", "revert", "next_experiment")


@dataclass(frozen=True)
class Plotted:
    """A series of the cell."""

    name: str
    topic: str
    quantity: Quantity
    of: tuple[str, ...]
    part: str
    drives: bool


def layout(cell: Cell, held: Sequence[Held] = ()) -> Json:
    """The layout as JSON; `held`: what a bag's topics hold."""
    table = cell.spec.dynamics == "air_hockey"
    panels: dict[str, Json] = {"3D!scene": _scene(table)}
    if table:
        image = {"imageTopic": "/puck_tracker/debug_image"}
        panels["Image!tracks"] = {"imageMode": image, "title": "what the tracker sees"}
    for one in _series(cell):
        paths = _paths(one, held)
        kind = "Plot" if paths else "RawMessages"
        title = f"{one.name}: {one.quantity.replace('_', ' ')}{', what drives it' if one.drives else ''}"
        panels[f"{kind}!{one.name}"] = _plot(title, paths) if paths else _raw(one.topic)
    left, right = [*panels], _of_nodes()
    tree = _row(_column(left), _column([*right]), 62)
    shared = {"globalVariables": {}, "userNodes": {}, "playbackConfig": {"speed": 1}}
    return {"configById": {**panels, **right}, **shared, "layout": tree}


def _series(cell: Cell) -> list[Plotted]:
    spec = cell.spec
    objects = [
        Plotted(
            o.name, o.topic or default_topic(o.name, o.quantity), o.quantity, (o.body or o.name,), "feedback", False
        )
        for o in spec.objects
    ]
    return [*(_of(one) for one in spec.inputs), *objects, *(_of(one) for one in spec.signals)]


def _of(one: InputSpec | SignalSpec) -> Plotted:
    drives = isinstance(one, InputSpec)
    topic = one.topic or default_topic(one.name, one.quantity)
    return Plotted(one.name, topic, one.quantity, one.of, one.part or ("reference" if drives else "feedback"), drives)


def _paths(one: Plotted, held: Sequence[Held]) -> list[tuple[str, str]]:
    """Label and message path of each number; empty for a type whose numbers no path can name."""
    there = next((h for h in held if h.topic == one.topic), None)
    kind = there.type if there is not None else USUAL[one.quantity]
    if one.quantity.startswith("joint"):
        order = next((h.names for h in held if h.topic == one.topic and h.quantity.startswith("joint")), one.of)
        return _joints(one, kind, order)
    if one.quantity == "scalar":
        known = kind == USUAL["scalar"]
        return [(name, f"{one.topic}.data[{i}]") for i, name in enumerate(one.of) if known]
    if one.quantity in ("gyro", "accelerometer"):
        field = "angular_velocity" if one.quantity == "gyro" else "linear_acceleration"
        return [(axis, f"{one.topic}.{field}.{axis}") for axis in "xyz" if kind == USUAL["gyro"]]
    if kind not in BEFORE:
        return []
    before = BEFORE[kind].replace("NAME", one.of[0] if one.of and not one.drives else one.name)
    used = one.of if one.drives and one.of else NUMBERS[one.quantity]
    return [(name, f"{one.topic}.{before}{_field(name, kind)}") for name in used]


def _joints(one: Plotted, kind: str, order: Sequence[str]) -> list[tuple[str, str]]:
    """Empty where the messages have not all of them."""
    quantity = "position" if one.quantity == "joint" else one.quantity.removeprefix("joint_")
    field = LISTS.get(kind, {}).get(quantity)
    if field is None or not set(one.of) <= set(order):
        return []
    return [(name, f"{one.topic}.{field.format(part=one.part)}[{order.index(name)}]") for name in one.of]


def _field(name: str, kind: str) -> str:
    """`x` of a pose, `qw`, `vx`, `fz` as a field."""
    transform = kind == "tf2_msgs/msg/TFMessage"
    if len(name) == 1:
        return (
            name if kind == "geometry_msgs/msg/PointStamped" else f"{'translation' if transform else 'position'}.{name}"
        )
    if name.startswith("q"):
        return f"{'rotation' if transform else 'orientation'}.{name[1]}"
    return f"{FIELDS[name[0]]}{name[1]}"


def _plot(title: str, paths: Sequence[tuple[str, str]], stamp: str = "headerStamp") -> Json:
    shown = [{"value": path, "enabled": True, "timestampMethod": stamp, "label": label} for label, path in paths]
    return {"title": title, "paths": shown, "showLegend": True, "followingViewWidth": 10, "isSynced": True}


def _raw(path: str) -> Json:
    return {"topicPath": path, "diffEnabled": False}


def _scene(table: bool) -> Json:
    """The table from above; else the robot as its description says, and what else there is in space."""
    grid = {"layerId": "foxglove.Grid", "instanceId": "grid", "size": 1, "divisions": 10, "visible": True, "order": 1}
    shown: Json = {"/calibrator/markers": {"visible": True}}
    if table:
        camera = {"perspective": False, "distance": 1.4, "phi": 0, "thetaOffset": 90, "targetOffset": [0, 0, 0]}
        above = {"target": [0, 0, 0], "targetOrientation": [0, 0, 0, 1], "fovy": 45, "near": 0.01, "far": 100}
        shown |= {
            "/puck_tracker/markers": {"visible": True},
            "/calibrator/mismatch_map": {"visible": True, "colorMode": "costmap"},
        }
        layers: Json = {"grid": {**grid, "label": "table, 0.1 m", "frameId": "table"}}
        scene: Json = {"cameraState": camera | above, "followTf": "table", "followMode": "follow-none"}
    else:
        robot = {"layerId": "foxglove.Urdf", "instanceId": "robot", "label": "robot", "sourceType": "topic"}
        layers = {"grid": grid, "robot": {**robot, "topic": "/robot_description", "visible": True, "order": 2}}
        scene = {"followMode": "follow-none"}
    ground = {"enableStats": False, "backgroundColor": "#14161a"}
    return {**scene, "scene": ground, "layers": layers, "topics": shown}


def _of_nodes() -> dict[str, Json]:
    """Panels of what recorder and calibrator say, and the calibrator's services."""
    status = [("gap", "/calibrator/status.gap"), ("done", "/calibrator/status.share_done")]
    health = {"minLevel": 0, "topicToRender": "/diagnostics", "hardwareIdFilter": "", "sortByLevel": True}
    call = {"requestPayload": "{}", "layout": "vertical"}
    return {
        "DiagnosticSummary!health": health,
        "Plot!calibration": _plot("trajectory difference and share done", status, "receiveTime"),
        "RawMessages!verdict": _raw("/calibrator/mismatch.sentence"),
        "RawMessages!episode": _raw("/recorder/status"),
        **{f"CallService!{name}": {"serviceName": f"/calibrator/{name}", **call} for name in SERVICES},
    }


def _row(first: Any, second: Any, share: float) -> Json:
    return {"direction": "row", "first": first, "second": second, "splitPercentage": share}


def _column(ids: Sequence[str]) -> Any:
    """One above the other; plots, and what takes little room, two in a row."""
    wide = [ids[0]] if len(ids) % 2 else []
    rest = ids[len(wide) :]
    rows = [*wide, *(_row(one, other, 50) for one, other in zip(rest[::2], rest[1::2], strict=True))]
    tree: Any = rows[-1]
    for above, row in enumerate(reversed(rows[:-1]), start=1):
        tree = {"direction": "column", "first": row, "second": tree, "splitPercentage": round(100 / (above + 1), 1)}
    return tree
