"""Concealed arms as worlds: same seed, same bits; laws by name; the cell at the true values plays the same motion."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from compass_ros.cells import Cell, load
from compass_ros.commands.conceal import conceal, write_world
from compass_ros.concealed.seal import unseal
from compass_ros.errors import ConfigError
from compass_ros.operation.current import read
from compass_ros.posing import launched, noise_of
from compass_ros.simulation import Simulator
from compass_ros.simulation.replay import recordings
from compass_ros.simulation.windows import windows
from compass_ros.types import Floats
from compass_ros.worlds import draw
from compass_ros.worlds.arms import draws
from compass_ros.worlds.arms.arm import Arm
from compass_ros.worlds.arms.driven import SETUP as DRIVEN
from compass_ros.worlds.arms.kinova import SETUP as KINOVA
from compass_ros.worlds.arms.passive import SETUP as PASSIVE
from compass_ros.worlds.arms.scene import Motion, Setup, make
from compass_ros.worlds.scenes import scene_of
from compass_ros.worlds.world import Asked, World
from test.worlds.arms import ARMS, CELLS, task


def world(name: str, asked: Asked) -> World:
    scene = scene_of(name)
    assert scene is not None
    return scene(task(name), asked)


def series(made: World) -> list[Floats]:
    return [track.value for e in made.episodes for track in (*e.tracks, *e.inputs)]


def laws() -> list[tuple[Setup, str, str]]:
    """Each law once, on the smallest arm that has it."""
    found: dict[str, tuple[Setup, str, str]] = {}
    for setup in (KINOVA, DRIVEN, PASSIVE):
        for names in (*setup.known, setup.outside):
            found.update({name: (setup, setup.name, name) for name in names})
    return list(found.values())


def brief(setup: Setup) -> Setup:
    """With three short recordings."""

    def motion(arm: Arm, rng: np.random.Generator) -> Motion:
        full = setup.motion(arm, rng)
        told = None if full.drive.told is None else full.drive.told[:3, :4200]
        drive = replace(
            full.drive, told=told, first=full.drive.first[:3], seconds=0.6, session_s=full.drive.session_s[:3]
        )
        return replace(full, drive=drive)

    return replace(setup, motion=motion)


def test_the_same_seed_gives_the_same_bits_and_another_another_world() -> None:
    one, again, other = (make(brief(PASSIVE), task("two_joint_arm"), Asked(seed, "one")) for seed in (7, 7, 8))
    assert one.answer == again.answer
    assert all(np.array_equal(a, b) for a, b in zip(series(one), series(again), strict=True))
    assert one.answer["parameters"] != other.answer["parameters"]


def test_parameters_do_not_depend_on_what_is_missing() -> None:
    own = brief(PASSIVE), task("two_joint_arm")
    plain, brake = make(*own, Asked(7, "none")), make(*own, Asked(7, names=("eddy_brake",)))
    assert plain.answer["parameters"] == brake.answer["parameters"]
    assert plain.answer["strength"] == 0
    assert plain.answer["laws"] == []
    assert brake.answer["kind"] == "outside"


@pytest.mark.parametrize(("setup", "cell", "name"), laws(), ids=lambda value: value if isinstance(value, str) else "")
def test_each_law_changes_what_is_seen_and_says_what_it_is(setup: Setup, cell: str, name: str) -> None:
    made = make(brief(setup), task(cell), Asked(3, names=(name,)))
    assert all(np.isfinite(value).all() for value in series(made))
    laws = made.answer["laws"]
    assert isinstance(laws, list)
    said = laws[0]
    assert said["name"] == name
    assert said["class"]
    assert said["sites"]
    assert said["source"]
    assert said["strength"] == pytest.approx(made.answer["strength"])
    assert 0 < said["strength"] < 2000
    assert (said["class"] == ["unknown"]) == (made.answer["kind"] == "outside")


def test_two_laws_are_of_two_families() -> None:
    family = {name: str(i) for i, names in enumerate(PASSIVE.known) for name in names}
    for seed in range(12):
        rng = np.random.default_rng(seed)
        kind, names = draw.laws(Asked(seed, "two"), list(family), list(PASSIVE.outside), rng, family)
        assert kind == "two"
        assert family[names[0]] != family[names[1]]


def test_an_unknown_law_is_one_line() -> None:
    with pytest.raises(ConfigError, match=r"unknown law 'lugre'; known: .*; did you mean 'lugre_friction'\?"):
        world("two_joint_arm", Asked(0, names=("lugre",)))


def test_a_cell_without_a_scene_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"panda: has no concealed worlds; known: air_hockey, .*kinova3"):
        conceal(seed=0, out=tmp_path / "out", cell="panda", answers=tmp_path / "answers")
    with pytest.raises(ConfigError, match="are of the cell air_hockey alone"):
        conceal(seed=0, out=tmp_path / "out", cell="kinova3", answers=tmp_path / "answers", noise="tracker")


@pytest.mark.parametrize("name", ARMS)
def test_cell_and_scene_fit_each_other(name: str) -> None:
    assert set(draws.STRANGE) <= set((KINOVA if "kinova" in name else PASSIVE).outside)
    assert scene_of(name) is not None


@pytest.mark.nightly
def test_a_sealed_world_reads_back(tmp_path: Path) -> None:
    answers = tmp_path / "answers"
    write_world("two_joint_arm_driven", Asked(5, "none"), tmp_path / "world", answers)
    opened = unseal(tmp_path / "world", answers)
    assert opened.answer["cell"] == "two_joint_arm_driven"
    made = world("two_joint_arm_driven", Asked(5, "none"))
    for episode in made.episodes[:2]:
        back = read(load("two_joint_arm_driven"), tmp_path / "world" / episode.name)
        assert np.array_equal(back.tracks[0].value, episode.tracks[0].value)
        assert np.array_equal(back.inputs[0].value, episode.inputs[0].value)
        assert np.array_equal(back.tracks[0].stamp_ns, episode.tracks[0].stamp_ns)


EXCESS = [
    ("two_joint_arm", None, 0.0, {"joints": 0.3}),
    ("two_joint_arm_driven", None, 0.0, {"joints": 0.3}),
    ("kinova3", None, 0.001, {"joints": 0.75}),
    ("kinova3_effort", None, 0.001, {"joints": 0.75, "efforts": 0.55}),
    ("kinova3_effort", "0.0005", 0.00025, {"joints": 0.2, "efforts": 0.25}),
]
"""Cell, another time step of its drawing [s], how much later its input acts [s], what the suite's engine at the true
values then has beyond the noise, over the noise, at most.

