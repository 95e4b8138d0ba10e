"""What no law explains is located: in the force on one joint, or in one encoder of an arm, however large the others."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from compass_ros.calibration.cost import start
from compass_ros.calibration.least_squares import minimise
from compass_ros.discovery.discrepancy import free
from compass_ros.discovery.response import respond
from compass_ros.discovery.where import whereabouts
from compass_ros.simulation import Simulator
from compass_ros.simulation.effects import Attached
from compass_ros.types import Where
from test.discovery import asked
from test.discovery.test_weigh import GUST
from test.simulation import robots

JOINTS = ("s", "e")


def located(folder: Path, law: list[Attached], numbers: list[float], encoder: int | None = None) -> Where:
    """Of an arm with an unknown law, or an encoder that wanders by 10 mrad and back in every episode."""
    cell = asked.arm(folder)
    simulator, inputs = Simulator(cell, threads=1), asked.steps(cell, 6)
    likelihood = robots.recorded(simulator, law, numbers, inputs)
    rng = np.random.default_rng(1)
    measured = likelihood.measured + rng.normal(0, likelihood.sigma)
    if encoder is not None:
        phase = rng.uniform(0, 2 * np.pi, (len(inputs), 1))
        measured[:, :, encoder] += 0.01 * np.sin(4 * likelihood.time_s + phase)
    likelihood = replace(likelihood, measured=measured)
    fit = minimise(likelihood, start(likelihood, simulator.defaults), np.arange(6), 6)
    response = respond(simulator, likelihood, fit)
    return whereabouts(response, free(response))


@pytest.mark.parametrize("joint", JOINTS)
def test_a_gust_on_one_joint_is_on_that_joint(tmp_path: Path, joint: str) -> None:
    found = located(tmp_path, [Attached(GUST, (joint,))], [0.5, 1.2, 0.3])
    assert (found.channel, found.object) == ("dynamics", joint)


@pytest.mark.parametrize("encoder", [0, 1])
def test_an_encoder_that_wanders_is_that_encoder(tmp_path: Path, encoder: int) -> None:
    found = located(tmp_path, [], [], encoder)
    assert (found.channel, found.object) == ("sensing", f"joints.{JOINTS[encoder]}")
