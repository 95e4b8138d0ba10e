"""The metadata record of an MCAP file, decoded as rosbag2 does it (rosbag2_storage/yaml.hpp of Jazzy, version 9).

rosbag2 itself is not on PyPI. Its decoder asks for these keys in this order, each with this type, and throws where one
is missing ("invalid node; first invalid key: version"); keys that it does not know are left alone.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import yaml

_POLICIES = {
    "history": {"keep_last", "keep_all", "system_default", "unknown"},
    "reliability": {"reliable", "best_effort", "system_default", "best_available", "unknown"},
    "durability": {"volatile", "transient_local", "system_default", "best_available", "unknown"},
    "liveliness": {"automatic", "manual_by_topic", "system_default", "best_available", "unknown"},
}


@dataclass(frozen=True)
class Decoded:
    messages: int
    files: tuple[str, ...]
    topics: Mapping[str, tuple[str, int]]
    """Name -> type, messages."""


def decode(text: str) -> Decoded:
    """Raises KeyError or TypeError where rosbag2 throws."""
    node = yaml.safe_load(text)
    if _value(node, "version", int) != 9:
        raise TypeError(f"expected version 9, found {node['version']}")
    _value(node, "storage_identifier", str)
    _value(node["duration"], "nanoseconds", int)
    _value(node["starting_time"], "nanoseconds_since_epoch", int)
    messages = _value(node, "message_count", int)
    topics = {}
    for entry in _value(node, "topics_with_message_count", list):
        topic = _value(entry, "topic_metadata", dict)
        for key in ("serialization_format", "type_description_hash"):
            _value(topic, key, str)
        for profile in _value(topic, "offered_qos_profiles", list):
            _check_profile(profile)
        topics[_value(topic, "name", str)] = (_value(topic, "type", str), _value(entry, "message_count", int))
    for key in ("compression_format", "compression_mode", "ros_distro"):
        _value(node, key, str)
    for file in _value(node, "files", list):
        _value(file, "path", str)
        _value(file["starting_time"], "nanoseconds_since_epoch", int)
        _value(file["duration"], "nanoseconds", int)
        _value(file, "message_count", int)
    _value(node, "custom_data", (dict, type(None)))
    return Decoded(messages, tuple(_value(node, "relative_file_paths", list)), topics)


def _check_profile(profile: Mapping[str, Any]) -> None:
    for key, known in _POLICIES.items():
        if _value(profile, key, str) not in known:
            raise TypeError(f"{key}: {profile[key]}")
    _value(profile, "depth", int)
    for key in ("deadline", "lifespan", "liveliness_lease_duration"):
        for part in ("sec", "nsec"):
            _value(profile[key], part, int)
    _value(profile, "avoid_ros_namespace_conventions", bool)


def _value(node: Mapping[str, Any], key: str, kind: Any) -> Any:
    found = node[key]
    if not isinstance(found, kind):
        raise TypeError(f"{key}: {found!r}")
    return found