Measured at seed 3: 0.25; 0.20; 0.65; 0.65 and 0.44; 0.10 and 0.16. The arm of seven joints is simulated in steps of
2 ms by an integrator of first order, and moves half a step early: the delay, a parameter of that cell, takes that in a
fit, and is given here. With steps of 0.5 ms the two engines agree.
"""


@pytest.mark.nightly
@pytest.mark.parametrize(("name", "step", "later", "most"), EXCESS)
def test_the_cell_at_the_true_values_plays_the_same_motion(
    name: str, step: str | None, later: float, most: dict[str, float], tmp_path: Path
) -> None:
    made = world(name, Asked(3, "none"))
    cell = load(name) if step is None else finer(name, step, tmp_path)
    truth = made.answer["parameters"]
    assert isinstance(truth, dict)
    values = np.array([truth[p.name] + (later if p.name.endswith("delay") else 0) for p in cell.parameters])
    data = recordings(cell, windows(cell, list(made.episodes[:4])))
    noise = noise_of(cell, data)
    gap = launched(Simulator(cell, threads=1).driven(data.drives), data, noise, values).gap(values, noise.rms)
    for signal, bound in most.items():
        found = gap.signals[signal]
        assert np.sqrt(max(found.rms**2 - found.floor**2, 0)) < bound * found.floor


def finer(name: str, step: str, folder: Path) -> Cell:
    """The cell with another time step of its drawing."""
    for file in CELLS.glob("kinova3*"):
        text = file.read_text(encoding="utf-8").replace('timestep="0.002"', f'timestep="{step}"')
        (folder / file.name).write_text(text, encoding="utf-8")
    return load(str(folder / f"{name}.yaml"))
