"""What a result says beside the answer of a world from another engine (`worlds/`)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from compass_ros.concealed.comparison import EXCESS
from compass_ros.simulation.effects import EFFECTS
from compass_ros.worlds.world import UNKNOWN

Json = Mapping[str, Any]
FAINT = 2.0
"""Effect on what is tracked, over the noise, below which `none` is an answer as right as the name."""


@dataclass(frozen=True)
class Marks:
    """The marks of one result. None: does not apply."""

    kind: str
    truth: tuple[str, ...]
    """The world's own names of what is missing."""
    strength: float
    """rms of what all of it changes in the signals, over the noise."""
    faint: bool
    """Whether the weakest of it is below FAINT."""
    verdict: str
    found: tuple[str, ...]
    """Laws of all explanations that the verdict leaves open."""
    right: bool
    misnamed: bool
    """A law that is in no class of this world is named, or left open."""
    sites_right: bool | None
    """Of one law, named right."""
    probabilities: tuple[tuple[float, bool], ...]
    """Of each explanation, and whether it is the right one."""
    gain: float | None
    """Share of the excess held-out error that the most probable laws remove."""

    def as_json(self) -> dict[str, object]:
        return asdict(self)


def judge(result: Json, answer: Json) -> Marks:
    """Judge a result by the answer of its world."""
    kind, laws, mismatch = str(answer["kind"]), answer["laws"], result["mismatch"]
    verdict, explanations = str(mismatch["verdict"]), mismatch["explanations"]
    faint = any(law["strength"] < FAINT for law in laws)
    named = verdict in ("named", "ambiguous")
    left_open = _set(explanations, float(mismatch["false_alarm"])) if verdict == "ambiguous" else explanations[:1]
    names = [_names(one) for one in left_open] if named else []
    known = {name for law in laws for name in law["class"]} - {UNKNOWN}
    bare: Mapping[str, list[tuple[str, ...]]] = {"none": [()], "unknown": [(UNKNOWN,)]}
    said = bare.get(verdict, names)
    right = bool(said) and all(_right(one, kind, laws) for one in said)
    one_named = kind == "one" and right and len(names) == 1
    return Marks(
        kind=kind,
        truth=tuple(str(law["name"]) for law in laws),
        strength=float(answer["strength"]),
        faint=faint,
        verdict=verdict,
        found=tuple(dict.fromkeys(name for one in names for name in one)),
        right=right,
        misnamed=named and any(set(one) - known - {UNKNOWN} for one in names),
        sites_right=_sites(left_open[0]["laws"], laws[0]) if one_named and names[0] else None,
        probabilities=tuple((float(e["probability"]), _right(_names(e), kind, laws)) for e in explanations),
        gain=_gain(explanations[0]) if laws and named else (0.0 if laws and not faint else None),
    )


def _names(explanation: Json) -> tuple[str, ...]:
    """Of one law on several sites once."""
    return tuple(dict.fromkeys(str(law["name"]) for law in explanation["laws"]))


def _set(explanations: Sequence[Json], alpha: float) -> list[Json]:
    """The fewest that hold all probability but alpha."""
    out, held = [], 0.0
    for one in explanations:
        if held >= 1 - alpha:
            break
        out.append(one)
        held += float(one["probability"])
    return out


def _right(names: Sequence[str], kind: str, laws: Sequence[Json]) -> bool:
    """Whether an explanation is what is missing: each law by members of its own class, and no other names.

    Laws that are faint may be left out. What lies outside of the vocabulary is `unknown`, or what its class allows.
    """
    left = list(names)
    for law in sorted(laws, key=lambda one: one["strength"], reverse=True):
        own = [name for name in left if name in law["class"]]
        if not own and law["strength"] >= FAINT:
            return False
        left = [name for name in left if name not in own]
    return not left


def _sites(found: Sequence[Json], law: Json) -> bool:
    """Whether a law is on its sites; a law that has none of its own acts on all, as one of the world does.

    A law between two things is on the one of them that the truth names: a plate, where the other is the ball.
    """
    own, said = set(law["sites"]) - {"world"}, set[str]()
    for one in found:
        effect = EFFECTS.get(one["name"])
        among = own & set(one["sites"]) if effect and effect.paired else set()
        said |= among or set(one["sites"])
    return not said or not own or said == own


def _gain(explanation: Json) -> float | None:
    """(before - after) / (before - floor)."""
    of = explanation["held_out"]
    if not of or of["before"] is None or of["before"] <= EXCESS * of["floor"]:
        return None
    return float((of["before"] - of["after"]) / (of["before"] - of["floor"]))
