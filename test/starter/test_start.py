"""A model and bags become a cell that loads as it is, whatever joints and topics are called."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from compass_ros.bench.driven import Routine
from compass_ros.bench.driven import record as record_driven
from compass_ros.cells import Cell, load
from compass_ros.cells.registry import dynamics_of
from compass_ros.episodes import Source, read_episodes, write_episode
from compass_ros.errors import ConfigError
from compass_ros.operation.current import read, sources
from compass_ros.simulation.windows import windows
from compass_ros.starter.cell import start
from compass_ros.types import Floats, Track
from test.starter.recorded import URDF, mjcf, moved, record, stamps, state, write_trajectories

Run = Callable[[Path, int, Floats, Floats, Floats], None]
SECONDS = 12.0


def jointed(of: list[str], topic: str = "/joint_commands", order: tuple[int, int] = (0, 1), extra: str = "") -> Run:
    """Commands and states as JointState; the state may have the joints in another order, and one more."""

    def write(folder: Path, seed: int, time: Floats, target: Floats, got: Floats) -> None:
        stamp, shown = stamps(time, seed), got[:, order]
        names = [of[i] for i in order] + ([extra] if extra else [])
        if extra:
            shown = np.column_stack([shown, np.full(len(time), 0.02)])
        record(folder, seed, [state("a", "/joint_states", names, stamp, shown), state("b", topic, of, stamp, target)])

    return write


def numbered(order: tuple[int, int]) -> Run:
    """Commands as numbers without names."""

    def write(folder: Path, seed: int, time: Floats, target: Floats, got: Floats) -> None:
        stamp = stamps(time, seed)
        track = Track("b", "scalar", stamp, np.ascontiguousarray(target[:, order]))
        source = Source("/forward_position_controller/commands", "b", "scalar", of=("0", "1"), drives=True)
        record(folder, seed, [state("a", "/joint_states", ["shoulder", "elbow"], stamp, got), (track, source)])

    return write


def trajectories(folder: Path, seed: int, time: Floats, target: Floats, got: Floats) -> None:
    write_trajectories(folder, seed, ["shoulder", "elbow"], time, target, got)


@dataclass(frozen=True)
class Pair:
    """A model, and recordings of it."""

    joints: tuple[str, str]
    write: Run
    of: tuple[str, ...]
    """What the input must say, in the order of the messages."""
    actuators: tuple[str, ...]
    urdf: bool = False
    driven: bool = True
    late_s: float = 0.0


SAME = ("shoulder", "elbow")
PAIRS = {
    "the same names": Pair(SAME, jointed([*SAME]), SAME, SAME),
    "another order in the states": Pair(SAME, jointed([*SAME], order=(1, 0)), SAME, SAME),
    "other spellings and one joint more": Pair(
        SAME, jointed(["Shoulder_Joint", "elbowJoint"], extra="finger"), ("Shoulder_Joint", "elbowJoint"), SAME
    ),
    "prefixes": Pair(
        ("robot0_joint1", "robot0_joint2"),
        jointed(["Joint_1", "joint_2"], order=(1, 0)),
        ("Joint_1", "joint_2"),
        ("robot0_joint1", "robot0_joint2"),
    ),
    "commands on a topic that says nothing": Pair(SAME, jointed([*SAME], "/arm/b"), SAME, SAME, late_s=0.1),
    "states on a topic that says nothing, commands late": Pair(SAME, jointed([*SAME], "/z"), SAME, SAME, late_s=0.25),
    "numbers without names": Pair(SAME, numbered((0, 1)), SAME, SAME),
    "numbers without names in another order": Pair(SAME, numbered((1, 0)), SAME[::-1], SAME[::-1]),
    "trajectories": Pair(SAME, trajectories, SAME, SAME),
    "URDF without meshes": Pair(SAME, jointed([*SAME]), SAME, SAME, urdf=True),
    "URDF, other names": Pair(
        ("panda_joint1", "panda_joint2"),
        jointed(["joint_1", "joint_2"]),
        ("joint_1", "joint_2"),
        ("panda_joint1", "panda_joint2"),
        urdf=True,
    ),
    "MJCF without drives": Pair(SAME, jointed([*SAME]), SAME, SAME, driven=False),
}


def started(folder: Path, pair: Pair, links: bool = False) -> tuple[Cell, tuple[str, ...]]:
    model = folder / ("arm.urdf" if pair.urdf else "arm.xml")
    model.write_text(URDF.format(*pair.joints) if pair.urdf else mjcf(*pair.joints, driven=pair.driven))
    for seed in range(2):
        pair.write(folder / "bags", seed, *moved(seed, SECONDS, pair.late_s))
    found = start(model, [folder / "bags"], folder / "out" / "cell.yaml", links)
    return load(folder / "out" / "cell.yaml"), found.said


@pytest.mark.parametrize("name", PAIRS)
def test_a_model_and_bags_become_a_cell(tmp_path: Path, name: str) -> None:
    pair = PAIRS[name]
    cell, _ = started(tmp_path, pair)
    assert len(cell.spec.inputs) == 1
    target = cell.spec.inputs[0]
    assert (target.of, target.targets, target.to) == (pair.of, pair.actuators, "ctrl")
    joints = cell.signal("joints")
    assert {*joints.at} == {*pair.joints}
    assert joints.noise == pytest.approx(0.0005, rel=0.2)
    named = {p.name.split("@")[0] for p in cell.parameters}
    assert {*pair.joints} <= named
    episodes = read_episodes([tmp_path / "bags"], sources(cell), cell.name)
    cut = windows(cell, episodes)
    assert len(cut) == 4, "two recordings of 12 s, windows of 5 s"
    shoulder = cut[0].initial_state["joints"][joints.at.index(pair.joints[0])]
    assert shoulder == pytest.approx(moved(0, 1.0, pair.late_s)[2][0, 0], abs=0.01), "its own column of the messages"


@pytest.mark.parametrize("name", ["URDF without meshes", "URDF, other names", "MJCF without drives"])
def test_a_first_drive_follows_as_late_as_was_seen(tmp_path: Path, name: str) -> None:
    cell, said = started(tmp_path, PAIRS[name])
    model = dynamics_of(cell).model
    assert any("has no drives" in line for line in said)
    for joint, true in zip(PAIRS[name].joints, (4.5 / 60, 2.3 / 30), strict=True):
        stiffness, damping = float(model.actuator(joint).gainprm[0]), float(model.joint(joint).damping[0])
        assert damping / stiffness == pytest.approx(true, rel=0.5), "its lag behind slow commands"


def test_links_are_offered(tmp_path: Path) -> None:
    cell, _ = started(tmp_path, PAIRS["URDF without meshes"], links=True)
    assert sum("@dyna@inertia_" in p.name for p in cell.parameters) == 20


def test_without_a_command_there_are_signals_alone(tmp_path: Path) -> None:
    (tmp_path / "arm.xml").write_text(mjcf(driven=False))
    for seed in range(2):
        time, _, got = moved(seed, SECONDS)
        stamp = stamps(time, seed)
        pose = np.tile([1.0, 0, 0, 1, 0, 0, 0], (len(time), 1)) + np.linspace(0, 0.1, len(time))[:, None] * [1] * 7
        cube = Track("c", "pose", stamp, pose), Source("/tracker/RedCube/pose", "c", "pose")
        record(tmp_path / "bags", seed, [state("a", "/joint_states", [*SAME], stamp, got), cube])
    start(tmp_path / "arm.xml", [tmp_path / "bags"], tmp_path / "cell.yaml")
    cell = load(tmp_path / "cell.yaml")
    assert not cell.spec.inputs
    assert [(s.name, s.quantity) for s in cell.signals] == [("joints", "joint_position"), ("red_cube", "pose")]
    assert {s.object for s in cell.starts} == {"joints", "red_cube"}
    assert read_episodes([tmp_path / "bags"], sources(cell), cell.name)[0].track("red_cube").quantity == "pose"


def test_without_a_command_measured_torques_drive(tmp_path: Path) -> None:
    (tmp_path / "arm.xml").write_text(mjcf(driven=False))
    time, target, got = moved(0, SECONDS)
    stamp = stamps(time, 0)
    source = Source("/joint_states", "e", "joint_effort", of=SAME)
    effort = Track("e", "joint_effort", stamp, np.ascontiguousarray(60 * (target - got))), source
    record(tmp_path / "bags", 0, [state("a", "/joint_states", [*SAME], stamp, got), effort])
    found = start(tmp_path / "arm.xml", [tmp_path / "bags"], tmp_path / "cell.yaml")
    cell = load(tmp_path / "cell.yaml")
    assert [(i.quantity, i.to, i.targets) for i in cell.spec.inputs] == [("joint_effort", "qfrc", SAME)]
    assert any("its efforts drive the joints" in line for line in found.said)
    assert "target@actuation@scale" in {p.name for p in cell.parameters}
    assert read_episodes([tmp_path / "bags"], sources(cell), cell.name)[0].inputs[0].value.shape[1] == 2


def test_it_is_the_cell_whose_recordings_they_are(tmp_path: Path) -> None:
    """A cell of another name would refuse them."""
    (tmp_path / "arm.xml").write_text(mjcf())
    time, target, got = moved(0, SECONDS)
    stamp = stamps(time, 0)
    tracks = [state("a", "/joint_states", [*SAME], stamp, got), state("b", "/joint_commands", [*SAME], stamp, target)]
    record(tmp_path / "bags", 0, tracks, "bench2")
    start(tmp_path / "arm.xml", [tmp_path / "bags"], tmp_path / "mine.yaml")
    cell = load(tmp_path / "mine.yaml")
    assert cell.name == "bench2"
    assert len(read_episodes([tmp_path / "bags"], sources(cell), cell.name)) == 1


def test_nothing_in_common_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "arm.xml").write_text(mjcf("rotation", "pitch"))
    jointed(["shoulder", "patch"])(tmp_path / "bags", 0, *moved(0, 3.0))
    with pytest.raises(ConfigError) as raised:
        start(tmp_path / "arm.xml", [tmp_path / "bags"], tmp_path / "cell.yaml")
    said = str(raised.value)
    assert "rotation, pitch" in said
    assert "patch, shoulder" in said
    assert "did you mean 'pitch'?" in said
    assert "\n" not in said


def test_recordings_of_another_configuration_are_read_by_the_cell_that_was_begun_with_them(tmp_path: Path) -> None:
    """Their bags name the cell and the hash of its file; the new file has another hash, before and after an edit."""
    theirs, bags, out = load("two_joint_arm_driven"), tmp_path / "bags", tmp_path / "own.yaml"
    for episode in record_driven(theirs, theirs.defaults, 2, Routine(seconds=3.0), 0):
        write_episode(episode, bags, sources(theirs))
    start(theirs.model_path, [str(bags)], out, links=False)
    for _ in range(2):
        own = load(out)
        assert own.name == theirs.name
        assert own.hash != theirs.hash
        assert own.hashes == (own.hash, theirs.hash)
        assert {read(own, bag).cell_hash for bag in sorted(bags.iterdir())} == {theirs.hash}
        out.write_text(out.read_text() + "# edited\n")


def test_a_command_of_an_actuator_on_a_tendon_is_given_on_and_one_of_nothing_is_said(tmp_path: Path) -> None:
    grip = '<position name="grip" tendon="both" kp="1"/></actuator><tendon><fixed name="both">'
    grip += '<joint joint="shoulder" coef="1"/><joint joint="elbow" coef="1"/></fixed></tendon>'
    (tmp_path / "arm.xml").write_text(mjcf().replace("</actuator>", grip))
    for seed in range(2):
        time, target, got = moved(seed, SECONDS)
        more = np.column_stack([target, np.zeros((len(time), 2))])
        stamp = stamps(time, seed)
        told = state("b", "/joint_commands", ["shoulder", "elbow", "grip", "lamp"], stamp, more)
        record(tmp_path / "bags", seed, [state("a", "/joint_states", [*SAME], stamp, got), told])
    start(tmp_path / "arm.xml", [tmp_path / "bags"], tmp_path / "cell.yaml")
    target_of = load(tmp_path / "cell.yaml").spec.inputs[0]
    assert target_of.of == target_of.targets == (*SAME, "grip")
    assert "nothing of the model is called lamp: not used" in (tmp_path / "cell.yaml").read_text()


@pytest.mark.parametrize("turned", [False, True])
def test_an_orientation_that_nobody_measured_is_none(tmp_path: Path, turned: bool) -> None:
    (tmp_path / "arm.xml").write_text(mjcf())
    for seed in range(2):
        time = np.arange(0, 3.0, 0.02)
        half = 0.5 * time * turned
        pose = np.column_stack([0.3 * time, 0 * time, 1 - time**2, np.cos(half), 0 * time, 0 * time, np.sin(half)])
        track = Track("red_cube", "pose", stamps(time, seed), pose)
        record(tmp_path / "bags", seed, [(track, Source("/red_cube/pose", "red_cube", "pose"))])
    start(tmp_path / "arm.xml", [tmp_path / "bags"], tmp_path / "cell.yaml")
    cell = load(tmp_path / "cell.yaml")
    assert cell.signal("red_cube").quantity == ("pose" if turned else "position")
    assert ("taken as not measured" in (tmp_path / "cell.yaml").read_text()) is not turned
