"""Names of the same thing in a model and in recordings, in other spellings.

A name is its tokens: letters and digits apart, without regard to case, separators and words that say only that it is a
joint or link. `panda_joint1`, `joint_1` and `robot0/Joint1_link` are one joint, once what all names of a list begin or
end with is left out.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

_TOKEN = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+")
_EMPTY = {"joint", "jnt", "j", "link", "motor", "actuator", "drive", "servo", "position", "pos", "body", "frame"}
"""Words that say what kind of thing has the name."""
Tokens = tuple[str, ...]


@dataclass(frozen=True)
class Match:
    """A name in the recordings and the one in the model."""

    model: str
    how: str
    """In words; empty: the names are the same."""


def tokens(name: str) -> Tokens:
    """Words and numbers of a name in lower case; numbers without leading zeros."""
    return tuple(str(int(t)) if t.isdigit() else t.lower() for t in _TOKEN.findall(name))


def matched(recorded: Sequence[str], model: Sequence[str]) -> dict[str, Match]:
    """What each recorded name is called in the model, of those that are one name there by one reading and no other.

    Readings, each for names that those before have left: the same; the same but for case and separators; without words
    for joint or link; without what all names of a list share; the end of the longer name.
    """
    found = {name: Match(name, "") for name in recorded if name in model}
    own, shared = _shared(recorded), _shared(model)
    readings: list[tuple[str, Callable[[str], Tokens], Callable[[str], Tokens]]] = [
        ("but for case and separators", tokens, tokens),
        ("but for words like joint", _core, _core),
        ("but for what all names share", lambda n: _without(n, own), lambda n: _without(n, shared)),
    ]
    for how, of_recorded, of_model in readings:
        _add(found, recorded, model, _equal(of_recorded, of_model), how)
    _add(found, recorded, model, _ends, "by the end of the name")
    return {name: found[name] for name in recorded if name in found}


def _add(
    found: dict[str, Match],
    recorded: Sequence[str],
    model: Sequence[str],
    same: Callable[[str, str], bool],
    how: str,
) -> None:
    """Pairs of which neither has another partner."""
    taken = {match.model for match in found.values()}
    left, free = [n for n in recorded if n not in found], [n for n in model if n not in taken]
    partners: Mapping[str, list[str]] = {name: [other for other in free if same(name, other)] for name in left}
    wanted = [other for others in partners.values() for other in others]
    for name, others in partners.items():
        if len(others) == 1 and wanted.count(others[0]) == 1:
            found[name] = Match(others[0], how)


def _equal(of_recorded: Callable[[str], Tokens], of_model: Callable[[str], Tokens]) -> Callable[[str, str], bool]:
    def same(name: str, other: str) -> bool:
        own = of_recorded(name)
        return bool(own) and own == of_model(other)

    return same


def _ends(name: str, other: str) -> bool:
    """Whether the shorter name is what the longer one ends with."""
    short, long = sorted((_core(name), _core(other)), key=len)
    return bool(short) and long[-len(short) :] == short


def _core(name: str) -> Tokens:
    return tuple(token for token in tokens(name) if token not in _EMPTY)


def _shared(names: Sequence[str]) -> frozenset[str]:
    """Tokens that all of several names have."""
    every = [set(tokens(name)) for name in names]
    return frozenset(set.intersection(*every)) if len(every) > 1 else frozenset()


def _without(name: str, shared: frozenset[str]) -> Tokens:
    return tuple(token for token in _core(name) if token not in shared)
