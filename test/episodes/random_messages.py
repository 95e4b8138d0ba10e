"""Messages of any type, filled at random."""

from __future__ import annotations

from typing import Any

import numpy as np
from rosbags.interfaces import Nodetype
from rosbags.interfaces.typing import FieldDesc
from rosbags.typesys.base import normalize_fieldname
from rosbags.typesys.store import Typestore

TEXTS = ["", "a", "frame_7", "Gelenk \u00e4", "x" * 30]


def message(store: Typestore, type_name: str, rng: np.random.Generator) -> Any:
    """Every array that has no fixed length gets 0 to 3 elements."""
    fields = {normalize_fieldname(name): _field(store, kind, rng) for name, kind in store.fielddefs[type_name][1]}
    return store.types[type_name](**fields)


def _field(store: Typestore, kind: FieldDesc, rng: np.random.Generator) -> Any:
    if kind[0] == Nodetype.NAME:
        return message(store, kind[1], rng)
    if kind[0] == Nodetype.BASE:
        return _base(kind[1][0], rng)
    inner, size = kind[1]
    count = size if kind[0] == Nodetype.ARRAY else int(rng.integers(0, 4))
    elements = [_field(store, inner, rng) for _ in range(count)]
    if inner[0] == Nodetype.BASE and inner[1][0] != "string":
        return np.array(elements, {"bool": "bool", "byte": "uint8", "char": "uint8"}.get(inner[1][0], inner[1][0]))
    return elements


def _base(name: str, rng: np.random.Generator) -> Any:
    if name == "string":
        return TEXTS[int(rng.integers(len(TEXTS)))]
    if name == "bool":
        return bool(rng.integers(2))
    if name.startswith("float"):
        return float(np.dtype(name).type(rng.normal()))
    return int(rng.integers(0, 100))


def leaves(value: Any, path: str = "") -> dict[str, Any]:
    """Numbers and texts of a message by path: an array of numbers whole, everything else one by one."""
    if isinstance(value, np.ndarray):
        return {path: value.tolist()}
    if isinstance(value, list):
        return {k: v for i, one in enumerate(value) for k, v in leaves(one, f"{path}[{i}]").items()}
    if isinstance(value, bool | int | float | str):
        return {path: value if isinstance(value, str) else [value]}
    fields = {n: v for n, v in vars(value).items() if not n.startswith("__") and not n.isupper()}  # constants are
    return {k: v for n, one in fields.items() for k, v in leaves(one, f"{path}.{n}" if path else n).items()}
