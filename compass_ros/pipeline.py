"""The whole method on one page: recordings in, parameters and verdict out."""

from __future__ import annotations

import hashlib
import platform
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from importlib.metadata import version

import numpy as np

from compass_ros.calibration.causal_map import causal_map_refined
from compass_ros.calibration.identifiability import IDENTIFIED
from compass_ros.calibration.likelihood import Likelihood
from compass_ros.calibration.methods import compass_config, method
from compass_ros.calibration.noise import Noise, measure_noise
from compass_ros.calibration.problem import Allowance, Problem
from compass_ros.calibration.refine import Refined, refine, with_launches
from compass_ros.calibration.safeguard import farther
from compass_ros.cells import Cell
from compass_ros.checks.check import check
from compass_ros.config import CalibrationConfig
from compass_ros.discovery import Discovery, data_bad, discover, fit_failed, not_evaluated
from compass_ros.discovery.floor import honest
from compass_ros.discovery.unseen import unexpected
from compass_ros.errors import DataError
from compass_ros.progress import Steady
from compass_ros.simulation import Simulator
from compass_ros.simulation.factors import factor_distance
from compass_ros.simulation.manifold import apart, charted, on_manifold
from compass_ros.simulation.replay import Recordings, Replay, floored, recordings, rms_distance
from compass_ros.simulation.windows import windows
from compass_ros.types import (
    Budget,
    Episode,
    Estimate,
    Floats,
    Gap,
    Graph,
    ParameterRow,
    ReplayedTrack,
    Report,
    Result,
    silent,
)
from compass_ros.types import Replay as Drawn

Keep = Callable[[Result, Discovery], object]
"""Takes a calibration before the search for missing physics begins: whatever happens to that, it stands."""
CALIBRATION = 0.7
"""Share of the progress that is the calibration's where physics is looked for after it: about its share of the time."""


def calibrate(
    episodes: Sequence[Episode],
    cell: Cell,
    config: CalibrationConfig,
    report: Report = silent,
    keep: Keep | None = None,
) -> tuple[Result, Discovery]:
    """Which parameters, which values, what is left. Raises DataError where the recordings cannot answer.

    The same episodes, cell and configuration give the same result, bit for bit. Wall time is for the caller to add.
    """
    checked = check(cell, episodes)
    used, steady = evenly(checked.episodes, config.episodes), Steady(report)
    first = CALIBRATION if config.discover else 1.0
    simulator = Simulator(cell, threads=config.threads)
    told: list[str] = []

    def noted(result: Result) -> Result:
        return replace(result, warnings=(*told, *checked.said, *result.warnings), left_out=checked.left_out)

    for turn in range(2):
        fit, held_out = split(used, config, turn)
        most = config.windows if cell.spec.windows else config.episodes
        data = recordings(cell, evenly(windows(cell, fit), most))
        judge = recordings(cell, evenly(windows(cell, held_out or fit), config.episodes))
        judge = judge.numbered(len(data.names))
        simulator = simulator.driven(data.drives + judge.drives)
        noise = measure_noise(data.time_s, data.measured, cell.spec.noise_m, data.stated)
        yardsticks = Yardstick(simulator, data, noise), Yardstick(simulator, judge, noise)
        problem, unseen = pose(simulator, data, noise, yardsticks[0]), pose(simulator, judge, noise).likelihood

        estimate, refined = estimate_parameters(problem, config, steady.share(0.0, first))
        if checked.bad:
            found = data_bad(checked.sentence)
            break
        if not config.discover:
            found = not_evaluated("it was switched off")
            break
        if keep is not None:
            begun = not_evaluated("the search has not ended")
            known = assemble(cell, config, simulator, data, judge, bool(held_out), noise, estimate, begun, yardsticks)
            keep(noted(known), begun)
        may_turn = turn == 0 and 0 < 2 * len(held_out) <= len(used)
        rest = steady.share(first, 1.0)
        found = searched(simulator, problem, estimate, refined, unseen, noise, config.seed, may_turn, rest)
        if not (may_turn and found.untaught):
            break
        told.append(
            f"what fits the other episodes to the noise does not predict {', '.join(judge.names)}: these are fitted, "
            "others are held out"
        )
    result = assemble(cell, config, simulator, data, judge, bool(held_out), noise, estimate, found, yardsticks)
    if estimate.note:
        told.append(estimate.note)
    if len(used) < len(checked.episodes):
        said = f"{len(used)} of {len(checked.episodes)} episodes were used, evenly over the order of recording"
        told.append(f"{said}; the option `episodes` takes more")
    return noted(result), found


