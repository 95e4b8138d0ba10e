"""Why a YAML is no cell, in one line and in the words of the YAML: pydantic's errors with the names that it gives."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from pydantic import ValidationError

from compass_ros.errors import nearest, shown

_UNKNOWN, _MISSING = "unexpected_keyword_argument", "missing"
_PAIRS = ("bounds", "reach")
_WORDS = {
    _UNKNOWN: "unknown field",
    _MISSING: "missing",
    "float_type": "expected a number",
    "float_parsing": "expected a number",
    "int_type": "expected a whole number",
    "int_parsing": "expected a whole number",
    "string_type": "expected a text",
    "tuple_type": "expected a list",
    "dataclass_type": "expected a mapping of fields",
}
"""By pydantic's name of an error; of others its own words."""


def refusal(error: ValidationError, content: Mapping[str, object], known: Sequence[str]) -> str:
    """The first error: what is wrong where, what was expected, what was found, and the nearest of the known fields."""
    found = error.errors()
    first = next((e for e in found if e["type"] == _UNKNOWN), found[0])  # a misspelt name also lacks the right one
    pair = next((i for i, part in enumerate(first["loc"]) if part in _PAIRS), None)
    if pair is not None and first["type"] in ("too_long", "tuple_type", _MISSING):
        given = _at(content, first["loc"][: pair + 1])
        count = f"{len(given)}, " if isinstance(given, (list, tuple)) else ""
        place = _place(first["loc"][: pair + 1], content)
        return f"{place}: expected two numbers, the lower and the upper bound, found {count}{shown(given)}"
    place = _place(first["loc"], content, first["type"] == _MISSING)
    said = _WORDS.get(first["type"], _own_words(first["msg"]))
    if first["type"] == _MISSING:
        return f"{place}: {said}"
    hint = nearest(str(first["loc"][-1]), known) if first["type"] == _UNKNOWN else ""
    return f"{place}: {said}, found {shown(first['input'])}{hint}"


def _own_words(message: str) -> str:
    return message.replace("Input should be ", "expected ", 1)


def _at(content: object, loc: Sequence[int | str]) -> object:
    """What stands in a place of the YAML; None where there is nothing."""
    for part in loc:
        if isinstance(part, int):
            content = content[part] if isinstance(content, (list, tuple)) and part < len(content) else None
        else:
            content = content.get(part) if isinstance(content, Mapping) else None
    return content


def _place(loc: Sequence[int | str], content: object, missing: bool = False) -> str:
    """`parameters: arm@dyna@damping: half_width`: elements of lists by their names, or by their numbers from 1 on.

    `missing`: the last part is not there. What else is not there are pydantic's words for the kinds that a value could
    be of, and left out.
    """
    said = []
    for i, part in enumerate(loc):
        holder, there = _at(content, loc[:i]), _at(content, loc[: i + 1])
        if isinstance(part, int):
            name = there.get("name", there.get("object")) if isinstance(there, Mapping) else None
            said.append(name[:200] if isinstance(name, str) and name else f"number {part + 1}")
        elif (isinstance(holder, Mapping) and part in holder) or (missing and i + 1 == len(loc)):
            said.append(part)
    return ": ".join(" ".join(part.split()) for part in said)
