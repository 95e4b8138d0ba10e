"""A late camera and a late arm: the same thing where nothing but pucks is seen, and two where encoders are read."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import pytest

from compass_ros.calibration.cost import ROBUST, Point, start
from compass_ros.calibration.differences import linearise
from compass_ros.calibration.least_squares import Fit, minimise
from compass_ros.calibration.likelihood import Likelihood
from compass_ros.cells import load
from compass_ros.cells.drives import Drive
from compass_ros.discovery.candidates import Candidate
from compass_ros.discovery.hypothesis import widened
from compass_ros.discovery.response import respond
from compass_ros.planning.information import information
from compass_ros.planning.plan import cosines
from compass_ros.planning.planned import perfect
from compass_ros.simulation import Simulator
from compass_ros.simulation.effects import EFFECTS, Attached
from compass_ros.types import Floats
from test.discovery.planted import CALM, FREE, RATE, SIGMA

STEP = 1e-5
LATE = ("camera_latency", "actuation_delay")
LATE_S = 0.02


def attached(law: str) -> Attached:
    return Attached(EFFECTS[law], ())


@dataclass(frozen=True)
class Seen:
    """Three shots as a cell takes them."""

    simulator: Simulator
    likelihood: Likelihood
    free: tuple[str, ...] = FREE

    @property
    def index(self) -> list[int]:
        return [self.simulator.cell.index(name) for name in self.free]


@cache
def seen(name: str, planted: str = "", seed: int = 0) -> Seen:
    """By the cell `air_hockey`, `air_hockey_encoders` or `air_hockey_tool`, on a table with a law."""
    rng = np.random.default_rng(seed)
    encoders = Simulator(load("air_hockey_encoders"), threads=2)
    table = encoders.with_effects([attached(planted)] if planted else [])
    values = np.tile([*encoders.defaults, *([LATE_S] if planted else [])], (len(CALM), 1))
    stamps = np.arange(-0.1, encoders.cell.duration, 1 / 240)
    tool = table.observe(values, CALM, np.tile(stamps, (len(CALM), 1)))[:, :, 4:]
    cell, shots = load(name), CALM
    free: tuple[str, ...] = FREE
    simulator = Simulator(cell, threads=2)
    if cell.spec.inputs:
        simulator = simulator.driven([Drive((stamps,), (np.round(path / STEP) * STEP,)) for path in tool])
        shots = np.column_stack([CALM, np.arange(len(CALM))])
        free = tuple("pusher@dyna@damping" if one == "pusher@actuation@vel_discount" else one for one in FREE)
    clean = perfect(simulator, shots, RATE, SIGMA)
    measured = table.observe(values, CALM, clean.time_s)[:, :, : clean.measured.shape[2]]
    sigma = np.broadcast_to([SIGMA] * 4 + [STEP] * (measured.shape[2] - 4), measured.shape)
    noisy: Floats = measured + rng.normal(0, 1, measured.shape) * sigma
    return Seen(simulator, replace(clean, measured=noisy, sigma=sigma), free)


def fitted(of: Seen, law: str = "") -> tuple[float, float]:
    """Half the sum of squares at the best parameters (and size of a law), and that size."""
    laws = [attached(law)] if law else []
    _, likelihood = widened(of.simulator, of.likelihood, laws)
    known = len(of.simulator.defaults)
    free = np.array([*of.index, *([known] if law else [])])
    begun = start(likelihood, np.array([*of.simulator.defaults, *([LATE_S / 2] if law else [])]))
    fit = minimise(likelihood, begun, free, 12, 1e3 * ROBUST)
    return float(fit.point.cost), float(fit.point.values[-1])


def alike(name: str) -> float:
    """Cosine of what a late camera and a late arm do to the recordings, beside the free parameters."""
    of = seen(name)
    free = np.array(of.index)
    point: Point = start(of.likelihood, of.simulator.defaults)
    fit = Fit(point, linearise(of.likelihood, point, free, np.full(len(free), 0.02)), free, 1e3 * ROBUST, 0, True)
    known = information(respond(of.simulator, of.likelihood, fit), [Candidate(attached(law)) for law in LATE])
    return float(cosines(known, known.of_effects()[0])[0, 1])


@pytest.mark.nightly
def test_without_encoders_they_are_twins_and_with_them_hardly_alike() -> None:
    assert alike("air_hockey") > 0.999
    assert alike("air_hockey_encoders") < 0.5


@pytest.mark.nightly
@pytest.mark.parametrize("planted", LATE)
def test_encoders_say_which_it_is(planted: str) -> None:
    other = next(law for law in LATE if law != planted)
    without, beside = seen("air_hockey", planted), seen("air_hockey_encoders", planted)
    assert abs(fitted(without, planted)[0] - fitted(without, other)[0]) < 3, "nothing tells them apart"
    (cost, size), (of_other, _) = fitted(beside, planted), fitted(beside, other)
    assert size == pytest.approx(LATE_S, abs=1e-3)
    assert of_other - cost > 1000


@pytest.mark.nightly
def test_a_measured_path_takes_a_late_arm_as_it_was_and_leaves_a_late_camera() -> None:
    late_arm, late_camera = (seen("air_hockey_tool", law) for law in LATE[::-1])
    plain, (cost, size) = fitted(late_arm)[0], fitted(late_arm, "camera_latency")
    assert plain - cost < 3, "nothing is late beside the path"
    assert abs(size) < 5e-4
    plain, (cost, size) = fitted(late_camera)[0], fitted(late_camera, "camera_latency")
    assert plain - cost > 1000
    assert size == pytest.approx(LATE_S, abs=1e-3)


def test_no_law_of_actuation_is_asked_of_what_follows_a_measured_path() -> None:
    follows, commanded = seen("air_hockey_tool").simulator, seen("air_hockey").simulator
    delay = EFFECTS["actuation_delay"]
    assert not follows.accepts(delay, ())
    assert not follows.accepts(delay, ("pusher_vx", "pusher_vy"))
    assert commanded.accepts(delay, ())
