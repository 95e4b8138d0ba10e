"""Results of an arm over weeks and of a fleet of it, with what is planted; files by the suite's own writer."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from compass_ros.reporting import write_result
from compass_ros.types import (
    Budget,
    EffectParameter,
    ExplainedLaw,
    Explanation,
    Gap,
    Graph,
    Mismatch,
    ParameterRow,
    Result,
    SignalGap,
    Verdict,
)

STD = {
    "shoulder@dyna@damping": 0.02,
    "elbow@dyna@damping": 0.03,
    "elbow@dyna@frictionloss": 0.004,
    "hand@dyna@mass": 0.01,
}
USUAL = {
    "shoulder@dyna@damping": 0.6,
    "elbow@dyna@damping": 0.8,
    "elbow@dyna@frictionloss": 0.05,
    "hand@dyna@mass": 0.3,
}
PLAY = ExplainedLaw("backlash", ("elbow",), {"width": EffectParameter(0.012, 0.001, "rad")})
NOTHING = (Explanation((), 0.98, 100.0), Explanation((ExplainedLaw("unknown", (), {}),), 0.02, 96.0))
WITH_PLAY = (Explanation((PLAY,), 0.97, 140.0), Explanation((), 0.03, 100.0))


def result(
    values: Mapping[str, float],
    explanations: Sequence[Explanation] = NOTHING,
    verdict: Verdict = "none",
    cell: str = "arm",
    cancelled: bool = False,
    weak: Sequence[str] = (),
) -> Result:
    """`weak`: parameters that the recordings do not tell."""
    rows = tuple(
        ParameterRow(name, "1", USUAL[name], value, STD[name], (0.0, 5.0), True, name not in weak)
        for name, value in values.items()
    )
    gap = Gap({"elbow": 0.01}, 0.0011, {"joints": SignalGap(0.0011, "rad", 0.001)})
    return Result(
        cell=cell, method="default", seed=0, versions={"compass_ros": "0.2.0", "mujoco": "3.9.0"},
        budget=Budget(100, 10.0, 1.0), fit=("a", "b"), held_out=("c",),
        gap={"nominal": {"fit": gap, "held_out": gap}, "calibrated": {"fit": gap, "held_out": gap}},
        noise_floor_m=0.001, unit="rad", parameters=rows,
        graph=Graph(tuple(values), ("elbow",), np.ones((len(rows), 1)), 0.5),
        mismatch=Mismatch(verdict, None, (), (), "", "Planted.", tuple(explanations), 0.01),
        trace=(), replays=(), cancelled=cancelled, warnings=(),
    )  # fmt: skip


def drawn(rng: np.random.Generator, spread: Mapping[str, float] | None = None, **planted: float) -> dict[str, float]:
    """The usual values, `planted` ones (`elbow__damping`) in their place, with a unit's own spread and with noise."""
    values = {}
    for name, usual in USUAL.items():
        joint, _, kind = name.split("@")
        true = planted.get(f"{joint}__{kind}", usual) + rng.normal(0.0, (spread or {}).get(name, 0.0))
        values[name] = true + rng.normal(0.0, STD[name])
    return values


def write(folder: Path, results: Mapping[str, Result]) -> list[Path]:
    """One folder a result."""
    for name, one in results.items():
        write_result(one, folder / name / "result.json")
    return [folder / name for name in results]


def weeks(folder: Path) -> list[Path]:
    """Eight weeks: from the fifth on the elbow drags more, from the seventh it has play, the hand gets ever heavier."""
    rng, results = np.random.default_rng(1), {}
    for week in range(1, 9):
        values = drawn(rng, elbow__damping=0.8 if week < 5 else 1.1, hand__mass=0.3 + 0.008 * week)
        play = week >= 7
        results[f"2026-w{week:02d}"] = result(values, WITH_PLAY if play else NOTHING, "named" if play else "none")
    return write(folder, results)


def units(folder: Path) -> list[Path]:
    """Six units that spread in damping; the third has play in its elbow, the fifth a shoulder that drags."""
    rng, results = np.random.default_rng(5), {}
    for unit in range(1, 7):
        drags = {"shoulder__damping": 2.2} if unit == 5 else {}
        values = drawn(rng, {"shoulder@dyna@damping": 0.05, "elbow@dyna@damping": 0.1}, **drags)
        play = unit == 3
        results[f"unit{unit}"] = result(values, WITH_PLAY if play else NOTHING, "named" if play else "none")
    return write(folder, results)
