"""What a calibration found, as a `Result`: gaps of each model, tables, drawings."""

from __future__ import annotations

import platform
from dataclasses import replace
from importlib.metadata import version

import numpy as np

from compass_ros.calibration.identifiability import IDENTIFIED
from compass_ros.cells import Cell
from compass_ros.cells.signals import Signal
from compass_ros.config import CalibrationConfig
from compass_ros.discovery import Discovery
from compass_ros.discovery.floor import honest
from compass_ros.posing import Posed, noise_floor
from compass_ros.simulation.replay import Recordings, Replay
from compass_ros.types import Budget, Estimate, Floats, Gap, Graph, Mismatch, ParameterRow, ReplayedTrack, Result
from compass_ros.types import Replay as Drawn


def assemble(
    cell: Cell,
    config: CalibrationConfig,
    posed: Posed,
    held_out: bool,
    estimate: Estimate,
    found: Discovery,
) -> Result:
    """Gaps on all episodes for each model, tables and drawings."""
    simulator, data, judge, noise = posed.simulator, posed.data, posed.judge, posed.noise
    values = found.parameters if found.parameters is not None else estimate.values
    alone = np.full(len(values), np.nan) if found.parameters is None else estimate.values
    std, identifiable = estimate.std, estimate.identifiable
    if found.std is not None:  # beside an effect a parameter can be less sure than it was alone
        std = found.std
        identifiable = identifiable & (std < IDENTIFIED * np.array([p.half_width for p in cell.parameters]))
    models = {"nominal": (simulator, simulator.defaults), "calibrated": (simulator, estimate.values)}
    if found.simulator is not None and found.values is not None:
        models["with_effects"] = (found.simulator, found.values)
    own, replays, gap = (found.noise or noise).rms, {}, dict[str, dict[str, Gap]]()
    for name, (s, v) in models.items():
        fit, unseen = posed.yardsticks if s is simulator else replace(posed, simulator=s).yardsticks
        replays[name] = fit.replay(v), unseen.replay(v), v
        gap[name] = {"fit": fit.gap(v, own)} | ({"held_out": unseen.gap(v, own)} if held_out else {})
    floor = noise_floor(cell, found.noise or noise)
    graph = estimate.graph or Graph(
        tuple(p.name for p in cell.parameters),
        tuple(f.name for f in cell.factors),
        np.zeros((len(cell.parameters), len(cell.factors))),
        0.5,
    )
    rows = tuple(
        ParameterRow(p.name, p.unit, p.default, float(v), float(s), (p.low, p.high), bool(a), bool(i), float(w))
        for p, v, s, a, i, w in zip(cell.parameters, values, std, graph.active(), identifiable, alone, strict=True)
    )
    drawn = _draw(cell, data, {n: (r[0], r[2]) for n, r in replays.items()}, held_out=False)
    if held_out:
        drawn += _draw(cell, judge, {n: (r[1], r[2]) for n, r in replays.items()}, held_out=True)
    return Result(
        cell=cell.name,
        method=estimate.method,
        seed=config.seed,
        versions=versions(),
        budget=Budget(simulator.rollouts, simulator.simulated_seconds, 0.0),
        fit=data.names,
        held_out=judge.names if held_out else (),
        gap=gap,  # type: ignore[arg-type]  # keys are the literals by construction
        noise_floor_m=floor,
        parameters=rows,
        graph=graph,
        mismatch=honest(
            found.mismatch if held_out else _unopened(found.mismatch),
            gap["with_effects" if "with_effects" in gap else "calibrated"]["held_out" if held_out else "fit"].rmse_m,
            floor,
            found.open_sigma,
        ),
        trace=estimate.trace,
        replays=drawn,
        cancelled=estimate.stop_reason.startswith("cancelled"),
        warnings=(*found.warnings, *simulator.warnings),
        unit=simulator.unit,
        together=estimate.together,
        time_step_s=cell.time_step,
        friction_holds=cell.holds,
    )


def _unopened(mismatch: Mismatch) -> Mismatch:
    """Where no episode was held out: without errors that say how well such ones are predicted."""
    return replace(mismatch, explanations=tuple(replace(one, held_out=None) for one in mismatch.explanations))


def versions() -> dict[str, str]:
    """What the numbers depend on."""
    names = ("compass_ros", "mujoco", "numpy", "scipy")
    return {"python": platform.python_version()} | {name: version(name) for name in names}


def _draw(cell: Cell, data: Recordings, models: dict[str, tuple[Replay, Floats]], held_out: bool) -> tuple[Drawn, ...]:
    episodes = np.arange(len(data.names))
    predicted = {
        name: replay.predict(np.tile(values, (len(episodes), 1)), episodes) for name, (replay, values) in models.items()
    }
    columns = {name: own for signal in cell.signals for name, own in _drawn_together(signal).items()}
    out = []
    for e, name in enumerate(data.names):
        tracks = []
        for obj, own in columns.items():
            seen = ~np.isnan(data.measured[e][:, own]).any(axis=1)
            pick = {model: values[e][seen][:, own] for model, values in predicted.items()}
            tracks.append(
                ReplayedTrack(
                    obj,
                    data.time_s[e][seen],
                    data.measured[e][seen][:, own],
                    pick["nominal"],
                    pick["calibrated"],
                    pick.get("with_effects"),
                )
            )
        out.append(Drawn(name, held_out, tuple(tracks)))
    return tuple(out)


def _drawn_together(signal: Signal) -> dict[str, list[int]]:
    """Columns of an observation that are one track: all numbers of a body, of a signal of joints each by itself."""
    own = range(signal.first, signal.columns.stop)
    if signal.jointed and signal.size > 1:
        return {f"{signal.name}.{number}": [column] for number, column in zip(signal.numbers, own, strict=True)}
    return {signal.name: list(own)}
