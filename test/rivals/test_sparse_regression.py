"""A planted force is named from accelerations where the tracks are nearly exact; noise alone is not named."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from compass_ros.rivals.accelerations import accelerations, in_flight
from compass_ros.rivals.calibrated import rms
from compass_ros.rivals.sparse_regression import optimisers, regress, residual_accelerations, sparse_regression
from test.by_night import but
from test.rivals.planted import played

BOTH = ("puck1", "puck2")


PLANTED = (("viscous_drag", [0.04]), ("quadratic_drag", [0.1]), ("table_tilt", [0.002, -0.001]), ("magnus", [0.1]))


@pytest.mark.parametrize(("name", "numbers"), but(PLANTED, PLANTED[0], PLANTED[3]))
def test_a_planted_force_is_named(name: str, numbers: list[float]) -> None:
    given = played([(name, BOTH, numbers)], sigma=2e-5)
    model = sparse_regression(given, windows_s=(0.2, 0.3))
    assert model is not None
    assert model.names == (name,)
    found = next(values for attached, values in model.effects if attached.effect.name == name)
    np.testing.assert_allclose(found, numbers, rtol=0.15)
    assert model.held_out_m < 0.1 * rms(given.held_out.predicted, given.held_out.data.measured)


def test_a_body_that_never_slid_freely_is_no_obstacle() -> None:
    given = played([("viscous_drag", ("puck1",), [0.1])], sigma=2e-5)
    measured = given.fit.data.measured.copy()
    measured[:, :, 2:] = np.nan  # puck2
    unseen = replace(given.fit, data=replace(given.fit.data, measured=measured))
    model = sparse_regression(replace(given, fit=unseen), windows_s=(0.2,))
    assert model is not None
    assert model.names == ("viscous_drag",)


def test_noise_is_not_named() -> None:
    assert sparse_regression(played(), windows_s=(0.2, 0.3)) is None


def test_residual_accelerations_are_the_planted_ones() -> None:
    """Linear drag of 0.1/s: whatever the smoothing, the residual is -0.1 v, also where the tracks have parted."""
    given = played([("viscous_drag", BOTH, [0.1])], sigma=1e-6)
    found = residual_accelerations(given, *accelerations(given, given.fit, 0.2))
    assert len(found.time) > 50
    error = found.acceleration + 0.1 * found.state[:, 2:]
    assert np.median(np.linalg.norm(error, axis=1)) < 0.01 * np.median(np.linalg.norm(found.state[:, 2:], axis=1))


def test_flight_ends_at_contacts_and_at_rest() -> None:
    time = np.arange(60) / 60
    speed = np.where(time < 0.5, 0.3, -0.2)
    speed[50:] = 0.01
    path = np.stack([np.cumsum(speed) / 60, 0 * time, speed, 0 * time], axis=1)
    free = in_flight(path, time)
    assert free[:26].all()
    assert not free[28:32].any()
    assert free[34:46].all()
    assert not free[50:].any()


def test_regression_keeps_what_is_there() -> None:
    columns = np.random.default_rng(0).standard_normal((200, 4)) * [1.0, 10.0, 0.1, 0.0]
    found = regress(columns, columns @ [0.0, 0.02, 3.0, 0.0], optimisers()["STLSQ 0.05 m/s^2"])
    np.testing.assert_allclose(found, [0.0, 0.02, 3.0, 0.0], atol=0.01)
    assert found[[0, 3]].tolist() == [0.0, 0.0]
