"""Shots that nobody has recorded yet: drawn, judged for chaos, and linearised at the defaults of the cell."""

from __future__ import annotations

import numpy as np

from compass_ros.calibration.cost import ROBUST, start
from compass_ros.calibration.differences import linearise
from compass_ros.calibration.least_squares import Fit
from compass_ros.calibration.likelihood import Likelihood
from compass_ros.calibration.refine import scaled
from compass_ros.calibration.roughness import with_roughness
from compass_ros.cells import Cell
from compass_ros.discovery.response import Response, respond
from compass_ros.errors import ConfigError, DataError
from compass_ros.simulation import Simulator
from compass_ros.types import Bools, Floats

CALM = 400.0
"""Sensitivity above which a shot is chaotic [sigma, rms over frames, per prior width of all parameters together]."""
LIVELY = 10.0
"""Motion of the tracked objects that a shot has to cause [sigma, rms]."""
CLEAR_M, STROKE_M = 0.004, 0.07
"""A pusher starts at least so far from the rims it could touch, and at most so far from one of them."""
_STEP = 0.02
_DRAWS = 4
_TRIES = 40


def linearised(simulator: Simulator, inputs: Floats, rate_hz: float, sigma: float) -> Response:
    """Perfect recordings of (E, A) shots at the defaults, with every tangent; `sigma` [m] of one measurement.

    About 240 rollouts a shot for 64 parameters. What the simulator does roughly, at contacts, counts as noise.
    """
    likelihood = perfect(simulator, inputs, rate_hz, sigma)
    point, free = start(likelihood, simulator.defaults), np.arange(len(likelihood.parameters))
    fit = Fit(point, linearise(likelihood, point, free, np.full(len(free), 0.05)), free, ROBUST, 0, True)
    rough = with_roughness(likelihood, fit)
    fit = Fit(point, scaled(fit.linear, likelihood, rough), free, ROBUST, 0, True)
    return respond(simulator, rough, fit)


def perfect(simulator: Simulator, inputs: Floats, rate_hz: float, sigma: float) -> Likelihood:
    """Recordings without noise of (E, A) shots at the defaults, `sigma` [m] stated."""
    cell = simulator.cell
    time = np.tile(np.arange(0, cell.duration, 1 / rate_hz), (len(inputs), 1))
    measured = simulator.observe(np.tile(simulator.defaults, (len(inputs), 1)), inputs, time)
    return Likelihood(
        predict=simulator.observe,
        parameters=simulator.parameters,
        inputs=inputs,
        time_s=time,
        measured=measured,
        sigma=np.full(measured.shape, sigma),
        correlation_time=1.0,
        launch_std=cell.launch_std,
        prior_mean=simulator.defaults,
        prior_std=np.array([p.half_width for p in simulator.parameters]),
    )


def completed(cell: Cell, actions: Floats) -> Floats:
    """(E, A) inputs of (E, a) actions. Raises ConfigError where the cell's episodes begin as they were measured."""
    if not cell.action or cell.spec.start:
        raise ConfigError(f"{cell.name}: has no shots to plan: episodes begin as measured, not by a command")
    release = [[cell.spec.release.default_s]] if cell.spec.release else [[]]
    return np.concatenate([actions, np.repeat(release, len(actions), axis=0)], axis=1)


def draw(simulator: Simulator, count: int, rng: np.random.Generator, box: Floats | None = None) -> Floats:
    """(count, A) random shots that move something and are not chaotic, from a box (a, 2) or from the reach.

    Raises DataError where there are hardly any.
    """
    found = drawn(simulator, count, rng, box)
    if len(found) < count:
        where = simulator.cell.name
        raise DataError(f"{where}: only {len(found)} shots were found that move something and are not chaotic")
    return found


def drawn(simulator: Simulator, count: int, rng: np.random.Generator, box: Floats | None = None) -> Floats:
    """The same, or those that were found: fewer, perhaps none."""
    cell = simulator.cell
    low, high = (cell.reach if box is None else box).T
    sigma = cell.spec.noise_m
    found: list[Floats] = []
    for _ in range(_TRIES):
        tried = completed(cell, rng.uniform(low, high, (40 * count, len(low))))
        tried = tried[within_stroke(simulator, tried)][: count + count // 2]
        if len(tried):
            found.extend(tried[worth(simulator, tried, sigma)])
        if len(found) >= count:
            break
    return np.array(found[:count]).reshape(-1, len(cell.input_names))


def within_stroke(simulator: Simulator, inputs: Floats) -> Bools:
    """(E,) False where a pusher starts on an object or out of its reach; True in cells that have no pusher."""
    cell = simulator.cell
    names, radii = [a.name for a in cell.action], {p.name: p.default for p in cell.parameters}
    if "pusher@shape@radius" not in radii or not {"x", "y"} <= set(names):
        return np.ones(len(inputs), bool)
    movers = simulator.movers()
    rest = simulator.paths(simulator.defaults[None], inputs[:1], np.array([0.0, 1e-3]), movers)[0, 0, :, :2]
    rims = np.array([radii["pusher@shape@radius"] + radii[f"{name}@shape@radius"] for name in movers])
    place = inputs[:, [names.index("x"), names.index("y")]]
    gap = np.linalg.norm(place[:, None] - rest, axis=2) - rims
    return np.asarray((gap.min(axis=1) > CLEAR_M) & (gap.min(axis=1) < STROKE_M))


def worth(simulator: Simulator, inputs: Floats, sigma: float) -> Bools:
    """(E,) whether a shot moves something and does not amplify small changes of the parameters beyond use."""
    cell, draws = simulator.cell, 1 + _DRAWS
    time = np.tile(np.linspace(0, cell.duration, 40), (draws * len(inputs), 1))
    widths = np.array([p.half_width for p in simulator.parameters])
    signs = np.random.default_rng(0).choice([-1.0, 1.0], (_DRAWS, len(widths)))
    moved = np.concatenate([np.zeros((1, len(widths))), _STEP * signs * widths])
    low, high = (np.array([getattr(p, side) for p in simulator.parameters]) for side in ("low", "high"))
    values = np.repeat(np.clip(simulator.defaults + moved, low, high), len(inputs), axis=0)
    seen = simulator.observe(values, np.tile(inputs, (draws, 1)), time).reshape(draws, len(inputs), 40, -1)
    motion = np.sqrt(np.mean((seen[0] - seen[0][:, :1]) ** 2, axis=(1, 2))) / sigma
    change = np.sqrt(np.mean((seen[1:] - seen[0]) ** 2, axis=(2, 3))).max(axis=0) / sigma / _STEP
    return np.asarray((motion > LIVELY) & (change < CALM))
