"""Numbers for readers: a value has the digits that its error bar justifies."""

from __future__ import annotations

import math
import re

MISSING = "\N{EN DASH}"
MINUS = "\N{MINUS SIGN}"
NARROW = "\N{NARROW NO-BREAK SPACE}"
_NEGATIVE = re.compile(r"(?<![\w.)-])-(?=\d)|(?<=\de)-(?=\d)")
"""The sign of a number or of its exponent; in `2026-11-29` and `unit-3` there is none."""


def plain(value: float, digits: int = 4) -> str:
    """`value` with `digits` significant digits, below a million without an exponent; a dash when it is not finite."""
    if not math.isfinite(value):
        return MISSING
    text = f"{value:.{digits}g}"
    if "e+" in text and abs(float(text)) < 1e6:
        text = f"{float(text):.0f}"
    return text.replace("-", MINUS)


def with_error(value: float, std: float) -> tuple[str, str]:
    """Value and one standard deviation as text, both cut at the second digit of the deviation.

    Without a usable deviation the value has four significant digits and the second text is empty.
    """
    if not math.isfinite(value):
        return MISSING, ""
    if not math.isfinite(std) or std <= 0.0:
        return plain(value), ""
    decimals = 1 - math.floor(math.log10(std))
    if decimals > 6 or decimals < -3:
        return f"{value:.3e}".replace("-", MINUS), f"{std:.1e}".replace("-", MINUS)
    decimals = max(decimals, 0)
    return f"{value:.{decimals}f}".replace("-", MINUS), f"{std:.{decimals}f}"


def value_pm(value: float, std: float) -> str:
    """`0.0412 ± 0.0006`, or the value alone."""
    text, error = with_error(value, std)
    return f"{text} ± {error}" if error else text


def thousandths(distance: float) -> str:
    """A distance in mm (mrad) without its unit: three digits at most."""
    if not math.isfinite(distance):
        return MISSING
    value = distance * 1e3
    return f"{value:.0f}" if value >= 100 else f"{value:.1f}" if value >= 10 else f"{value:.2f}"


def with_unit(distance: float, unit: str) -> str:
    """`5.10 mm`, from metres; `5.10 mrad`, from radians."""
    return f"{thousandths(distance)} m{unit}"


def percent(share: float) -> str:
    """`0.93` as `93 %`."""
    return f"{share * 100:.0f}{NARROW}%".replace("-", MINUS) if math.isfinite(share) else MISSING


def probability(p: float) -> str:
    """A probability: `0.004`, `< 0.001`."""
    if not math.isfinite(p):
        return MISSING
    return "< 0.001" if p < 0.001 else f"{p:.2g}"


def duration(seconds: float) -> str:
    """`41 s`, `3 min 05 s`, `2 h 10 min`."""
    if not math.isfinite(seconds):
        return MISSING
    whole = round(seconds)
    if whole < 60:
        return f"{seconds:.1f} s" if seconds < 10 else f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60:02d} s"
    return f"{whole // 3600} h {whole % 3600 // 60:02d} min"


def typeset(sentence: str) -> str:
    """A sentence with the signs that plain text spells out: `+-`, `->`, `m/s2`, and minus, at which no line breaks."""
    signed = sentence.replace("+-", "±").replace("->", "→").replace("m/s2", "m/s²").replace("m/s^2", "m/s²")
    return _NEGATIVE.sub(MINUS, signed)


def unit_text(unit: str) -> str:
    """A unit as people write it: `m/s^2` -> `m/s²`, `1` -> nothing."""
    if unit in ("1", "-", ""):
        return ""
    return unit.replace("^2", "²").replace("^3", "³").replace("**2", "²").replace("*", "·")
