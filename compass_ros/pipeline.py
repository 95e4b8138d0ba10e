"""The whole method on one page: recordings in, parameters and verdict out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from compass_ros.assembly import assemble
from compass_ros.calibration.refine import Refined, refine
from compass_ros.calibration.safeguard import left_in_few, moved_starts
from compass_ros.cells import Cell
from compass_ros.checks.check import check
from compass_ros.config import CalibrationConfig
from compass_ros.discovery import Discovery, data_bad, discover, fit_failed, not_evaluated
from compass_ros.errors import DataError
from compass_ros.estimation import estimate_parameters
from compass_ros.planning.next_experiment import with_next
from compass_ros.posing import Posed, noise_of
from compass_ros.progress import Steady
from compass_ros.selection import evenly, fitted, split
from compass_ros.simulation import Simulator
from compass_ros.simulation.numerics import unlike_scene
from compass_ros.simulation.replay import recordings
from compass_ros.simulation.windows import usable, windows
from compass_ros.types import Episode, Estimate, Report, Result, silent

Keep = Callable[[Result, Discovery], object]
"""Takes a calibration before the search for missing physics begins: whatever happens to that, it stands."""
CALIBRATION = 0.7
"""Share of the progress that is the calibration's where physics is looked for after it: about its share of the time."""
READ = 3
"""How often it is asked at most how wrong the first states are that were read off a track: a budget."""


def calibrate(
    episodes: Sequence[Episode],
    cell: Cell,
    config: CalibrationConfig,
    report: Report = silent,
    keep: Keep | None = None,
) -> tuple[Result, Discovery]:
    """Which parameters, which values, what is left. Raises DataError where the recordings cannot answer.

    The same episodes, cell and configuration give the same result, bit for bit. Wall time is for the caller to add.
    Where the simulator's time step or its soft dry friction is what is missing, all is done anew with another.
    """
    result, found = _calibrate(episodes, cell, config, report, keep)
    while found.instead is not None:
        result, found = _calibrate(episodes, found.instead, config, report, keep)
    return result, found


def _calibrate(
    episodes: Sequence[Episode], cell: Cell, config: CalibrationConfig, report: Report, keep: Keep | None
) -> tuple[Result, Discovery]:
    checked = check(cell, episodes)
    sound, without_motion = usable(cell, checked.episodes)
    used, steady = evenly(sound, config.episodes), Steady(report)
    first = CALIBRATION if config.discover else 1.0
    simulator = Simulator(cell, threads=config.threads)
    told = list(unlike_scene(cell))
    left_out = (*checked.left_out, *without_motion)

    def noted(one: Result) -> Result:
        return replace(one, warnings=(*told, *checked.said, *one.warnings), left_out=left_out)

    fit, held_out = split(used, config)
    data = recordings(cell, fitted(cell, windows(cell, fit), config))
    judge = recordings(cell, evenly(windows(cell, held_out or fit), config.episodes)).numbered(len(data.names))
    simulator = simulator.driven(data.drives + judge.drives)
    noise = noise_of(cell, data)
    posed = Posed(simulator, data, judge, noise)
    estimate, refined = estimate_parameters(posed.problem, config, steady.share(0.0, first))
    for _ in range(READ):
        if (wider := posed.wider(refined)) is None:
            break
        posed = wider
        estimate, refined = estimate_parameters(posed.problem, config, steady.share(0.0, first))

    def result(found: Discovery) -> Result:
        return assemble(cell, config, posed, bool(held_out), estimate, found)

    told.extend([estimate.note] if estimate.note else [])
    if refined is not None:
        few = left_in_few(refined.likelihood, refined.fit.linear.residual, posed.data.names)
        told.extend(filter(None, (moved_starts(refined), few)))
    if len(used) < len(sound):
        said = f"{len(used)} of {len(sound)} episodes were used, evenly over the order of recording"
        told.append(f"{said}; the option `episodes` takes more")
    if checked.bad:
        found = data_bad(checked.sentence)
    elif not config.discover:
        found = not_evaluated("it was switched off")
    else:
        if keep is not None:
            begun = not_evaluated("the search has not ended")
            keep(noted(result(begun)), begun)
        found = searched(posed, estimate, refined, config, steady.share(first, 1.0))
    return noted(result(found)), found


def searched(
    posed: Posed, estimate: Estimate, refined: Refined | None, config: CalibrationConfig, report: Report
) -> Discovery:
    """What is missing, or why that cannot be said: the calibration stands either way."""
    try:
        refined = refined or refine(posed.problem.likelihood, estimate.values)
        found = discover(posed.simulator, refined, posed.unseen, posed.noise, config.false_alarm, config.seed, report)
    except DataError as error:
        return not_evaluated(str(error))
    except np.linalg.LinAlgError as error:
        return fit_failed(f"a step of the search has no solution ({error})")
    return with_next(found, posed.simulator, config.seed)
