"""Messages of joints: numbers by the names in the message, or in the order of the source's own names."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from compass_ros.episodes.columns import Columns, LacksError, Number
from compass_ros.episodes.layout import Layout
from compass_ros.episodes.sources import Source
from compass_ros.errors import BagError
from compass_ros.types import Quantity

JOINT_FIELDS: Mapping[Quantity, str] = {
    "joint": "position",
    "joint_position": "position",
    "joint_velocity": "velocity",
    "joint_effort": "effort",
}
"""What JointState and ros2_control call them."""
_OF_POINT = {"position": "positions", "velocity": "velocities", "effort": "effort"}
"""Fields of a JointTrajectoryPoint."""
_PARTS: Mapping[str, tuple[str, ...]] = {
    "reference": ("reference", "desired"),
    "feedback": ("feedback", "actual"),
    "output": ("output",),
}
"""Fields of a controller's state: as they are called now, and as they were until Humble."""


def joint_state(layout: Layout, source: Source) -> Iterator[Columns]:
    """An array without data is empty, as sensor_msgs/JointState allows."""
    numbers = _beside_names(layout, source, "JointState", "name", _field(source))
    yield Columns(numbers, "header", publisher=layout.texts["header.frame_id"])


def trajectory(layout: Layout, source: Source) -> Iterator[Columns]:
    """A row for each point, at its own time."""
    field = _OF_POINT[_field(source)]
    for i in range(layout.sizes["points"]):
        numbers = _beside_names(layout, source, "JointTrajectory", "joint_names", f"points[{i}].{field}")
        yield Columns(numbers, "header", since=f"points[{i}].time_from_start")


def controller_state(layout: Layout, source: Source) -> Iterator[Columns]:
    """JointTrajectoryControllerState: the part of it that the source names."""
    field = _OF_POINT[_field(source)]
    for part in _PARTS[source.part]:
        if layout.count(f"{part}.{field}"):
            yield Columns(
                _beside_names(layout, source, "controller's state", "joint_names", f"{part}.{field}"), "header"
            )
            return


def interfaces(layout: Layout, source: Source) -> Iterator[Columns]:
    """DynamicJointState: what each interface of a joint says."""
    field, numbers = _field(source), dict[str, Number]()
    for i, name in enumerate(layout.names("joint_names")[: layout.sizes["interface_values"]]):
        at = f"interface_values[{i}]"
        known = layout.names(f"{at}.interface_names")[: layout.count(f"{at}.values")]
        if field in known:
            numbers.setdefault(name, (f"{at}.values", known.index(field)))
    yield Columns(tuple(numbers.get(name) for name in source.wanted), "header")


def dof_states(layout: Layout, source: Source) -> Iterator[Columns]:
    """SingleDOFStateStamped, MultiDOFStateStamped: whichever quantity a PID controller controls."""
    _field(source)
    numbers = {layout.texts[f"{at}.name"]: (f"{at}.{source.part}", 0) for at in _dofs(layout)}
    yield Columns(tuple(numbers.get(name) for name in source.wanted), "header")


def dof_names(layout: Layout) -> Sequence[str]:
    """The degrees of freedom in such a message."""
    return [layout.texts[f"{at}.name"] for at in _dofs(layout)]


def dof_commands(layout: Layout, source: Source) -> Iterator[Columns]:
    """MultiDOFCommand."""
    _field(source)
    yield Columns(_beside_names(layout, source, "MultiDOFCommand", "dof_names", "values"))


def numbers_in_order(layout: Layout, source: Source) -> Iterator[Columns]:
    """Float64MultiArray and its like, and single numbers: the source names them."""
    if source.quantity not in (*JOINT_FIELDS, "scalar"):
        raise LacksError
    count = layout.count("data")
    if count != len(source.wanted):
        raise BagError(f"a message has {count} numbers; expected {len(source.wanted)} ({', '.join(source.wanted)})")
    yield Columns(tuple(("data", i) for i in range(count)))


def _field(source: Source) -> str:
    if source.quantity not in JOINT_FIELDS:
        raise LacksError
    return JOINT_FIELDS[source.quantity]


def _dofs(layout: Layout) -> list[str]:
    many = layout.sizes.get("dof_states")
    return ["dof_state"] if many is None else [f"dof_states[{i}]" for i in range(many)]


def _beside_names(layout: Layout, source: Source, what: str, names_at: str, at: str) -> tuple[Number | None, ...]:
    """Numbers in an array beside an array of names; an empty one says nothing.

    Raises BagError where a joint that is wanted is in one of another length.
    """
    names, count = layout.names(names_at), layout.count(at)
    place = {name: i for i, name in reversed([*enumerate(names)])}
    if not count or not place.keys() & {*source.wanted}:
        return (None,) * len(source.wanted)
    if count != len(names):
        raise BagError(f"a {what} has {len(names)} names and {count} numbers in its {at}")
    return tuple((at, place[name]) if name in place else None for name in source.wanted)
