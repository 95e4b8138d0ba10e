"""A `Result` in the words and numbers that the report's template prints. Pure; nothing is escaped here."""

from __future__ import annotations

from typing import Any

from compass_ros.reporting.checks import SUMMARY, assess, overall
from compass_ros.reporting.extras import ReportExtras
from compass_ros.reporting.numbers import duration, typeset
from compass_ros.reporting.view.explanations import ranked, sites_named
from compass_ros.reporting.view.gap import episodes, factor_table, ladder, signals
from compass_ros.reporting.view.missing import effect, ranking
from compass_ros.reporting.view.parameters import graph_rows, parameter, told_rows
from compass_ros.reporting.words import (
    MODEL_LABEL,
    MODELS,
    VERDICT_LEVEL,
    VERDICT_MEANING,
    VERDICT_TITLE,
    Level,
    in_error_bars,
    told,
    where_rows,
)
from compass_ros.types import Result

READING_ORDER: tuple[Level, ...] = ("bad", "care", "good", "note")
"""What needs a reader's attention comes first."""


def questions(result: Result) -> list[dict[str, Any]]:
    """The three questions of the suite with their short answers."""
    active = [row for row in result.parameters if row.active]
    wrong, firm = sum(row.wrong for row in result.parameters), sum(row.identifiable for row in active)
    in_bars = in_error_bars(result)
    failed = VERDICT_LEVEL[result.mismatch.verdict] == "bad"
    names = dict.fromkeys(effect.name for effect in result.mismatch.effects)
    edge = f"{'has' if len(active) == 1 else 'have'} an edge in the causal graph"
    return [
        {
            "question": "Which parameters?",
            "answer": f"{wrong if in_bars else len(active)} of {len(result.parameters)}",
            "detail": f"were wrong; {len(active)} {edge}" if in_bars else edge,
            "link": "causes",
        },
        {
            "question": "Which values?",
            "answer": "not settled" if failed else f"{firm} pinned down",
            "detail": _about_values(len(active) - firm, failed),
            "link": "parameters",
        },
        {
            "question": "What is left?",
            "answer": " + ".join(names) if names else VERDICT_TITLE[result.mismatch.verdict],
            "detail": VERDICT_MEANING[result.mismatch.verdict],
            "link": "missing",
        },
    ]


def _about_values(doubtful: int, failed: bool) -> str:
    if failed:
        return "these are not values to use"
    if not doubtful:
        return "with an error bar each"
    return f"{doubtful} active {'one is' if doubtful == 1 else 'ones are'} not identifiable"


def view(result: Result, extras: ReportExtras) -> dict[str, Any]:
    """Everything that the template prints, by name."""
    checks = sorted(assess(result), key=lambda check: READING_ORDER.index(check.level))
    level = overall(checks)
    mismatch = result.mismatch
    others = [r for r in result.parameters if not told(r)]
    return {
        "result": result,
        "sentence": typeset(mismatch.sentence),
        "verdict": {"level": VERDICT_LEVEL[mismatch.verdict], "title": VERDICT_TITLE[mismatch.verdict]},
        "ladder": ladder(result),
        "questions": questions(result),
        "checks": checks,
        "trust": {"level": level, "summary": SUMMARY[level]},
        "factor_table": factor_table(result),
        "models": [MODEL_LABEL[m] for m in MODELS],
        "episodes": episodes(result),
        "graph": graph_rows(result),
        "told": [parameter(row, extras.truth.get(row.name)) for row in told_rows(result)],
        "others": [parameter(row, extras.truth.get(row.name)) for row in others],
        "with_truth": bool(extras.truth),
        "meaning": VERDICT_MEANING[mismatch.verdict],
        "where": where_rows(mismatch.where, result.unit) if mismatch.where is not None else (),
        "effects": [effect(e, on) for e, on in zip(mismatch.effects, sites_named(mismatch), strict=True)],
        "explanations": ranked(mismatch),
        "ranking": () if mismatch.explanations else ranking(result, extras.candidates),
        "signals": signals(result),
        "command": extras.command,
        "budget": [
            ("rollouts", f"{result.budget.rollouts:,}".replace(",", " ")),
            ("simulated", duration(result.budget.simulated_seconds)),
            ("took", duration(result.budget.wall_seconds)),
        ],
    }
