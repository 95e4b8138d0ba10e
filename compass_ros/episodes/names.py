"""Names of episodes, which become names of folders."""

from __future__ import annotations

import hashlib
import re
import unicodedata
from collections.abc import Iterable

from compass_ros.errors import BagError

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,99}")


def episode_name(name: str) -> str:
    """The name as it is. Raises BagError unless it is up to 100 letters, digits, `_`, `-`, `.`, and starts with one
    of the first two."""
    if not _NAME.fullmatch(name) or ".." in name:
        shown = name if len(name) <= 100 else name[:100] + "..."
        raise BagError(f"episode name {shown!r}: expected 1 to 100 letters, digits, '_', '-', '.' (no '..', no path)")
    return name


def safe_name(text: str) -> str:
    """An episode name for any text, the same on every machine.

    Spaces and other signs that a name cannot have become `_`. Where letters would be lost (other scripts, a name that
    is too long or begins with a sign), six digits of the text's hash follow and keep it apart from others: `投げ1` is
    `1-` with six digits, `1` stays `1`.
    """
    composed = unicodedata.normalize("NFC", text)
    plain = re.sub(r"[^A-Za-z0-9_.-]+", "_", composed)
    if composed.isascii() and _NAME.fullmatch(plain) and ".." not in plain:
        return plain
    letters = unicodedata.normalize("NFKD", composed).encode("ascii", "ignore").decode()
    readable = re.sub(r"\.\.+|[^A-Za-z0-9_.-]+", "_", letters).strip("_.-")[:80] or "episode"
    return f"{readable}-{hashlib.sha256(composed.encode(errors='surrogateescape')).hexdigest()[:6]}"


def next_name(taken: Iterable[str], stem: str = "episode") -> str:
    """`episode_0001`, or one more than the highest number among the names taken."""
    numbered = re.compile(rf"{stem}_(\d{{4,9}})")
    numbers = [int(match[1]) for match in map(numbered.fullmatch, taken) if match]
    return f"{stem}_{max(numbers, default=0) + 1:04d}"
