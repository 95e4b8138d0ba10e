"""Signals are drawn as they were measured: each number over time, in its unit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from compass_ros.reporting import ReportExtras
from compass_ros.reporting.drawing import figure_data
from compass_ros.reporting.residuals import left_over
from compass_ros.reporting.tracks import Column, drawn
from compass_ros.types import ReplayedTrack, Result, SignalGap
from test.reporting.arm import arm


def track(name: str, size: int) -> ReplayedTrack:
    values = np.zeros((3, size))
    return ReplayedTrack(name, np.arange(3.0), values, values, values, None)


def saying(result: Result, **units: str) -> Result:
    """A result whose signals have these units."""
    signals = {name: SignalGap(1.0, unit, 0.1) for name, unit in units.items()}
    gap = {
        model: {part: replace(one, signals=signals) for part, one in own.items()} for model, own in result.gap.items()
    }
    return replace(result, gap=gap)


def test_joints_are_curves_in_radians(result: Result) -> None:
    of_arm = arm(result)
    data = figure_data(of_arm, ReportExtras())
    elbow, wrist, imu = data["episodes"][0]["tracks"]
    real = next(r for r in of_arm.replays if r.episode == data["episodes"][0]["name"]).tracks[1].real
    assert elbow["columns"] == [{"name": "joints.elbow", "unit": "rad"}]
    assert wrist["real"] == [pytest.approx(real[:, 0], abs=1e-5)]
    assert (elbow["error_unit"], elbow["floor_mm"]) == ("mrad", 0.5)
    assert [column["name"] for column in imu["columns"]] == ["imu wx", "imu wy", "imu wz"]
    assert len(imu["real"]) == len(imu["calibrated"]) == 3
    assert (imu["error_unit"], imu["floor_mm"]) == ("mrad/s", 30.0)


def test_what_is_no_place_is_on_no_map(result: Result) -> None:
    assert figure_data(arm(result), ReportExtras())["maps"]["before"] is None
    assert left_over(arm(result), ReportExtras()) is None


@pytest.mark.parametrize("size", [2, 3, 7])
@pytest.mark.parametrize("known", [True, False])
def test_places_are_drawn_in_the_plane(result: Result, size: int, known: bool) -> None:
    assert drawn(track("ball", size), saying(result, **{"ball": "m"} if known else {})).columns == ()


@pytest.mark.parametrize(
    ("unit", "size", "columns", "thousandth"),
    [
        (
            "N",
            6,
            [("s fx", "N"), ("s fy", "N"), ("s fz", "N"), ("s tx", "N m"), ("s ty", "N m"), ("s tz", "N m")],
            "mN",
        ),
        ("m/s^2", 3, [("s ax", "m/s²"), ("s ay", "m/s²"), ("s az", "m/s²")], "mm/s²"),
        ("m", 1, [("s", "m")], "mm"),
        ("1", 2, [("s 1", ""), ("s 2", "")], "10⁻³"),
    ],
)
def test_every_number_has_its_name_and_unit(
    result: Result, unit: str, size: int, columns: list[tuple[str, str]], thousandth: str
) -> None:
    shown = drawn(track("s", size), saying(result, s=unit))
    assert shown.columns == tuple(Column(*column) for column in columns)
    assert shown.thousandth == thousandth


def test_an_old_result_without_signals_has_the_unit_of_its_errors(result: Result) -> None:
    shown = drawn(track("elbow", 1), replace(saying(result), unit="rad"))
    assert shown.columns == (Column("elbow", "rad"),)
    assert shown.floor == result.noise_floor_m
