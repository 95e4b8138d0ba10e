"""What a discrepancy is sized by: the forces at work on a joint, not the little that a servo lets them move it."""

from __future__ import annotations

import numpy as np
import pytest

from compass_ros.calibration.cost import start
from compass_ros.calibration.least_squares import minimise
from compass_ros.discovery.discrepancy import free
from compass_ros.discovery.response import Response, respond
from compass_ros.discovery.where import whereabouts
from compass_ros.posing import noise_of, pose
from compass_ros.simulation import Simulator
from compass_ros.simulation.effects import Attached
from compass_ros.simulation.replay import recordings
from test.discovery.servo import NOISE, TRUTH, noisy, servo
from test.discovery.test_weigh import GUST

GRAVITY = 0.1 * 9.81 * 0.1
"""Torque of the bar while it is held level [N m]."""


@pytest.fixture(scope="module")
def held(tmp_path_factory: pytest.TempPathFactory) -> Response:
    """A bar that is held nearly level, while something that no law of the library is pushes it for 0.2 s."""
    cell = servo(tmp_path_factory.mktemp("cell"))
    goals = np.linspace(-0.2, 0.2, 6)
    laws, truth = [Attached(GUST, ("axis",))], cell.values(TRUTH)
    episodes = noisy(
        Simulator(cell, laws, threads=1), [*truth, 0.2, 0.6, 0.2], np.stack([goals, goals], 1), 1.2, NOISE, 0
    )
    simulator, data = Simulator(cell, threads=1), recordings(cell, episodes)
    noise = noise_of(cell, data)
    likelihood = pose(simulator, data, noise).likelihood
    fit = minimise(likelihood, start(likelihood, truth), np.arange(2), 10, 4.0)
    return respond(simulator, likelihood, fit)


def test_a_joint_that_stands_still_is_sized_by_what_holds_it(held: Response) -> None:
    assert held.unit[0] > 0.9 * GRAVITY / held.inertia[0]


def test_a_push_on_a_joint_that_is_held_is_one_of_forces(held: Response) -> None:
    """And not an error of its encoder, as which it would be seen if it were sized by the joint's acceleration."""
    found = free(held)
    assert whereabouts(held, found).channel == "dynamics"
    assert found.log > found.alone + 100
