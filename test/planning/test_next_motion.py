"""The next motion of a driven joint: within what it has done, where two laws differ most; it says which it is."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from compass_ros.calibration.cost import start
from compass_ros.calibration.least_squares import minimise
from compass_ros.calibration.likelihood import Likelihood
from compass_ros.cells import Cell
from compass_ros.discovery import Discovery
from compass_ros.discovery.hypothesis import Hypothesis, widened
from compass_ros.episodes.tables import import_tables
from compass_ros.errors import DataError
from compass_ros.operation.current import read_usable
from compass_ros.planning.next_experiment import NextExperiment, next_experiment, with_next
from compass_ros.planning.trials import IMPORT, TABLE
from compass_ros.posing import noise_of, pose
from compass_ros.simulation import Simulator
from compass_ros.simulation.driven import driven_joints, virtual_recordings
from compass_ros.simulation.effects import Attached, effect
from compass_ros.simulation.replay import recordings
from compass_ros.simulation.sizes import unit_joint
from compass_ros.simulation.windows import windows
from compass_ros.types import Episode, Floats, Mismatch, Where
from test.planning.scenes import GAIN, POSITION, link

THIN, THICK = (Attached(effect(n).at(unit_joint("hinge")), ("axis",)) for n in ("quadratic_drag", "viscous_drag"))
SLOW = 0.4
"""Speed to which the recordings keep [rad/s]."""


def cell_of(folder: Path) -> Cell:
    """Without a range of the joint."""
    return link(folder, [GAIN], POSITION, limits="")


def moved(cell: Cell, law: Attached, values: Floats, series: Floats, seed: int) -> list[Episode]:
    """Recordings of (B, F, 1) commands at 100 Hz."""
    simulator = Simulator(cell, [law], threads=1)
    time, rng = np.arange(series.shape[1]) / 100, np.random.default_rng(seed)
    return virtual_recordings(simulator, driven_joints(simulator), values, time, series, series[:, 0], rng)


def slow(cell: Cell, law: Attached, values: Floats) -> list[Episode]:
    """Three motions back and forth, all at one speed, at which any drag is the same."""
    time = np.arange(301) / 100
    there = SLOW * (0.75 - np.abs((time / 1.5) % 2 - 1) * 1.5)
    return moved(cell, law, values, np.stack([there, -there, there + 0.3])[:, :, None], 3)


def fitted(cell: Cell, episodes: list[Episode], laws: tuple[Attached, ...]) -> Hypothesis:
    data = recordings(cell, windows(cell, episodes))
    noise = noise_of(cell, data)
    plain = Simulator(cell, threads=1).driven(data.drives)
    likelihood: Likelihood = pose(plain, data, noise).likelihood
    simulator, wider = widened(plain, likelihood, laws)
    free = np.arange(len(wider.parameters))
    return Hypothesis(laws, simulator, wider, minimise(wider, start(wider, wider.prior_mean), free, 20, 4.0))


@pytest.fixture(scope="module")
def rivals(tmp_path_factory: pytest.TempPathFactory) -> tuple[Cell, Hypothesis, Hypothesis]:
    cell = cell_of(tmp_path_factory.mktemp("cell"))
    episodes = slow(cell, THIN, np.array([*cell.defaults, 0.25]))
    return cell, fitted(cell, episodes, (THIN,)), fitted(cell, episodes, (THICK,))


@pytest.fixture(scope="module")
def found(rivals: tuple[Cell, Hypothesis, Hypothesis]) -> NextExperiment:
    cell, *both = rivals
    return next_experiment(Simulator(cell, threads=1), both, seed=0)


def test_it_is_a_motion_with_a_table(found: NextExperiment) -> None:
    assert found.action is None
    assert found.apart > 5
    assert found.sentence.startswith(f"Record the motion of {TABLE} (")
    assert "quadratic_drag(axis) from viscous_drag(axis) by" in found.sentence
    assert set(found.files) == {TABLE, IMPORT}


def test_the_same_seed_gives_the_same_motion(
    rivals: tuple[Cell, Hypothesis, Hypothesis], found: NextExperiment
) -> None:
    cell, *both = rivals
    assert next_experiment(Simulator(cell, threads=1), both, seed=0) == found


def played(found: NextExperiment, cell: Cell, folder: Path) -> Episode:
    """The motion as a recording, read through the ordinary door."""
    for name, text in found.files.items():
        (folder / name).write_text(text, encoding="utf-8")
    import_tables(folder / IMPORT, folder / "bags", folder)
    (episode,) = read_usable(cell, [str(folder / "bags")]).episodes
    return episode


def test_the_joint_goes_where_it_was_and_no_faster(
    rivals: tuple[Cell, Hypothesis, Hypothesis], found: NextExperiment, tmp_path: Path
) -> None:
    (command,) = played(found, rivals[0], tmp_path).inputs
    speed = np.abs(np.diff(command.value[:, 0])) / np.diff(command.stamp_ns) * 1e9
    assert 0.1 * SLOW < speed.max() < 1.15 * SLOW  # a corner is overshot a little
    assert -0.33 < command.value.min() < command.value.max() < 0.63  # the recordings: -0.3 to 0.6


@pytest.mark.parametrize("right", [0, 1])
def test_recorded_it_tells_which_law_it_is(
    rivals: tuple[Cell, Hypothesis, Hypothesis], found: NextExperiment, tmp_path: Path, right: int
) -> None:
    """Whichever of the two it is, as large as it was found to be."""
    cell, *both = rivals
    (law,), values, (command,) = both[right].laws, both[right].fit.point.values, played(found, cell, tmp_path).inputs
    before, new = slow(cell, law, values), moved(cell, law, values, command.value[None], 4)
    new = [replace(e, name="next") for e in new]
    first, then = (
        [fitted(cell, episodes, (one,)).log_evidence for one in (THIN, THICK)] for episodes in (before, [*before, *new])
    )
    assert int(np.argmax(then)) == right
    assert then[right] - then[1 - right] > max(first[right] - first[1 - right] + 3, 5)


def test_a_verdict_that_leaves_nothing_open_stays(rivals: tuple[Cell, Hypothesis, Hypothesis]) -> None:
    named = Discovery(Mismatch("named", None, (), (), "", ""))
    assert with_next(named, Simulator(rivals[0], threads=1), 0) is named


def test_what_is_unknown_is_asked_for_too(rivals: tuple[Cell, Hypothesis, Hypothesis]) -> None:
    where = Where("axis", "free", "dynamics")
    unknown = Discovery(Mismatch("unknown", where, (), (), "", ""))
    said = with_next(unknown, Simulator(rivals[0], threads=1), 0).mismatch.next_experiment
    assert said == (
        "To see what it depends on, repeat the motions at a third of their speed and at three times that, and from "
        "other places."
    )


@pytest.mark.parametrize("error", [DataError("nothing moves"), np.linalg.LinAlgError("Singular matrix")])
def test_a_verdict_stands_where_no_experiment_can_be_found(
    rivals: tuple[Cell, Hypothesis, Hypothesis], monkeypatch: pytest.MonkeyPatch, error: Exception
) -> None:
    def trials(*_: object) -> None:
        raise error

    monkeypatch.setattr("compass_ros.planning.next_experiment.trials", trials)
    cell, *both = rivals
    open_one = Discovery(Mismatch("ambiguous", None, (), (), "", ""), rivals=tuple(both))
    then = with_next(open_one, Simulator(cell, threads=1), 0).mismatch
    assert (then.verdict, str(error) in then.next_experiment) == ("ambiguous", True)
