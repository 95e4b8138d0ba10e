"""Proposed motions: within limits when MuJoCo plays the table, worth what is promised of them, read again by import."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
import pytest
from rich.console import Console

from compass_ros.calibration.refine import refine
from compass_ros.cells import Cell
from compass_ros.commands.motions_output import print_motions, write_motions
from compass_ros.episodes.tables import import_tables
from compass_ros.errors import ConfigError, DataError
from compass_ros.operation.current import read_usable
from compass_ros.planning.driven import Wishes, plan_driven
from compass_ros.planning.excitation import Plan, Proposal
from compass_ros.planning.motions import EFFORT, OVER, limits, motions, size
from compass_ros.posing import noise_of, pose
from compass_ros.simulation import Simulator
from compass_ros.simulation.driven import SETTLED_S, driven_joints, virtual_recordings
from compass_ros.simulation.replay import recordings
from compass_ros.simulation.windows import windows
from compass_ros.types import Episode, Floats
from test.planning.scenes import DAMPING, GAIN, MASS, MOTOR, STRONG, VELOCITY, arm, link


@dataclass(frozen=True)
class Case:
    cell: Callable[[Path], Cell]
    speed: float
    effort: Floats


CASES = {
    "arm, slow": Case(arm, 0.5, np.array([20.0, 9.0])),
    "arm, fast": Case(arm, 4.0, np.array([20.0, 9.0])),
    "arm with a weak shoulder": Case(lambda folder: arm(folder, 7.0), 4.0, np.array([7.0, 9.0])),
    "commanded speed": Case(lambda folder: link(folder, [DAMPING], VELOCITY), 2.0, np.array([8.0])),
    "commanded force": Case(lambda folder: link(folder, [MASS], MOTOR, pos="0 0 -0.2"), 5.0, np.array([3.0])),
    "short range": Case(lambda folder: link(folder, [GAIN], limits='range="-0.3 0.1"'), 2.0, np.array([8.0])),
}


def planned(case: Case, folder: Path) -> tuple[Cell, Plan, Proposal]:
    cell = case.cell(folder)
    found = plan_driven(Simulator(cell), (), Wishes(count=2, tries=8, speed=case.speed))
    assert found.proposal is not None
    assert sum(found.proposal.times) == 2
    write_motions(found, cell, folder / "plan")
    return cell, found, found.proposal


def played(cell: Cell, file: Path) -> dict[str, tuple[Floats, Floats, Floats]]:
    """Positions, speeds and joint forces of each motion of a table, by MuJoCo's own loop."""
    model = mujoco.MjModel.from_xml_path(str(cell.model_path))
    told: dict[str, list[list[float]]] = {}
    with file.open() as lines:
        for row in csv.DictReader(lines):
            numbers = [float(n) for name, n in row.items() if name.startswith(("time", "told."))]
            told.setdefault(row["motion"], []).append(numbers)
    out = {}
    for name, rows in told.items():
        series, data = np.array(rows), mujoco.MjData(model)
        if cell.spec.inputs[0].quantity == "joint_position":
            data.qpos[:] = series[0, 1:]
            while data.time < SETTLED_S:
                data.ctrl[:] = series[0, 1:]
                mujoco.mj_step(model, data)
        elif cell.spec.inputs[0].quantity == "joint_velocity":
            data.qpos[:] = first_position(file, name)
        seen = []
        begin = data.time
        while data.time < begin + series[-1, 0]:
            data.ctrl[:] = series[np.searchsorted(series[:, 0], data.time - begin + 1e-9) - 1, 1:]
            mujoco.mj_step(model, data)
            seen.append(np.concatenate([data.qpos, data.qvel, data.qfrc_actuator]))
        out[name] = tuple(np.split(np.array(seen), 3, axis=1))
    return out  # type: ignore[return-value]


def first_position(file: Path, motion: str) -> list[float]:
    with file.open() as lines:
        row = next(r for r in csv.DictReader(lines) if r["motion"] == motion)
    return [float(n) for name, n in row.items() if name.startswith("joints.")]


