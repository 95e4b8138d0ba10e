"""Balls dropped from a bridge: what air does, from a simulator in vacuum. Fitted on drop 1, judged on drop 2.

First height, first velocity and moment of release are free in every drop. The scale of the camera is known to be wrong
by some per cent, differently in each drop: it is left free with a prior of 3 %, about what the heavy balls show, and
every answer is given with and without it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from compass_ros.cells import load
from compass_ros.real.fitting import Fitted, Unknown, fit, gain
from compass_ros.real.imports import episodes
from compass_ros.real.table import Study, Table, with_error
from compass_ros.simulation import Simulator
from compass_ros.simulation.effects import Attached, effect
from compass_ros.types import Episode

CLEAR = 3.0
"""Log evidence from which one explanation is preferred to another."""
_CAMERA = Attached(effect("camera_scale"), ())
SCALE = Unknown(_CAMERA.parameters()[0].name, 0.0, 0.03)
_DRAGS = {name: Attached(effect(name), ("ball",)) for name in ("viscous_drag", "quadratic_drag")}
DRAGS: Mapping[str, Unknown] = {
    "viscous_drag": Unknown(_DRAGS["viscous_drag"].parameters()[0].name, 0.2, 0.5),
    "quadratic_drag": Unknown(_DRAGS["quadratic_drag"].parameters()[0].name, 0.02, 0.05),
}
Say = Callable[[str], None]


@dataclass(frozen=True)
class Answer:
    """What one ball's two drops say."""

    ball: str
    verdict: str
    law: str
    """Name of the drag; empty where none is needed beside the camera's scale."""
    coefficient: tuple[float, float]
    """Value and one standard deviation, the camera's scale left open."""
    closed: tuple[float, float]
    """The same for a camera without bias."""
    over_none: float
    """Log evidence of the law over none, the camera's scale open in both."""
    over_other: float
    """Log evidence of the law over the other law of drag."""
    first: tuple[float, float]
    """rms on drop 1 [m] in vacuum, with the law."""
    second: tuple[float, float, float]
    """rms on drop 2 [m]: vacuum and law for a camera without bias; the law with the scale open in both drops."""
    scales: tuple[float, float]
    """Bias of the camera's scale that drops 1 and 2 ask for, with the law."""


def study(out: Path, data: Path | None, say: Say, balls: Sequence[str] = ()) -> Study:
    """Each ball on its own; `balls`: only these."""
    cell = load("ball_drop")
    recorded = {e.name: e for e in episodes(cell, "ball_drops", out, data)}
    names = balls or sorted({name.rpartition("_drop_")[0] for name in recorded})
    answers = []
    for name in names:
        say(f"ball_drops: {name}")
        answers.append(answer(name, recorded[f"{name}_drop_1"], recorded[f"{name}_drop_2"]))
    light = [a for a in answers if "Whiffle" in a.ball or "Tennis" in a.ball]
    of = {
        v: ", ".join(a.ball.replace("_", " ") for a in answers if a.verdict == v)
        for v in ("named", "ambiguous", "none")
    }
    sentences = [f"Verdict `{verdict}`: {among or 'no ball'}." for verdict, among in of.items()]
    if light:
        worst = max(a.second[2] for a in light)
        sentences.append(f"Whiffle and tennis balls: at most {worst:.2f} m on the drop that was not fitted.")
    return Study("ball_drops", tuple(sentences), (_table(answers),))


def answer(ball: str, first: Episode, second: Episode) -> Answer:
    """Fit each law on the first drop, with the camera's scale open, and judge on the second."""
    simulators = {"": _simulator()} | {name: _simulator(name) for name in DRAGS}
    found = {name: fit(s, [first], _unknowns(name)) for name, s in simulators.items()}
    drags = {name: gain(found[name], found[""], (SCALE.name,)) for name in DRAGS}
    law = max(drags, key=lambda name: drags[name])
    other = next(name for name in DRAGS if name != law)
    apart = gain(found[law], found[other], (SCALE.name,))
    missing = drags[law] > CLEAR and found[law].value(DRAGS[law].name) > 0
    chosen = law if missing else ""
    best, unknown = found[chosen], DRAGS[law]
    biased = abs(best.value(SCALE.name)) > 2.5 * SCALE.width
    verdict = ("named" if apart > CLEAR else "ambiguous") if missing else "ambiguous" if biased else "none"
    closed = fit(simulators[law], [first], (unknown,))
    vacuum = [float(_judge(simulators[""], drop, {}, False).rms[0]) for drop in (first, second)]
    judged = [
        _judge(simulators[chosen], second, {unknown.name: fitted.value(unknown.name)} if chosen else {}, scale)
        for fitted, scale in ((closed, False), (best, True))
    ]
    return Answer(
        ball,
        verdict,
        chosen,
        (found[law].value(unknown.name), found[law].std[unknown.name]),
        (closed.value(unknown.name), closed.std[unknown.name]),
        drags[law],
        apart,
        (vacuum[0], float(best.rms[0])),
        (vacuum[1], float(judged[0].rms[0]), float(judged[1].rms[0])),
        (best.value(SCALE.name), judged[1].value(SCALE.name)),
    )


def _simulator(drag: str = "") -> Simulator:
    return Simulator(load("ball_drop"), [*([_DRAGS[drag]] if drag else []), _CAMERA])


def _unknowns(drag: str) -> tuple[Unknown, ...]:
    return (*((DRAGS[drag],) if drag else ()), SCALE)


def _judge(simulator: Simulator, drop: Episode, known: Mapping[str, float], scale: bool) -> Fitted:
    """First state and release fitted to a drop, the law as it is."""
    return fit(simulator, [drop], (SCALE,) if scale else (), True, known)


def _table(answers: Sequence[Answer]) -> Table:
    columns: tuple[str, ...] = (
        "ball",
        "verdict",
        "law",
        "coefficient",
        "camera without bias",
        "log evidence over none",
        "over the other law",
    )
    columns += ("drop 1 rms, vacuum [m]", "law and scale", "scale in drop 1", "scale in drop 2")
    columns += ("drop 2 rms, vacuum [m]", "law", "law and scale")
    rows = []
    for a in answers:
        unit = "1/s" if a.law == "viscous_drag" else "1/m"
        coefficients = tuple(f"{with_error(*c)} {unit}" if a.law else "-" for c in (a.coefficient, a.closed))
        numbers = (f"{a.over_none:.1f}", f"{a.over_other:.1f}" if a.law else "-")
        scales = tuple(f"{100 * s:+.1f} %" for s in a.scales)
        rms = (*(f"{x:.2f}" for x in a.first), *scales, *(f"{x:.2f}" for x in a.second))
        law = a.law or ("drag or camera_scale" if a.verdict == "ambiguous" else "-")
        law += " (or quadratic_drag)" if a.law and a.verdict == "ambiguous" else ""
        rows.append((a.ball.replace("_", " "), a.verdict, law, *coefficients, *numbers, *rms))
    return Table("Balls: fitted on drop 1, judged on drop 2", columns, tuple(rows))
