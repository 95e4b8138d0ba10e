"""A `Result` in the words and numbers that the report's template prints. Pure; nothing is escaped here."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from compass_ros.reporting.checks import SUMMARY, assess, overall
from compass_ros.reporting.drawing import in_place
from compass_ros.reporting.extras import ReportExtras
from compass_ros.reporting.numbers import duration, typeset
from compass_ros.reporting.verdicts import headline, meaning, title
from compass_ros.reporting.view.explanations import ranked, sites_named
from compass_ros.reporting.view.gap import episodes, factor_table, ladder, signals
from compass_ros.reporting.view.missing import effect, ranking
from compass_ros.reporting.view.parameters import graph_rows, parameter, surely_wrong, told_rows
from compass_ros.reporting.windows import began, by_recording, counted, in_windows, word
from compass_ros.reporting.words import (
    MODEL_LABEL,
    MODELS,
    VERDICT_LEVEL,
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
    wrong, firm = sum(map(surely_wrong, result.parameters)), sum(row.identifiable for row in active)
    untold = sum(row.wrong for row in result.parameters) - wrong
    in_bars = in_error_bars(result)
    failed = VERDICT_LEVEL[result.mismatch.verdict] == "bad"
    names = dict.fromkeys(effect.name for effect in result.mismatch.effects)
    edge = f"{'has' if len(active) == 1 else 'have'} an edge in the causal graph"
    return [
        {
            "question": "Which parameters?",
            "answer": f"{wrong if in_bars else len(active)} of {len(result.parameters)}",
            "detail": f"were wrong{_also_moved(untold)}; {len(active)} {edge}" if in_bars else edge,
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
            "answer": " + ".join(names) if names else title(result.mismatch),
            "detail": meaning(result.mismatch),
            "link": "missing",
        },
    ]


def _also_moved(untold: int) -> str:
    """What moved, and is not counted, for it is not identifiable."""
    return f"; {untold} more moved but {'is' if untold == 1 else 'are'} not identifiable" if untold else ""


def _about_values(doubtful: int, failed: bool) -> str:
    if failed:
        return "these are not values to use"
    if not doubtful:
        return "with an error bar each"
    return f"{doubtful} active {'one is' if doubtful == 1 else 'ones are'} not identifiable"


def episode_list(which: str, names: Sequence[str], result: Result) -> dict[str, Any]:
    """Names of episodes, windows together by recording, to be folded under one line."""
    recordings = by_recording(names)
    of = f" of {counted(len(recordings), 'recording')}" if in_windows(result) and names else ""
    return {"title": f"{counted(len(names), f'{which} {word(result)}')}{of}", "recordings": recordings}


def view(result: Result, extras: ReportExtras) -> dict[str, Any]:
    """Everything that the template prints, by name."""
    checks = sorted(assess(result), key=lambda check: READING_ORDER.index(check.level))
    level = overall(checks)
    mismatch = result.mismatch
    head, rest = headline(mismatch)
    others = [r for r in result.parameters if not told(r)]
    return {
        "result": result,
        "headline": typeset(head),
        "rest": typeset(rest),
        "verdict": {"level": VERDICT_LEVEL[mismatch.verdict], "title": title(mismatch)},
        "word": word(result),
        "in_windows": in_windows(result),
        "began": began(result, extras.scene),
        "in_plane": any(replay.tracks for replay in in_place(result)),
        "lists": [episode_list("fitted", result.fit, result), episode_list("held-out", result.held_out, result)],
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
        "meaning": meaning(mismatch),
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