def searched(
    simulator: Simulator,
    problem: Problem,
    estimate: Estimate,
    refined: Refined | None,
    unseen: Likelihood,
    noise: Noise,
    seed: int,
    may_turn: bool,
    report: Report,
) -> Discovery:
    """What is missing, or why that cannot be said: the calibration stands either way.

    `may_turn`: not looked for where what fits these episodes to the noise does not predict the others.
    """
    try:
        refined = refined or refine(problem.likelihood, estimate.values)
        if may_turn and unexpected(unseen, refined):
            return replace(not_evaluated("other episodes are needed"), untaught=True)
        return discover(simulator, refined, unseen, noise, seed, report)
    except DataError as error:
        return not_evaluated(str(error))
    except np.linalg.LinAlgError as error:
        return fit_failed(f"a step of the search has no solution ({error})")


def evenly(episodes: Sequence[Episode], most: int) -> list[Episode]:
    """All episodes where they are not more than `most`; else so many of them, evenly over the order of recording.

    A calibration's time and memory grow with its episodes, its error bars shrink with their square root.
    """
    ordered = sorted(episodes, key=lambda e: (e.start_ns, e.name, e.source))
    if len(ordered) <= most:
        return ordered
    return [ordered[i] for i in np.round(np.linspace(0, len(ordered) - 1, most)).astype(int)]


def split(episodes: Sequence[Episode], config: CalibrationConfig, turn: int = 0) -> tuple[list[Episode], list[Episode]]:
    """Episodes to fit and episodes that are never fitted; the choice depends on names and seed alone.

    At the next `turn` others are held out.
    """
    if not episodes:
        raise DataError("no episodes: nothing to calibrate with")

    def rank(episode: Episode) -> str:
        return hashlib.sha256(f"{config.seed}/{episode.name}".encode()).hexdigest()

    count = round(config.held_out_share * len(episodes)) if len(episodes) > 1 else 0
    chosen = {e.name for e in sorted(episodes, key=rank)[turn * count : (turn + 1) * count]}
    ordered = sorted(episodes, key=lambda e: (e.name, e.start_ns))
    return [e for e in ordered if e.name not in chosen], [e for e in ordered if e.name in chosen]


class Yardstick:
    """How far a simulator is from recordings, as it is reported; what was asked once is not simulated again."""

    def __init__(self, simulator: Simulator, data: Recordings, noise: Noise) -> None:
        self._asked = (simulator, data, noise)
        self._known: dict[bytes, tuple[Replay, Gap]] = {}

    def replay(self, values: Floats) -> Replay:
        """Of (P,) values, each episode with the launch that agrees best with it."""
        return self._at(values)[0]

    def gap(self, values: Floats, noise: Floats) -> Gap:
        """As `Replay.gap` has it."""
        return floored(self._asked[0], self._at(values)[1], noise)

    def distance(self, values: Floats) -> float:
        """rms distance [m or rad]."""
        return self._at(values)[1].rmse_m

    def _at(self, values: Floats) -> tuple[Replay, Gap]:
        key = values.tobytes()
        if key not in self._known:
            replay = launched(*self._asked, values)
            self._known[key] = replay, replay.gap(values)
        return self._known[key]


def pose(simulator: Simulator, data: Recordings, noise: Noise, yardstick: Yardstick | None = None) -> Problem:
    """Recordings and a simulator as the problem that every method is given."""
    cell = simulator.cell
    replay = Replay(simulator, data)
    likelihood = Likelihood(
        predict=simulator.observe,
        predict_alike=simulator.observe_alike,
        difference=partial(apart, cell),
        windowed=cell.spec.windows is not None,
        parameters=simulator.parameters,
        inputs=simulator.inputs(data.inputs),
        time_s=data.time_s,
        measured=np.where(cell.fitted, charted(cell, data.measured), np.nan),
        sigma=on_manifold(cell, noise.of(data.measured)),
        correlation_time=noise.correlation_time,
        launch_std=simulator.launch_std(simulator.defaults, data.start_std),
        prior_mean=simulator.defaults,
        prior_std=np.array([p.half_width for p in simulator.parameters]),
    )
    return Problem(
        differences=replay.differences,
        trajectories=replay.predict,
        measured=np.nan_to_num(data.measured),
        weight=np.where(np.isnan(data.measured) | ~cell.fitted, 0.0, 1 / noise.of(data.measured)),
        actions=data.inputs,
        parameters=simulator.parameters,
        factors=tuple(f.name for f in cell.factors),
        start=simulator.defaults,
        simulated_seconds=cell.duration,
        apart=partial(factor_distance, cell),
        distance=(yardstick or Yardstick(simulator, data, noise)).distance,
        likelihood=likelihood,
    )


