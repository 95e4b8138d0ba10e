"""A verdict in words: its title, what it means, and its sentence as a headline."""

from __future__ import annotations

import re

from compass_ros.reporting.words import VERDICT_MEANING, VERDICT_TITLE
from compass_ros.types import Mismatch

NOT_ENDED = "the search has not ended"
"""The reason in the sentence of a result that is written before missing physics is looked for."""
SHORT = 100
"""Characters of a sentence that is a headline as it is."""
ASIDE = re.compile(r" \((?P<said>[^()]*(?:\([^()]*\)[^()]*)*)\)")
"""What stands in parentheses, those in it included."""
LONG_ASIDE = 30
"""Characters from which it is no number or place."""
CHOICE, SEVERAL = "one of these: ", "one of several laws"


def title(mismatch: Mismatch) -> str:
    """In two to four words."""
    return VERDICT_TITLE[mismatch.verdict] + (" yet" if _not_ended(mismatch) else "")


def meaning(mismatch: Mismatch) -> str:
    """What the verdict says about the simulator."""
    if _not_ended(mismatch):
        return "The search for missing physics has not ended: it still runs, or was stopped. This is not a pass."
    return VERDICT_MEANING[mismatch.verdict]


def _not_ended(mismatch: Mismatch) -> bool:
    return mismatch.verdict == "not_evaluated" and NOT_ENDED in mismatch.sentence


def headline(mismatch: Mismatch) -> tuple[str, str]:
    """The verdict's sentence as one short sentence, and the rest of it; a short one has no rest."""
    sentence = mismatch.sentence
    if _not_ended(mismatch):
        return "The search for missing physics has not ended.", ""
    if len(sentence) <= SHORT:
        return sentence, ""
    head, rest = _cut(sentence)
    asides = [found["said"] for found in ASIDE.finditer(head) if len(found["said"]) > LONG_ASIDE]
    for aside in asides:
        head = head.replace(f" ({aside})", "")
    said = "; ".join([*asides, *filter(None, [rest])])
    return head.rstrip(".") + ".", said[:1].upper() + said[1:] if asides else said


def _cut(sentence: str) -> tuple[str, str]:
    """At the first semicolon or end of a sentence outside parentheses; a list of laws belongs to the rest."""
    before, choice, laws = sentence.partition(CHOICE)
    if choice:
        return before + SEVERAL, choice + laws
    depth = 0
    for place, sign in enumerate(sentence):
        depth += (sign == "(") - (sign == ")")
        if depth == 0 and sentence[place : place + 2] in ("; ", ". "):
            return sentence[:place], sentence[place + 2 :]
    return sentence, ""