@pytest.mark.parametrize("name", CASES)
def test_what_is_played_keeps_to_the_limits_and_is_read_again(name: str, tmp_path: Path) -> None:
    case = CASES[name]
    cell, _, proposal = planned(case, tmp_path)
    model = mujoco.MjModel.from_xml_path(str(cell.model_path))
    for position, speed, effort in played(cell, tmp_path / "plan" / "motions.csv").values():
        assert (position > model.jnt_range[:, 0]).all()
        assert (position < model.jnt_range[:, 1]).all()
        assert np.abs(speed).max() < 1.02 * OVER * case.speed
        assert (np.abs(effort).max(axis=0) < 1.02 * EFFORT * case.effort).all()
        assert np.ptp(position, axis=0).min() > 0.05, "it moves"
    imported = import_tables(tmp_path / "plan" / "import.yaml", tmp_path / "bags", tmp_path / "plan")
    episodes = read_usable(cell, imported.bags).episodes
    assert [e.name for e in episodes] == [e.name for e in proposal.expected]
    for episode, expected in zip(episodes, proposal.expected, strict=True):
        for read, written in zip((*episode.inputs, *episode.tracks), (*expected.inputs, *expected.tracks), strict=True):
            np.testing.assert_allclose(read.value, written.value, atol=1e-6)
            np.testing.assert_allclose(np.diff(read.stamp_ns), 1e7, atol=1e5)
    assert len(windows(cell, episodes)) == len(proposal.times)


def errors_of_a_fit(cell: Cell, episodes: list[Episode]) -> Floats:
    """(P,) standard errors of a real fit, in prior widths."""
    data = recordings(cell, windows(cell, episodes))
    noise = noise_of(cell, data)
    likelihood = pose(Simulator(cell).driven(data.drives), data, noise).likelihood
    refined = refine(likelihood, likelihood.prior_mean)
    out = np.ones(len(cell.parameters))
    out[refined.fit.free] = np.sqrt(np.diag(refined.among))
    return out


def test_a_real_fit_is_as_sure_as_was_promised_and_surer_than_before(tmp_path: Path) -> None:
    cell = arm(tmp_path)
    simulator = Simulator(cell)
    driven, rng = driven_joints(simulator), np.random.default_rng(3)
    numbers = rng.normal(size=(3, size(driven)))
    numbers[:, :2] = 0  # around home, as most people move their robot
    tried = motions(simulator, driven, limits(driven, 1.0), 2.0, numbers)
    truth = simulator.defaults + 0.3 * rng.normal(size=len(cell.parameters)) * [p.half_width for p in cell.parameters]
    before = virtual_recordings(simulator, driven, truth, tried.time_s, tried.series, tried.posture, rng)
    found = plan_driven(simulator, before, Wishes(tries=24))
    assert found.proposal is not None
    assert sum(found.proposal.times) == 3, "as long as what was recorded"
    new = found.proposal.motions
    series, posture = (np.repeat(one, found.proposal.times, axis=0) for one in (new.series, new.posture))
    after = virtual_recordings(simulator, driven, truth, new.time_s, series, posture, rng)
    promised = [np.sqrt(np.diag(shown.covariance)) for shown in found.shown]
    fitted = [errors_of_a_fit(cell, episodes) for episodes in (before, after)]
    for said, got in zip(promised, fitted, strict=False):
        assert abs(np.mean(np.log(got / said))) < np.log(1.25)
    assert np.mean(np.log(fitted[1] / fitted[0])) < np.log(0.7), "what was promised is gained"
    assert (promised[2] < promised[1]).all(), "both together tell more than the new ones alone"


def test_it_is_said_in_words_and_written(tmp_path: Path) -> None:
    cell, found, _ = planned(CASES["arm, slow"], tmp_path)
    console = Console(width=160)
    with console.capture() as captured:
        print_motions(found, console)
    text = captured.get()
    for words in (
        "By chance, around home (4 s), before any fit",
        "pinned down",
        "centre of upper, lower",
        "times smaller",
    ):
        assert words in text, text
    content = json.loads((tmp_path / "plan" / "plan.json").read_text())
    assert content["schema"] == "compass/motions/1"
    assert [len(shown["std"]) for shown in content["shown"]] == [len(cell.parameters)] * 2
    names = [p.name for p in cell.parameters]
    for shown in content["shown"]:
        grouped = [name for group in shown["only_together"] for name in group["parameters"]]
        assert sorted({*shown["pinned_down"], *grouped, *shown["weakly"], *shown["not_at_all"]}) == sorted(names)


@pytest.mark.parametrize(
    ("cell", "wishes", "words"),
    [
        (lambda f: link(f, [MASS], STRONG), Wishes(), "axis: no largest force"),
        (lambda f: link(f, [GAIN]), Wishes(propose=False), "neither recordings nor a proposal"),
        (lambda f: link(f, [GAIN], gravity="0 0 -200", limits='range="-1 1"'), Wishes(tries=4), "no motion was found"),
    ],
)
def test_what_cannot_be_planned_is_one_line(
    cell: Callable[[Path], Cell], wishes: Wishes, words: str, tmp_path: Path
) -> None:
    with pytest.raises((ConfigError, DataError), match=words) as error:
        plan_driven(Simulator(cell(tmp_path)), (), wishes)
    assert "\n" not in str(error.value)
