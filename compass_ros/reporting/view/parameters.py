"""Parameters and the causal graph as rows of a table."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from compass_ros.reporting.numbers import MINUS, MISSING, percent, plain, unit_text, value_pm
from compass_ros.reporting.words import told
from compass_ros.types import ParameterRow, Result


def split_name(name: str) -> tuple[str, str]:
    """`puck1@dyna@damping` -> (`puck1`, `dyna@damping`): what a reader looks for comes first."""
    head, _, tail = name.partition("@")
    return head, tail


def _moved(row: ParameterRow) -> float:
    """Distance from the default as a share of the range."""
    span = row.bounds[1] - row.bounds[0]
    share = abs(row.value - row.default) / span if span > 0 else 0.0
    return share if math.isfinite(share) else 0.0


def told_rows(result: Result) -> list[ParameterRow]:
    """Parameters that were wrong or have an edge: those that the recordings can tell first, and of them the wrong ones.

    Of each the most moved one is first.
    """
    rows = (row for row in result.parameters if told(row))
    return sorted(rows, key=lambda r: (r.identifiable, r.wrong, _moved(r)), reverse=True)


def surely_wrong(row: ParameterRow) -> bool:
    """Whether its default was wrong, as far as the recordings can tell it from others."""
    return row.wrong and row.identifiable


def _strip(row: ParameterRow, truth: float | None) -> dict[str, Any]:
    """Places on a line from the lower to the upper bound, in percent."""
    low, high = row.bounds
    span = high - low
    if not (math.isfinite(span) and span > 0):
        return {}

    def place(value: float) -> float:
        return round(100 * min(max((value - low) / span, 0.0), 1.0), 2)

    strip: dict[str, Any] = {"default": place(row.default)}
    if math.isfinite(row.value):
        strip["value"] = place(row.value)
        if math.isfinite(row.std):
            strip["from"], strip["to"] = place(row.value - row.std), place(row.value + row.std)
    if truth is not None:
        strip["truth"] = place(truth)
    return strip


def parameter(row: ParameterRow, truth: float | None) -> dict[str, Any]:
    """One row of the parameter table."""
    head, tail = split_name(row.name)
    change = (row.value - row.default) / row.default if row.default else math.nan
    return {
        "head": head,
        "tail": tail,
        "default": plain(row.default),
        "value": value_pm(row.value, row.std),
        "truth": "" if truth is None else plain(truth),
        "unit": unit_text(row.unit),
        "low": plain(row.bounds[0]),
        "high": plain(row.bounds[1]),
        "change": f"{change * 100:+.0f} %".replace("-", MINUS) if math.isfinite(change) else "",
        "wrong": f"yes, {row.error_bars:.0f} std" if row.wrong else "no" if math.isfinite(row.error_bars) else MISSING,
        "matters": row.active,
        "identifiable": row.identifiable,
        "strip": _strip(row, truth),
    }


def graph_rows(result: Result) -> dict[str, Any]:
    """The heat map: rows with an edge first (strongest on top), the rest folded away."""
    graph = result.graph
    if not graph.psi.size:
        return {"edges": [], "rest": [], "factors": [], "sparsity": "", "threshold": "", "entries": 0}
    order = np.argsort(-graph.psi.max(axis=1), kind="stable")
    active = graph.active()

    def rows(keep: bool) -> list[dict[str, Any]]:
        return [
            {"name": split_name(graph.parameters[i]), "cells": [_cell(p, graph.threshold) for p in graph.psi[i]]}
            for i in order
            if bool(active[i]) is keep
        ]

    return {
        "edges": rows(True),
        "rest": rows(False),
        "factors": graph.factors,
        "sparsity": percent(graph.sparsity),
        "threshold": plain(graph.threshold),
        "entries": graph.psi.size,
    }


def _cell(psi: float, threshold: float) -> dict[str, Any]:
    known = math.isfinite(psi)
    return {"share": round(100 * psi) if known else 0, "text": f"{psi:.2f}" if known else "", "edge": psi >= threshold}
