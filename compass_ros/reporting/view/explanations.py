"""The ranking of what could be missing: how probable each explanation is, what it removes, why it is not the first."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from compass_ros.reporting.numbers import NARROW, percent, probability, thousandths
from compass_ros.types import ExplainedLaw, Explanation, Mismatch

UNKNOWN = "unknown"
RAISED = str.maketrans("0123456789", "⁰¹²³⁴⁵⁶⁷⁸⁹")
MENTIONED = math.log(3)
"""Log odds from which one explanation is called less probable than another (Kass and Raftery 1995: below, "not worth
more than a bare mention")."""


@dataclass(frozen=True)
class Ranked:
    """One explanation in a reader's words."""

    laws: tuple[tuple[str, str], ...]
    """Name and sites of each; none: nothing is missing."""
    title: str
    """For an explanation that names no law."""
    probability: str
    share: float
    """The probability in per cent."""
    removes: str
    """Share of the excess held-out error."""
    removed: float
    """The same in per cent, from 0 to 100."""
    errors: str
    """Held-out error before and after; empty where it was not computed."""
    kept: bool
    """Whether it is one of the few that hold 1 - alpha of the probability."""
    why: str
    """Why it is less probable than the first; empty where it is not, or not by much."""
    form: str = ""
    """What corrects the form of its laws in the simulator; empty where nothing does."""

    @property
    def notes(self) -> list[str]:
        """What is said below it."""
        return [note for note in (self.form, self.why) if note]

    @property
    def name(self) -> str:
        """In one line."""
        said = [f"{name} on {sites}" if sites else name for name, sites in self.laws]
        return " + ".join(said) or self.title


def ranked(mismatch: Mismatch) -> list[Ranked]:
    """Explanations as they come, the most probable first; empty for a result that has none."""
    before, rows = 0.0, []
    alpha = mismatch.false_alarm if math.isfinite(mismatch.false_alarm) else 0.0
    for one in mismatch.explanations:
        rows.append(_row(one, mismatch.explanations[0], before < 1 - alpha))
        before += one.probability
    return rows


def sites_named(mismatch: Mismatch) -> list[str]:
    """Sites of each finding, as the explanation of the same laws has them; empty where none does."""
    names = [finding.name for finding in mismatch.effects]
    laws = next((e.laws for e in mismatch.explanations if [law.name for law in e.laws] == names), ())
    return [_sites(law) for law in laws] or [""] * len(names)


def _row(one: Explanation, first: Explanation, kept: bool) -> Ranked:
    unknown = [law.name for law in one.laws] == [UNKNOWN]
    errors = one.held_out
    share = errors.removed if errors is not None and one.laws else math.nan
    share = min(share, 1.0) if math.isfinite(share) else share  # beneath the floor nothing more is there to remove
    return Ranked(
        laws=() if unknown else tuple((law.name, _sites(law)) for law in one.laws),
        title="no law that is known" if unknown else "" if one.laws else "nothing is missing",
        probability="> 0.999" if one.probability > 0.999 else probability(one.probability),
        share=round(100 * one.probability, 1),
        removes=percent(share),
        removed=round(100 * max(share, 0.0), 1) if math.isfinite(share) else 0.0,
        errors="" if errors is None else f"{_moved(errors.before, errors.after)}{NARROW}m{errors.unit}",
        kept=kept,
        why=why_less(one, first),
        form=_form(one.corrections),
    )


def _form(corrections: Sequence[ExplainedLaw]) -> str:
    said = [f"{law.name} on {_sites(law)}" if law.sites else law.name for law in corrections]
    return (
        f"with {' and '.join(said)} as a correction of its form, as published forms of one law differ" if said else ""
    )


def _sites(law: ExplainedLaw) -> str:
    return ", ".join(law.sites)


def _moved(before: float, after: float) -> str:
    texts = thousandths(before), thousandths(after)
    return texts[0] if texts[0] == texts[1] else " \N{RIGHTWARDS ARROW} ".join(texts)


def why_less(one: Explanation, first: Explanation) -> str:
    """Why an explanation is less probable than the first one: what the recordings say, or what was thought before."""
    if one is first or one.probability >= first.probability * math.exp(-MENTIONED):
        return ""
    worse = first.log_evidence - one.log_evidence
    if worse > MENTIONED:
        return f"the recordings are {_times(worse)} times less probable with it"
    if math.isfinite(worse):
        return "explains the recordings as well, but was less probable before: more laws, or more choices of sites"
    return ""


def _times(log_ratio: float) -> str:
    """A ratio of which the logarithm is given: `25`, `10⁶`."""
    powers = log_ratio / math.log(10)
    return f"{math.exp(log_ratio):.0f}" if powers < 4 else "10" + f"{powers:.0f}".translate(RAISED)
