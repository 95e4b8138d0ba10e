"""Messages of poses, velocities, forces, accelerations: numbers with names of their own."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from compass_ros.episodes.columns import Columns, LacksError, MessageKind, Number
from compass_ros.episodes.layout import Layout
from compass_ros.episodes.sources import Source
from compass_ros.types import NUMBERS, Quantity

_AXES: Mapping[str, tuple[str, str]] = {
    **{axis: ("position", axis) for axis in "xyz"},
    **{f"q{axis}": ("orientation", axis) for axis in "wxyz"},
    **{f"v{axis}": ("linear", axis) for axis in "xyz"},
    **{f"w{axis}": ("angular", axis) for axis in "xyz"},
    **{f"f{axis}": ("force", axis) for axis in "xyz"},
    **{f"t{axis}": ("torque", axis) for axis in "xyz"},
    **{f"a{axis}": ("acceleration", axis) for axis in "xyz"},
}
"""What a number is called in a row, and where a message has it: part, field."""
_FRAME = "header.frame_id"


def plain_frame(frame: str) -> str:
    """A frame without the slash that tf of ROS 1 put before it."""
    return frame.lstrip("/")


def of_one(covariance: str = "", **parts: str) -> MessageKind:
    """Messages that hold one thing: the paths of its parts, and of a covariance of its position."""
    return MessageKind(lambda layout, source: iter([_of_one(layout, source, parts, covariance)]))


def of_sensor(unknown: Mapping[Quantity, str] | None = None, **parts: str) -> MessageKind:
    """The same of a sensor, which its frame tells from others; `unknown`: as in Columns, by quantity."""

    def rows(layout: Layout, source: Source) -> Iterator[Columns]:
        found = _of_one(layout, source, parts, unknown=(unknown or {}).get(source.quantity, ""))
        if plain_frame(source.entry) in ("", found.frame):
            yield found

    return MessageKind(rows, lambda layout: [plain_frame(layout.texts[_FRAME])])


def transforms() -> MessageKind:
    """TransformStamped, or a list of them: those of the child that is wanted."""
    return MessageKind(_transforms, lambda layout: [_child(layout, at) for at in _paths(layout)])


def _of_one(
    layout: Layout, source: Source, parts: Mapping[str, str], covariance: str = "", unknown: str = ""
) -> Columns:
    numbers = _numbers(source, parts)
    header = "header" if _FRAME in layout.texts else ""
    frame = plain_frame(layout.texts.get(_FRAME, ""))
    return Columns(numbers, header, frame, covariance=covariance, unknown=unknown)


def _transforms(layout: Layout, source: Source) -> Iterator[Columns]:
    """Any child, where a single transform is asked for none."""
    wanted = plain_frame(source.entry or (source.object if "transforms" in layout.sizes else ""))
    for at in _paths(layout):
        if wanted in ("", _child(layout, at)):
            parts = {"position": f"{at}transform.translation", "orientation": f"{at}transform.rotation"}
            frame = plain_frame(layout.texts[f"{at}{_FRAME}"])
            yield Columns(_numbers(source, parts), f"{at}header", frame)


def _paths(layout: Layout) -> list[str]:
    many = layout.sizes.get("transforms")
    return [""] if many is None else [f"transforms[{i}]." for i in range(many)]


def _child(layout: Layout, at: str) -> str:
    return plain_frame(layout.texts[f"{at}child_frame_id"])


def _numbers(source: Source, parts: Mapping[str, str]) -> tuple[Number, ...]:
    """Where the numbers of a row are; of all that the quantity has, those that are wanted."""
    places = [_AXES[name] for name in source.of or NUMBERS.get(source.quantity, ())]
    if not places or {part for part, _ in places} - {*parts}:
        raise LacksError
    return tuple((f"{parts[part]}.{axis}", 0) for part, axis in places)
