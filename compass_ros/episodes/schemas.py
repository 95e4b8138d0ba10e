"""What the messages of a topic are made of: as the bag itself says it, else as this package or the machine knows it."""

from __future__ import annotations

import re
from collections import ChainMap
from collections.abc import Mapping
from functools import cache

from rosbags.interfaces.typing import Fielddefs, Typesdict
from rosbags.typesys import TypesysError, get_types_from_idl, get_types_from_msg

from compass_ros.episodes.definitions import embedded_definition, installed_definition, ros1_typestore, typestore
from compass_ros.episodes.layout import Fields
from compass_ros.episodes.raw import RawTopic
from compass_ros.errors import BagError

LONGEST = 2**20
"""Of a definition's text; those of ROS have up to some 60 kB [characters]."""

_NOT_PARSED = re.compile(r"^\s*(#|//).*$", re.MULTILINE)
"""Lines of IDL that rosbags refuses: includes (what they name follows in the text, or is standard) and comments."""


def fields_of(topic: RawTopic) -> Fields:
    """Fields of a topic's type and of all types in it.

    The definition that the bag carries goes first: it is what the messages were written with. A bag without (sqlite3
    before version 4 of rosbag2's format) is read by the standard definitions, or by those installed with ROS.

    Raises:
        BagError: There is none, it cannot be read, or the bag says that its own is another than the standard one and
            does not carry it.
    """
    if topic.digest and topic.digest == _digest(topic.type, topic.ros1):
        return _standard(topic.ros1)
    if topic.definition:
        try:
            return _parsed(topic.type, topic.definition, topic.encoding, topic.ros1)
        except BagError:
            if topic.type not in _standard(topic.ros1) or topic.digest:
                raise
    if topic.type in _standard(topic.ros1):
        if topic.digest and not topic.definition:
            raise BagError(f"{topic.type} was recorded with another definition than this version reads")
        return _standard(topic.ros1)
    try:
        return _parsed(topic.type, installed_definition(topic.type).text, "ros2msg", False)
    except BagError as error:
        raise BagError(f"the bag carries no definition of {topic.type}, and {error}") from error


@cache
def _standard(ros1: bool) -> Fields:
    store = ros1_typestore() if ros1 else typestore()
    return {name: fields for name, (_, fields) in store.fielddefs.items()}


@cache
def _digest(type_name: str, ros1: bool) -> str:
    """Of the standard definition; empty where there is none."""
    if type_name not in _standard(ros1):
        return ""
    return ros1_typestore().generate_msgdef(type_name)[1] if ros1 else embedded_definition(type_name).digest


@cache
def _parsed(type_name: str, text: str, encoding: str, ros1: bool) -> Fields:
    """Fields by the text of a definition with its dependencies; what it leaves out is standard."""
    if len(text) > LONGEST:
        raise BagError(f"the definition of {type_name} has {len(text)} characters; at most {LONGEST} are read")
    try:
        found = _from_idl(text) if encoding == "ros2idl" else get_types_from_msg(text.replace("\r\n", "\n"), type_name)
    except (TypesysError, ValueError, RecursionError) as error:
        raise BagError(f"the definition of {type_name} in the bag cannot be read: {_short(error)}") from error
    own: Mapping[str, Fielddefs] = {name: fields for name, (_, fields) in found.items()}
    return ChainMap(dict(own), dict(_standard(ros1)))


def _from_idl(text: str) -> Typesdict:
    """Types of several definitions, as rosbag2 puts them together."""
    found: Typesdict = {}
    for part in _NOT_PARSED.sub("", text.replace("\r\n", "\n")).split("=" * 80 + "\n"):
        found |= get_types_from_idl(part.partition("\n")[2] if part.startswith("IDL: ") else part) if part else {}
    return found


def _short(error: Exception) -> str:
    """The beginning of what a parser says, which is the whole text."""
    line = " ".join(str(error).split())
    return line if len(line) < 120 else f"{line[:117]}..."
