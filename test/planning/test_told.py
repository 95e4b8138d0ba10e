"""What recordings tell of parameters is said before any fit, as it is known from mechanics."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from compass_ros.planning.excitation import Shown, recorded
from compass_ros.planning.motions import limits, motions, size
from compass_ros.reporting.words import told_lines
from compass_ros.simulation import Simulator
from compass_ros.simulation.driven import driven_joints, virtual_recordings
from test.planning.scenes import (
    ARMATURE,
    CENTRE,
    DAMPING,
    DELAY,
    GAIN,
    GRAVITY,
    MASS,
    MOTOR,
    OFFSET,
    POSITION,
    VELOCITY,
    ZERO,
    link,
)

UPRIGHT = "0 -9.81 0"
"""Gravity along the axis of the joint: it never turns the link."""


@dataclass(frozen=True)
class Case:
    parameters: list[str]
    drive: str = POSITION
    gravity: str = "0 0 -9.81"
    pos: str = "0.2 0 0"
    alone: frozenset[str] = frozenset()
    together: frozenset[str] = frozenset()
    ratios: bool = False
    not_at_all: frozenset[str] = frozenset()


CASES = {
    "torque shows mass times lever": Case(
        [MASS, CENTRE.format(2, -0.2), ARMATURE, DAMPING], MOTOR, pos="0 0 -0.2",
        alone=frozenset({"damping"}), together=frozenset({"mass", "centre", "armature"}),
    ),
    "with the lever known, the mass": Case(
        [MASS, ARMATURE, DAMPING], MOTOR, pos="0 0 -0.2", alone=frozenset({"mass", "armature", "damping"}),
    ),
    "a servo without gravity shows ratios": Case(
        [GAIN, ARMATURE, DAMPING, MASS], gravity=UPRIGHT, together=frozenset({"gain", "armature", "mass"}),
    ),
    "no mass on the axis of a joint": Case(
        [MASS, DELAY, GAIN], gravity=UPRIGHT, pos="0 0 0", alone=frozenset({"delay", "gain"}),
        not_at_all=frozenset({"mass"}),
    ),
    "no centre along the axis": Case(
        [CENTRE.format(1, 0.0), DAMPING, DELAY], VELOCITY, alone=frozenset({"delay"}), not_at_all=frozenset({"centre"}),
    ),
    "no zero of an encoder without gravity": Case(
        [ZERO, OFFSET, DELAY, DAMPING], gravity=UPRIGHT, alone=frozenset({"delay", "damping", "offset"}),
        not_at_all=frozenset({"zero"}),
    ),
    "gravity times mass": Case(
        [MASS, GRAVITY, ARMATURE, DELAY], alone=frozenset({"delay"}), together=frozenset({"mass", "gravity"}),
    ),
    "gravity tells them apart": Case(
        [ZERO, GAIN, DELAY], alone=frozenset({"zero", "gain", "delay"}),
    ),
}  # fmt: skip


def by_chance(case: Case, folder: Path, count: int = 3) -> Shown:
    simulator = Simulator(link(folder, case.parameters, case.drive, case.gravity, case.pos))
    driven, rng = driven_joints(simulator), np.random.default_rng(0)
    tried = motions(simulator, driven, limits(driven, 3.0), 2.0, rng.normal(size=(count, size(driven))))
    assert tried.sound.all()
    episodes = virtual_recordings(simulator, driven, simulator.defaults, tried.time_s, tried.series, tried.posture, rng)
    return recorded(simulator, episodes)[0]


@pytest.mark.parametrize("name", CASES)
def test_what_mechanics_says_is_said(name: str, tmp_path: Path) -> None:
    case = CASES[name]
    shown = by_chance(case, tmp_path)
    told = shown.told
    kinds = {how: {n.rpartition("@")[2] for n in getattr(told, how)} for how in ("alone", "weakly", "not_at_all")}
    together = {n.rpartition("@")[2] for group in told.together for n in group.parameters}
    lines = "; ".join(told_lines(told))
    assert case.alone <= kinds["alone"], lines
    assert case.together <= together, lines
    assert case.not_at_all == kinds["not_at_all"], lines
    assert not together & kinds["alone"], lines
    assert shown.seconds == pytest.approx(6.0, abs=0.05)
