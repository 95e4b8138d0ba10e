"""The tracker's configuration: the shipped file is the default, and errors name the field."""

from __future__ import annotations

from pathlib import Path

import pytest

from compass_ros.errors import ConfigError
from compass_ros.tracking.config import TrackerConfig, read_tracker_config, tracker_config
from compass_ros.tracking.scene_config import SceneConfig, scene_config

FILE = Path(__file__).parents[2] / "config" / "puck_tracker.yaml"


def test_the_shipped_file_is_the_default() -> None:
    assert read_tracker_config(FILE) == TrackerConfig()


def test_a_plain_file_is_read_too(tmp_path: Path) -> None:
    path = tmp_path / "tracker.yaml"
    path.write_text("min_arc: 0.5\nobjects: {ball: {hue_deg: 50, radius_m: 0.02}}\n")
    config = read_tracker_config(path)
    assert config.min_arc == 0.5
    assert list(config.objects) == ["ball"]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ({"min_ark": 0.5}, "min_ark: .*did you mean 'min_arc'"),
        ({"min_arc": 7}, "min_arc: .*less than or equal to 1, found 7"),
        ({"objects": {}}, "expected at least one object"),
        ({"objects": {"puck1": {"hue_deg": 400}}}, "objects.puck1.hue_deg"),
        ({"objects": {"puck1": {}}}, "objects.puck1.hue_deg: .*required"),
        ({"fiducials": {"ids": [0, 1, 1, 2]}}, "expected distinct ids"),
        ({"fiducials": {"x_m": [0.0, 1.0]}}, "as many x_m and y_m"),
    ],
)
def test_mistakes_are_named(content: dict[str, object], message: str) -> None:
    with pytest.raises(ConfigError, match=message) as caught:
        tracker_config(content, "file.yaml")
    assert "\n" not in str(caught.value)
    assert str(caught.value).startswith("file.yaml: ")


def test_scene_mistakes_are_named() -> None:
    assert scene_config({}) == SceneConfig()
    with pytest.raises(ConfigError, match=r"camera\.exposure_s: .*found 3"):
        scene_config({"camera": {"exposure_s": 3}})


def test_tracker_and_scene_agree_on_what_is_there() -> None:
    scene, config = SceneConfig(), TrackerConfig()
    assert scene.fiducials == config.fiducials
    for name, disc in scene.discs.items():
        look = config.objects[name]
        assert (look.radius_m, look.height_m) == (disc.radius_m, disc.height_m)
