"""A law that is within its error bars of zero goes; of two that do nearly the same one stays."""

from __future__ import annotations

import numpy as np

from compass_ros.calibration.cost import start
from compass_ros.calibration.least_squares import minimise
from compass_ros.discovery.hypothesis import Hypothesis, widened
from compass_ros.discovery.odds import Known, Prior
from compass_ros.discovery.search import finish
from compass_ros.simulation.effects import Attached, effect
from test.discovery.planted import PUCKS, asked_of_table, recorded, response_of


def test_of_two_laws_that_do_the_same_one_stays() -> None:
    """Each is unsure beside the other, so that neither is more than two error bars from zero; together they are."""
    laws = [Attached(effect(name), PUCKS) for name in ("viscous_drag", "quadratic_drag")]
    plain = response_of(recorded(laws[0], [0.035]))
    likelihood, free = plain.likelihood, plain.fit.free
    simulator, wider = widened(plain.simulator, likelihood, laws)
    everything = np.concatenate([free, np.arange(len(likelihood.parameters), len(wider.parameters))])
    fit = minimise(wider, start(wider, wider.prior_mean), everything, 20, 4.0)
    both = Hypothesis(tuple(laws), simulator, wider, fit, without=plain.fit.linear.residual)
    assert [both.zero.may_lack([law]) for law in laws] == [True, True]
    assert not both.zero.may_lack(laws)
    alone = Hypothesis((), plain.simulator, likelihood, plain.fit).free.alone
    known = Known(Prior.of(asked_of_table()), alone, {both.name: (both, 0.0)}, set())
    finish(known, (-50.0,))
    assert len(known.models) == 1
    ((left, _),) = known.models.values()
    assert len(left.laws) == 1
    assert left.zero.weakest == ()
