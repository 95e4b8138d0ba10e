"""What a finer time step explains is no evidence for anything; drag is no numerics."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from compass_ros.discovery.evidence import evidences
from compass_ros.discovery.hypothesis import Hypothesis
from compass_ros.discovery.numerics import numerics_as_model
from compass_ros.discovery.planned import perfect
from compass_ros.discovery.response import Response
from compass_ros.simulation import Simulator
from compass_ros.simulation.effects import EFFECTS, Attached
from test.discovery.planted import CALM, PUCKS, RATE, SIGMA, recorded, response_of
from test.simulation.table import cell, simulator


def cause(response: Response) -> str:
    plain = Hypothesis((), response.simulator, response.likelihood, response.fit)
    return numerics_as_model(plain, plain.free.log - plain.free.alone)


@pytest.mark.parametrize(("share", "noise"), [(0.5, 0.01), (0.125, 0.1)])
def test_a_finer_time_step_calls_for_nothing(share: float, noise: float) -> None:
    clean = perfect(simulator(), CALM, RATE, noise * SIGMA)
    finer = Simulator(cell(), options={"timestep": share * simulator().time_step})
    measured = finer.observe(np.tile(simulator().defaults, (len(CALM), 1)), CALM, clean.time_s)
    response = response_of(replace(clean, measured=measured))
    plain = Hypothesis((), response.simulator, response.likelihood, response.fit)
    blind = replace(
        response.tangent, parameters=response.tangent.parameters[:, :, :-1], away=response.tangent.away[:-1]
    )
    assert plain.free.log - plain.free.alone < 0
    assert evidences(response.tangent, [None])[0].log > evidences(blind, [None])[0].log + 5


def test_missing_drag_is_no_numerics() -> None:
    assert cause(response_of(recorded(Attached(EFFECTS["viscous_drag"], PUCKS), [0.3]))) == ""
