"""What every kind of bag holds: topics, messages as bytes, and what there is to say of the bag itself."""

from __future__ import annotations

from dataclasses import dataclass, field

from compass_ros.errors import BagError


class CutOffError(BagError):
    """A file without its end: `compass record --recover` mends it."""


@dataclass(frozen=True)
class RawTopic:
    """A topic of a bag."""

    name: str
    type: str
    """`package/msg/Name`, also for ROS 1; followed by the encoding where it is none of ROS."""
    digest: str = ""
    """Type hash (ROS 1: md5 sum); empty where the bag does not say."""
    ros1: bool = False
    qos: str = field(default="", compare=False)
    """The publishers' QoS profiles as a YAML list; empty where the file does not say."""
    definition: str = field(default="", compare=False, repr=False)
    """Text of the type's definition with its dependencies; empty where the bag does not carry it."""
    encoding: str = field(default="ros2msg", compare=False)
    """Of that text: `ros2msg`, `ros2idl`, `ros1msg`."""
    publisher: str = field(default="", compare=False)
    """Who published, where the bag tells publishers of one topic apart."""


@dataclass(frozen=True)
class RawMessage:
    topic: RawTopic
    log_ns: int
    data: bytes


@dataclass(frozen=True)
class Remark:
    """Something about a bag that whoever uses it should know: one sentence without the bag's name."""

    text: str


def type_name(name: str) -> str:
    """`package/msg/Name` for that and for ROS 1's `package/Name`."""
    return name.replace("/", "/msg/") if name.count("/") == 1 else name


def one_line(error: Exception) -> str:
    """What a library says of a damaged file: at most 200 letters."""
    text = " ".join(str(error).split()) or type(error).__name__
    return text if len(text) <= 200 else f"{text[:197]}..."
