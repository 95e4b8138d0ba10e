"""The answer to what is left: fitted effects and the candidates that were tried."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from compass_ros.reporting.extras import Candidate
from compass_ros.reporting.numbers import percent, plain, probability, unit_text, value_pm
from compass_ros.types import EffectFinding, Result


def effect(finding: EffectFinding, sites: str) -> dict[str, Any]:
    """One fitted effect."""
    return {
        "name": finding.name,
        "sites": sites,
        "parameters": [
            {"name": name, "value": value_pm(p.value, p.std), "unit": unit_text(p.unit)}
            for name, p in finding.parameters.items()
        ],
        "gain": percent(finding.evidence.held_out_gain),
        "evidence": plain(finding.evidence.log_evidence, 3),
        "p": probability(finding.evidence.false_alarm_p),
        "equivalents": finding.equivalents,
    }


def ranking(result: Result, candidates: Sequence[Candidate]) -> list[dict[str, Any]]:
    """Candidates by evidence, best first; from the findings alone where discovery handed over no list.

    One effect on other objects is another candidate: of those that read alike the best stands for all.
    """
    rows = candidates or tuple(
        Candidate(e.name, "", e.evidence.log_evidence, e.evidence.held_out_gain, True) for e in result.mismatch.effects
    )
    ordered = sorted(rows, key=lambda c: (-c.log_evidence if math.isfinite(c.log_evidence) else math.inf, c.name))
    unlike: dict[tuple[str, str], Candidate] = {}
    for c in ordered:
        unlike.setdefault((c.name, c.note), c)
    top = max((c.log_evidence for c in ordered if math.isfinite(c.log_evidence)), default=0.0)
    return [
        {
            "name": c.name,
            "channel": c.channel,
            "evidence": plain(c.log_evidence, 3),
            "bar": round(100 * max(c.log_evidence, 0.0) / top, 1) if top > 0 and math.isfinite(c.log_evidence) else 0,
            "gain": percent(c.held_out_gain),
            "kept": c.kept,
            "note": c.note,
        }
        for c in unlike.values()
    ]
