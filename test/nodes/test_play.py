"""What the virtual cell plays, without ROS: hidden parameters, commands, and the images' moments."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from compass_ros.cells import Cell, load
from compass_ros.concealed.stage import Secret, Stage
from compass_ros.errors import ConfigError
from compass_ros.nodes.play import action_of, hidden_values, play, resting, table_shift
from compass_ros.simulation import Simulator
from compass_ros.tracking.scene_config import DiscConfig, SceneConfig

SCENE = SceneConfig()
NAMES = ["x", "y", "angle", "velocity"]


@pytest.fixture(scope="module")
def cell() -> Cell:
    return load("air_hockey")


def test_drawn_parameters_are_within_reach_and_repeat(cell: Cell) -> None:
    low, high = ([getattr(p, end) for p in cell.parameters] for end in ("low", "high"))
    for seed in range(5):
        values = hidden_values(cell, "", seed)
        assert np.all((values >= low) & (values <= high))
        assert np.all(np.abs(values - cell.defaults) <= [p.half_width + 1e-12 for p in cell.parameters])
        np.testing.assert_array_equal(values, hidden_values(cell, "", seed))
    assert np.mean(hidden_values(cell, "", 0) != hidden_values(cell, "", 1)) > 0.9


def test_a_file_of_parameters_changes_those_that_it_names(cell: Cell, tmp_path: Path) -> None:
    path = tmp_path / "truth.yaml"
    path.write_text("env@camera@bias_x: 0.03\npuck1@dyna@damping: -6\n")
    values = hidden_values(cell, str(path), 3)
    assert int((values != cell.defaults).sum()) == 2
    assert table_shift(cell, values) == (0.03, 0.0)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("puck1@dyna@dampin: -6", "did you mean 'puck1@dyna@damping'"),
        ("puck1@dyna@damping: -600", "expected a number from -25.0 to -1.0, found -600"),
        ("puck1@dyna@damping: much", "found 'much'"),
    ],
)
def test_mistakes_in_the_file_are_named(cell: Cell, tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "truth.yaml"
    path.write_text(text)
    with pytest.raises(ConfigError, match=message):
        hidden_values(cell, str(path), 0)


def test_an_action_is_taken_in_any_order_of_names(cell: Cell) -> None:
    action = action_of(cell, ["velocity", "x", "angle", "y"], [0.4, -0.22, 0.1, 0.07])
    assert action.tolist() == [-0.22, 0.07, 0.1, 0.4]
    with pytest.raises(ConfigError, match="found 3 values of"):
        action_of(cell, NAMES, [0.0, 0.0, 0.0])
    with pytest.raises(ConfigError, match=r"angle: expected -0\.4 to 0\.4, found 2"):
        action_of(cell, NAMES, [-0.22, 0.07, 2.0, 0.4])
    with pytest.raises(ConfigError, match=r"velocity: .* found nan"):
        action_of(cell, NAMES, [-0.22, 0.07, 0.0, np.nan])


def test_a_play_is_still_then_moves_then_is_still(cell: Cell) -> None:
    simulator = Simulator(cell, threads=1)
    shown = play(Stage(cell, Secret(cell.defaults)), SCENE, action_of(cell, NAMES, [-0.22, 0.07, 0.0, 0.4]))
    assert shown.begin == 30
    assert shown.length == 30 + 150 + 30
    still = [shown.still(image) for image in range(shown.length + 5)]
    assert all(still[1:30])
    assert not any(still[31:40])
    assert all(still[182:])
    start, begin = shown.poses(0), shown.poses(shown.begin)
    for name, disc in SCENE.discs.items():
        assert disc.radius_m > 0
        assert np.linalg.norm(begin[name] - start[name]) < 1e-4, "the motion begins in the middle of this exposure"
    np.testing.assert_allclose(start["pusher"][0, :2], [-0.22, 0.07], atol=1e-6)

    # mid-exposure is the image's time: 1 s after the beginning is image begin + 60
    truth = simulator.bodies(cell.defaults, np.array([-0.22, 0.07, 0.0, 0.4]), np.array([1.0, 1.1]))["puck2"][0]
    np.testing.assert_allclose(shown.poses(shown.begin + 60)["puck2"].mean(axis=0), truth, atol=1e-5)


def test_the_arm_says_where_its_tool_is_and_what_it_was_told(cell: Cell) -> None:
    """Beside the simulator's own motion, in the frame of the table and not in that of the shifted camera."""
    hidden = {"env@camera@bias_x": 0.03, "env@camera@bias_y": -0.02, "pusher@actuation@vel_discount": 0.85}
    values = cell.values(hidden)
    action = action_of(cell, NAMES, [-0.22, 0.07, 0.0, 0.4])
    shown = play(Stage(cell, Secret(values)), SCENE, action)
    samples = [s for image in range(shown.length) for s in shown.of_arm(image)]
    image = np.repeat(np.arange(shown.length), 4)
    time = (image - shown.begin) / 60 - np.array([s.before_s for s in samples])
    np.testing.assert_allclose(np.diff(time), 1 / 240, rtol=1e-9)
    before = time < 0
    tool, told = (np.array([getattr(s, what) for s in samples]) for what in ("tool", "told"))
    np.testing.assert_allclose(tool[before], [[-0.22, 0.07]] * before.sum(), atol=1e-12)
    truth = Simulator(cell, threads=1).bodies(values, action, np.clip(time, 0, 2.5))["pusher"][:, :2]
    np.testing.assert_allclose(tool, truth - [0.03, -0.02], atol=1e-12)
    assert not told[before].any()
    push = (time > 0.06) & (time < 0.2)
    np.testing.assert_allclose(np.linalg.norm(told[push], axis=1), 0.4, rtol=1e-9, err_msg="as commanded")
    reached = np.linalg.norm(np.diff(tool[push], axis=0), axis=1) * 240
    assert np.median(reached) == pytest.approx(0.85 * 0.4, rel=0.01)


@pytest.mark.parametrize("step", [1e-6, 1e-5, 1e-4, 1e-3, 0.0])
def test_encoders_count(cell: Cell, step: float) -> None:
    (sample,) = resting(Stage(cell, Secret(cell.defaults)), SCENE, 1).of_arm(7)
    counted = sample.counted(step)
    assert np.abs(counted - sample.tool).max() <= step / 2 + 1e-15
    if step:
        np.testing.assert_allclose(counted / step, np.round(counted / step), atol=1e-6)


def test_a_cell_that_the_scene_does_not_show_is_refused(cell: Cell) -> None:
    scene = SceneConfig(discs={"cube": DiscConfig(colour=(1, 2, 3))}, arm=None)
    with pytest.raises(ConfigError, match=r"shows \['cube'\], the cell moves \['puck1', 'puck2', 'pusher'\]"):
        resting(Stage(cell, Secret(cell.defaults)), scene)
