"""What parameters swallow of a change, along their tangents and when they really move."""

from __future__ import annotations

import numpy as np

from compass_ros.concealed.absorption import Absorber, rms
from compass_ros.simulation import Simulator
from test.concealed.scene import INPUTS, TIMES, cell


def test_what_other_parameters_do_is_swallowed_when_they_really_move() -> None:
    """A slower pusher and smoother pucks: a change that is far from straight, and of parameters alone."""
    own = cell()
    absorber = Absorber(own, own.defaults, INPUTS, TIMES[0])
    names = ("pusher@actuation@vel_discount", "puck1@dyna@friction_sliding", "puck2@dyna@friction_sliding")
    moved = own.defaults.copy()
    for index in map(own.index, names):
        moved[index] -= 0.1 * own.parameters[index].half_width
    played = Simulator(own, threads=1).observe(np.tile(moved, (len(INPUTS), 1)), INPUTS, TIMES)
    change = played - absorber.plain
    first, really = rms(absorber.left(change)), rms(absorber.really_left(change))
    assert rms(change) > 10e-3
    assert first > 1e-3
    assert really < 0.5 * first


def test_what_no_parameter_does_is_left() -> None:
    own = cell()
    absorber = Absorber(own, own.defaults, INPUTS, TIMES[0])
    shaken = 3e-3 * np.sin(40.0 * np.arange(len(TIMES[0])))[None, :, None] * np.ones((len(INPUTS), 1, 4))
    assert rms(absorber.really_left(shaken)) > 0.8 * rms(shaken)
