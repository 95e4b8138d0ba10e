"""Units as people write them beside a number: by how much they differ from SI, and of what quantity they are."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

_BASE = {
    "m": (1.0, (1, 0, 0)),
    "g": (1e-3, (0, 1, 0)),
    "s": (1.0, (0, 0, 1)),
    "N": (1.0, (1, 1, -2)),
    "Pa": (1.0, (-1, 1, -2)),
    "J": (1.0, (2, 1, -2)),
    "W": (1.0, (2, 1, -3)),
    "Hz": (1.0, (0, 0, -1)),
    "rad": (1.0, (0, 0, 0)),
    "Nm": (1.0, (2, 1, -2)),
    "Nms": (1.0, (2, 1, -1)),
}
"""Factor to SI, and powers of metre, kilogram and second; with a prefix or without."""
_ALONE = {
    "1": (1.0, (0, 0, 0)),
    "%": (1e-2, (0, 0, 0)),
    "deg": (math.pi / 180, (0, 0, 0)),
    "°": (math.pi / 180, (0, 0, 0)),
    "degree": (math.pi / 180, (0, 0, 0)),
    "degrees": (math.pi / 180, (0, 0, 0)),
    "min": (60.0, (0, 0, 1)),
    "h": (3600.0, (0, 0, 1)),
    "rpm": (math.pi / 30, (0, 0, -1)),
    "in": (0.0254, (1, 0, 0)),
    "inch": (0.0254, (1, 0, 0)),
    "ft": (0.3048, (1, 0, 0)),
    "lb": (0.45359237, (0, 1, 0)),
    "lbs": (0.45359237, (0, 1, 0)),
    "oz": (0.028349523125, (0, 1, 0)),
    "t": (1e3, (0, 1, 0)),
}
"""The same of what takes no prefix."""
_PREFIX = {"k": 1e3, "M": 1e6, "d": 1e-1, "c": 1e-2, "m": 1e-3, "u": 1e-6, "µ": 1e-6, "μ": 1e-6, "n": 1e-9}
_TOKEN = re.compile(r"\s*(?P<sign>[/*·.]?)\s*(?P<word>[^\W\d_²³]+|[%°1])(\^?(?P<power>-?\d)|(?P<small>[²³]))?\s*")


@dataclass(frozen=True)
class Unit:
    factor: float
    """One of it in SI."""
    powers: tuple[int, int, int]
    """Of metre, kilogram, second; a radian is none."""

    def same(self, other: Unit) -> bool:
        return self.powers == other.powers and math.isclose(self.factor, other.factor, rel_tol=1e-9)


def read_unit(text: str) -> Unit | None:
    """`N m s/rad`, `kg*m^2`, `mm`; None where it is written in another way than these. A `/` is of one factor."""
    factor, powers, at = 1.0, (0, 0, 0), 0
    while match := _TOKEN.match(text, at):
        known = _word(match["word"])
        if known is None:
            return None
        power = int(match["power"] or {"²": 2, "³": 3}.get(match["small"] or "", 1))
        power = -power if match["sign"] == "/" else power
        factor *= known[0] ** power
        powers = (powers[0] + power * known[1][0], powers[1] + power * known[1][1], powers[2] + power * known[1][2])
        at = match.end()
    return Unit(factor, powers) if text.strip() and at == len(text) else None


def _word(word: str) -> tuple[float, tuple[int, int, int]] | None:
    known = _ALONE.get(word) or _BASE.get(word)
    if known is None and word[0] in _PREFIX and word[1:] in _BASE:
        factor, powers = _BASE[word[1:]]
        return _PREFIX[word[0]] * factor, powers
    return known
