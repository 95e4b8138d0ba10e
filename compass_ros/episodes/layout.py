"""Where the numbers of a serialised message are: its definition walked once, for all messages laid out alike.

Two messages of one type and one size whose lengths and texts are the same bytes have all numbers at the same offsets.
So names are compared once, and the numbers of thousands of messages are columns of one matrix of bytes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from rosbags.interfaces import Nodetype
from rosbags.interfaces.typing import Fielddefs, FieldDesc

from compass_ros.errors import BagError
from compass_ros.types import Floats, Ints

Bytes = NDArray[np.uint8]
Fields = Mapping[str, Fielddefs]
"""Fields of each type by its name, `package/msg/Name`."""

_NUMBERS = {
    "bool": "u1", "byte": "u1", "char": "u1", "uint8": "u1", "int8": "i1", "uint16": "u2", "int16": "i2",
    "uint32": "u4", "int32": "i4", "uint64": "u8", "int64": "i8", "float32": "f4", "float64": "f8",
}  # fmt: skip
_DEEPEST = 32
"""Messages in messages; those of ROS have six at most, and a definition that holds itself has no end."""
_EXCESS = 8
"""Bytes behind a message for each empty array of numbers of eight bytes: `rclpy.serialization.serialize_message` gives
the size that it had reserved, in which such an array begins at a multiple of eight, and what follows with it."""
_STEPS = 8
"""Fields that a byte may stand for: a message that says more (arrays of nothing) is not walked to its end."""


@dataclass(frozen=True)
class Place:
    """Numbers in a row."""

    offset: int
    dtype: np.dtype[np.generic]
    count: int

    def of(self, messages: Bytes) -> NDArray[np.generic]:
        """(n, count) for (n, size) bytes of messages laid out alike."""
        end = self.offset + self.count * self.dtype.itemsize
        return np.ascontiguousarray(messages[:, self.offset : end]).view(self.dtype)


@dataclass(frozen=True)
class Layout:
    """One way in which messages of a type are laid out. Paths are as in `transforms[0].header.frame_id`."""

    places: Mapping[str, Place]
    """Numbers by path: one, or all of an array."""
    texts: Mapping[str, str]
    """Texts by path; those of an array one by one."""
    sizes: Mapping[str, int]
    """Elements by path of arrays of messages and texts."""
    fixed: Ints
    """Offsets of the bytes that say how the message is laid out, and of its texts."""

    def names(self, path: str) -> list[str]:
        """The texts of an array; none where there is no such array."""
        return [self.texts[f"{path}[{i}]"] for i in range(self.sizes.get(path, 0))]

    def count(self, path: str) -> int:
        """Numbers at a path; 0 where there are none."""
        return self.places[path].count if path in self.places else 0

    def number(self, messages: Bytes, path: str, index: int = 0) -> Floats:
        """(n,) one number of each message."""
        place = self.places[path]
        one = Place(place.offset + index * place.dtype.itemsize, place.dtype, 1)
        return np.asarray(one.of(messages)[:, 0], float)

    def integer(self, messages: Bytes, path: str) -> Ints:
        """(n,) one whole number of each message. Raises BagError where the definition says otherwise."""
        if self.places[path].dtype.kind not in "iu":
            raise BagError(f"{path} is no whole number")
        return np.asarray(self.places[path].of(messages)[:, 0], np.int64)


def layout(fields: Fields, type_name: str, data: bytes, ros1: bool = False) -> Layout:
    """How a message is laid out.

    Args:
        fields: Of the type and of those in it.
        type_name: `package/msg/Name`.
        data: In CDR, either byte order, with its encapsulation; or as ROS 1 serialises.
        ros1: Which of them.

    Raises:
        BagError: The message does not fit the definition, or a definition is missing.
    """
    walk = _Walk(fields, data, ros1)
    try:
        walk.message("", type_name, 0)
    except _MisfitError as error:
        raise BagError(f"a message is not a {type_name}: {error}") from error
    left = len(data) - walk.at
    if not 0 <= left <= (0 if ros1 else 3 + _EXCESS * walk.empty):  # CDR may be filled up to a multiple of four
        raise BagError(f"a message is not a {type_name}: {left} of its {len(data)} bytes are left over")
    fixed = np.concatenate([np.arange(0 if ros1 else 2), *(np.arange(a, b) for a, b in walk.fixed)]).astype(np.int64)
    return Layout(walk.places, walk.texts, walk.sizes, fixed)


class _MisfitError(Exception):
    """Bytes and definition do not fit."""


@dataclass
class _Walk:
    """One pass over a message."""

    fields: Fields
    data: bytes
    ros1: bool
    places: dict[str, Place] = field(default_factory=dict)
    texts: dict[str, str] = field(default_factory=dict)
    sizes: dict[str, int] = field(default_factory=dict)
    fixed: list[tuple[int, int]] = field(default_factory=list)
    empty: int = 0
    """Arrays without numbers, of eight bytes each."""

    def __post_init__(self) -> None:
        self.start = 0 if self.ros1 else 4
        self.at = self.start
        self.steps = 64 + _STEPS * len(self.data)
        if not self.ros1 and self.data[:2] not in (b"\x00\x00", b"\x00\x01"):
            raise BagError(f"a message is not in plain CDR: it begins with {self.data[:2].hex() or 'nothing'}")
        self.order = "<" if self.ros1 or self.data[1] else ">"

    def message(self, path: str, type_name: str, depth: int) -> None:
        self.steps -= 1
        if depth > _DEEPEST or self.steps < 0:
            raise _MisfitError(f"{type_name} in it has no end")
        if type_name not in self.fields:
            raise BagError(f"the bag holds no definition of {type_name}")
        fields = self.fields[type_name]
        if not fields and not self.ros1:
            self._number("", "uint8", 1)  # a message without fields has one byte
        for name, kind in fields:
            self._field(f"{path}.{name}" if path else name, kind, depth)

    def _field(self, path: str, kind: FieldDesc, depth: int) -> None:
        if kind[0] == Nodetype.NAME:
            self.message(path, kind[1], depth + 1)
        elif kind[0] == Nodetype.BASE:
            self._base(path, kind[1][0])
        else:
            inner, size = kind[1]
            count = size if kind[0] == Nodetype.ARRAY else self._length()
            if count > len(self.data) - self.at and count:
                raise _MisfitError(f"it says that {path} has {count} elements")
            if inner[0] == Nodetype.BASE and inner[1][0] in _NUMBERS:
                self._number(path, inner[1][0], count)
                return
            self.sizes[path] = count
            for i in range(count):
                self._field(f"{path}[{i}]", inner, depth)

    def _base(self, path: str, base: str) -> None:
        if base == "string":
            self._text(path)
        elif base in _NUMBERS:
            self._number(path, base, 1)
        else:
            raise BagError(f"{path} is a {base}, which is not read")

    def _number(self, path: str, base: str, count: int) -> None:
        dtype = np.dtype(self.order + _NUMBERS[base])
        if count:
            self._align(dtype.itemsize)
        elif dtype.itemsize == 8:
            self.empty += 1
        self.places[path] = Place(self.at, dtype, count)
        self._skip(count * dtype.itemsize)

    def _text(self, path: str) -> None:
        length = self._length()
        begin = self.at
        self._skip(length)
        self.fixed.append((begin, self.at))
        content = self.data[begin : self.at]
        self.texts[path] = (content if self.ros1 else content[:-1]).decode(errors="replace")

    def _length(self) -> int:
        """The length that stands before a text or a sequence."""
        self._align(4)
        begin = self.at
        self._skip(4)
        self.fixed.append((begin, self.at))
        return int.from_bytes(self.data[begin : self.at], "little" if self.order == "<" else "big")

    def _align(self, size: int) -> None:
        if not self.ros1:
            self.at += -(self.at - self.start) % size

    def _skip(self, size: int) -> None:
        self.steps -= 1
        self.at += size
        if self.at > len(self.data) or self.steps < 0:
            raise _MisfitError(f"it ends after {len(self.data)} bytes")


def alike(messages: Bytes, like: int, fixed: Ints) -> NDArray[np.bool_]:
    """(n,) which of (n, size) bytes of messages of one size are laid out as one of them is."""
    structure = messages[:, fixed]
    return np.asarray((structure == structure[like]).all(axis=1))


def matrix(data: Sequence[bytes]) -> Bytes:
    """(n, size) of messages of one size."""
    return np.frombuffer(b"".join(data), np.uint8).reshape(len(data), -1)