def estimate_parameters(problem: Problem, config: CalibrationConfig, report: Report) -> tuple[Estimate, Refined | None]:
    """Run the configured method; ours hands on the fit that it ends with. No answer is farther than the start."""
    estimate, refined = _estimate(problem, config, report)
    distance, found, begun = problem.distance, estimate.values, problem.start
    if distance(found) > distance(begun):
        note = farther(distance, found, begun, begun)
        return replace(estimate, values=begun, std=np.full(len(begun), np.nan), note=note), None
    return estimate, refined


def _estimate(problem: Problem, config: CalibrationConfig, report: Report) -> tuple[Estimate, Refined | None]:
    if config.method in ("default", "causal-map"):
        return causal_map_refined(problem, report)
    compass = config.compass
    real = min(compass.n_cmd_action, len(problem.actions))
    allowance = Allowance(compass.n_round, real, compass.n_sim)
    if config.rollouts:
        iterations = max(config.rollouts // allowance.per_iteration, 1)
        allowance = Allowance(iterations, real, max(min(compass.n_sim, config.rollouts // (iterations * real)), 2))
    if config.method == "compass":
        from compass_ros.calibration.compass import compass as run  # torch takes seconds to import

        settings = compass_config(allowance, compass)
        p = problem
        return run(p.differences, p.actions, p.parameters, p.factors, p.start, settings, config.seed, report), None
    return method(config.method).run(problem, allowance, config.seed, report), None


def assemble(
    cell: Cell,
    config: CalibrationConfig,
    simulator: Simulator,
    data: Recordings,
    judge: Recordings,
    held_out: bool,
    noise: Noise,
    estimate: Estimate,
    found: Discovery,
    yardsticks: tuple[Yardstick, Yardstick] | None = None,
) -> Result:
    """Gaps on all episodes for each model, tables and drawings. `yardsticks`: of what is fitted, of what judges."""
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
    of_cell = yardsticks or (Yardstick(simulator, data, noise), Yardstick(simulator, judge, noise))
    for name, (s, v) in models.items():
        fit, unseen = of_cell if s is simulator else (Yardstick(s, data, noise), Yardstick(s, judge, noise))
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
        mismatch=honest(found.mismatch, gap["calibrated"]["held_out" if held_out else "fit"].rmse_m, floor),
        trace=estimate.trace,
        replays=drawn,
        cancelled=estimate.stop_reason.startswith("cancelled"),
        warnings=(*found.warnings, *simulator.warnings),
        unit=simulator.unit,
        together=estimate.together,
    )


def launched(simulator: Simulator, data: Recordings, noise: Noise, values: Floats) -> Replay:
    """A replay of (P,) values in which each episode has the launch that agrees best with it.

    How an arm repeats itself, or a first state that was measured with noise, differs from shot to shot: it says
    nothing about a simulator. Where the cell calls its launches exact they stay as commanded.
    """
    likelihood = replace(
        pose(simulator, data, noise).likelihood, launch_std=simulator.launch_std(values, data.start_std)
    )
    return Replay(simulator, data, with_launches(likelihood, values).launch)


def noise_floor(cell: Cell, noise: Noise) -> float:
    """Root mean square distance that the noise alone leaves [m]: of positions, as in `Gap.rmse_m`."""
    return rms_distance(cell, noise.rms[None, None])


def versions() -> dict[str, str]:
    """What the numbers depend on."""
    names = ("compass_ros", "mujoco", "numpy", "scipy")
    return {"python": platform.python_version()} | {name: version(name) for name in names}


def _draw(cell: Cell, data: Recordings, models: dict[str, tuple[Replay, Floats]], held_out: bool) -> tuple[Drawn, ...]:
    episodes = np.arange(len(data.names))
    predicted = {
        name: replay.predict(np.tile(values, (len(episodes), 1)), episodes) for name, (replay, values) in models.items()
    }
    columns = {s.name: list(range(s.first, s.columns.stop)) for s in cell.signals}
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
