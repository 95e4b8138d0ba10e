"""metadata.yaml of a rosbag2 bag, version 9: written last and at once; its presence says that the bag is whole."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import yaml

from compass_ros.errors import BagError
from compass_ros.plain_yaml import LARGEST, plain_yaml

FILE_NAME = "metadata.yaml"
RECORD_NAME = "rosbag2"
RECORD_KEY = "serialized_metadata"
"""The metadata record of an MCAP file in which rosbag2 keeps what metadata.yaml says, for a file without its folder."""
_KEY = "rosbag2_bagfile_information"


@dataclass(frozen=True)
class TopicCount:
    """One topic of a bag, as its metadata states it."""

    name: str
    type: str
    digest: str
    """Type hash, `RIHS01_...`; empty when not stated."""
    messages: int
    qos: str = ""
    """The publishers' QoS profiles as a YAML list; empty when not known."""
    encoding: str = "cdr"
    """How the messages are serialised."""


@dataclass(frozen=True)
class BagSummary:
    """What metadata.yaml says of a bag. Times are log times [ns]."""

    storage: str
    files: tuple[str, ...]
    start_ns: int
    duration_ns: int
    messages: int
    topics: tuple[TopicCount, ...]


def record_text(summary: BagSummary) -> str:
    """What rosbag2 writes into the MCAP file itself: the content of metadata.yaml without the key around it."""
    return _yaml(_content(summary))


def write_summary(folder: Path, summary: BagSummary) -> None:
    """Write metadata.yaml in one step: a temporary file beside it, renamed when it is complete. Raises OSError."""
    temporary = folder / (FILE_NAME + ".tmp")
    with temporary.open("w", encoding="utf-8") as file:
        file.write(_yaml({_KEY: _content(summary)}))
    temporary.replace(folder / FILE_NAME)


def read_summary(folder: Path) -> BagSummary:
    """Read metadata.yaml of any rosbag2 version. Raises BagError with one line."""
    path = folder / FILE_NAME
    try:
        if path.stat().st_size > LARGEST:
            raise BagError(f"{path}: larger than {LARGEST} bytes; expected a rosbag2 metadata.yaml")
        content = plain_yaml(path.read_text(encoding="utf-8"))
        information = content[_KEY]
        return BagSummary(
            storage=_text(information["storage_identifier"]),
            files=tuple(Path(_text(name)).name for name in information["relative_file_paths"]),
            start_ns=int(information["starting_time"]["nanoseconds_since_epoch"]),
            duration_ns=int(information["duration"]["nanoseconds"]),
            messages=int(information["message_count"]),
            topics=tuple(_topic(entry) for entry in information["topics_with_message_count"]),
        )
    except OSError as error:
        raise BagError(f"{path}: cannot be read: {error.strerror}") from error
    except (yaml.YAMLError, KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
        found = " ".join(str(error).split())[:200]
        raise BagError(f"{path}: expected a rosbag2 metadata.yaml, found {type(error).__name__}: {found}") from error


def is_record(text: str) -> bool:
    """Whether rosbag2 reads this as its metadata record: a YAML mapping with the version at the top."""
    try:
        content = plain_yaml(text)
    except (yaml.YAMLError, ValueError):
        return False
    return isinstance(content, dict) and "version" in content


def _yaml(content: Mapping[str, object]) -> str:
    """As rosbag2 version 9 (Jazzy) has it."""
    return yaml.dump(content, Dumper=_PlainDumper, sort_keys=False, width=1000)


def qos_profiles(text: str) -> list[object]:
    """The profiles in a YAML text as bags hold it; none where the text is something else."""
    try:
        found = plain_yaml(text)
    except (yaml.YAMLError, ValueError):
        return []
    return found if isinstance(found, list) else []


class _PlainDumper(yaml.SafeDumper):
    """Writes the same value twice rather than with an anchor."""

    def ignore_aliases(self, data: object) -> bool:
        return True


def _topic(entry: Mapping[str, object]) -> TopicCount:
    metadata = entry["topic_metadata"]
    if not isinstance(metadata, Mapping):
        raise TypeError("topic_metadata is not a mapping")
    messages = entry["message_count"]
    if not isinstance(messages, int):
        raise TypeError("message_count is not a number")
    digest = _text(metadata.get("type_description_hash") or "")
    return TopicCount(_text(metadata["name"]), _text(metadata["type"]), digest, messages)


def _text(value: object) -> str:
    if not isinstance(value, str):
        raise TypeError(f"expected text, found {type(value).__name__}")
    return value


def _content(summary: BagSummary) -> Mapping[str, object]:
    times = {
        "starting_time": {"nanoseconds_since_epoch": summary.start_ns},
        "duration": {"nanoseconds": summary.duration_ns},
    }
    files: Sequence[object] = [{"path": name, **times, "message_count": summary.messages} for name in summary.files]
    return {
        "version": 9,
        "storage_identifier": summary.storage,
        "duration": times["duration"],
        "starting_time": times["starting_time"],
        "message_count": summary.messages,
        "topics_with_message_count": [_topic_content(topic) for topic in summary.topics],
        "compression_format": "",
        "compression_mode": "",
        "relative_file_paths": list(summary.files),
        "files": files,
        "custom_data": None,
        "ros_distro": "jazzy",
    }


def _topic_content(topic: TopicCount) -> Mapping[str, object]:
    return {
        "topic_metadata": {
            "name": topic.name,
            "type": topic.type,
            "serialization_format": topic.encoding,
            "offered_qos_profiles": qos_profiles(topic.qos),
            "type_description_hash": topic.digest,
        },
        "message_count": topic.messages,
    }
