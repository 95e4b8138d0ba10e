"""What the virtual cell plays: its hidden parameters and, for a shot, where everything is in every image."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from compass_ros.cells import Cell
from compass_ros.concealed.stage import Stage
from compass_ros.config import read_yaml
from compass_ros.errors import ConfigError, nearest, shown
from compass_ros.tracking.scene_config import SceneConfig
from compass_ros.tracking.virtual_camera import exposure_times
from compass_ros.types import Floats

STILL_S = 0.5
"""Still images before and after the motion."""
TOOL = "pusher"
"""What the arm moves."""
AXES = (f"{TOOL}_x", f"{TOOL}_y")
"""Its joints along the table and across it."""
PER_IMAGE = 4
"""Readings of the arm's encoders for each image."""


@dataclass(frozen=True)
class ArmSample:
    """One moment of the arm."""

    before_s: float
    """Before the middle of the image that it belongs to [s]."""
    tool: Floats
    """(2,) x, y of the tool on the table, as the arm stands to it [m]."""
    told: Floats
    """(2,) what its controller is told, speeds along x and y [m/s]; nothing of what the arm makes of them."""

    def counted(self, step_m: float) -> Floats:
        """(2,) the tool's place as encoders say it that count in steps; of step 0 as it is."""
        return np.asarray(np.round(self.tool / step_m) * step_m) if step_m else self.tool


@dataclass(frozen=True)
class Play:
    """One shot, image by image."""

    moments: Mapping[str, Floats]
    """Name -> (F, sub_frames, 3) x, y [m], yaw [rad] at the moments of the exposures."""
    begin: int
    """Image in the middle of whose exposure the motion begins."""
    arm: tuple[tuple[ArmSample, ...], ...] = ()
    """For each image the readings since the one before, in the order of time."""

    @property
    def length(self) -> int:
        """Images."""
        return len(next(iter(self.moments.values())))

    def poses(self, image: int) -> dict[str, Floats]:
        """Name -> (sub_frames, 3); after the last image everything stays where it is."""
        index = min(image, self.length - 1)
        return {name: pose[index] for name, pose in self.moments.items()}

    def of_arm(self, image: int) -> tuple[ArmSample, ...]:
        """The arm's readings that belong to an image."""
        return self.arm[min(image, self.length - 1)]

    def still(self, image: int) -> bool:
        """Whether nothing has moved since the image before."""
        if image == 0:
            return False
        now, before = self.poses(image), self.poses(image - 1)
        return all(np.array_equal(now[name], before[name]) for name in now)


def hidden_values(cell: Cell, file: str, seed: int) -> Floats:
    """(P,) the true parameters. `file`: YAML of name: value, the others keep their defaults; empty: drawn with `seed`,
    uniform within each parameter's half-width of randomisation around its default. Raises ConfigError."""
    if not file:
        rng = np.random.default_rng(seed)
        drawn = [rng.uniform(p.default - p.half_width, p.default + p.half_width) for p in cell.parameters]
        return np.clip(drawn, [p.low for p in cell.parameters], [p.high for p in cell.parameters])
    values = {p.name: p.default for p in cell.parameters}
    bounds = {p.name: (p.low, p.high) for p in cell.parameters}
    for name, value in read_yaml(Path(file)).items():
        if name not in values:
            raise ConfigError(f"{file}: cell '{cell.name}' has no parameter '{name}'{nearest(str(name), values)}")
        low, high = bounds[name]
        if not isinstance(value, (int, float)) or not low <= value <= high:
            raise ConfigError(f"{file}: {name}: expected a number from {low} to {high}, found {shown(value)}")
        values[name] = float(value)
    return np.array(list(values.values()))


def table_shift(cell: Cell, values: Floats) -> tuple[float, float]:
    """How far the table stands from where the fiducials say [m]: the bias of all tracked positions."""
    by_name = {p.name: float(value) for p, value in zip(cell.parameters, values, strict=True)}
    return by_name.get("env@camera@bias_x", 0.0), by_name.get("env@camera@bias_y", 0.0)


def action_of(cell: Cell, names: Sequence[str], values: Sequence[float]) -> Floats:
    """(A,) the commanded action in the cell's order. Raises ConfigError for a wrong name or a value out of reach."""
    given = dict(zip(names, values, strict=False))
    expected = [field.name for field in cell.action]
    if len(names) != len(values) or sorted(names) != sorted(expected):
        found = f"{len(values)} values of {shown(list(names))}"
        raise ConfigError(f"shot command: expected values of {expected}, found {found}")
    action = np.array([given[name] for name in expected])
    for name, value, (low, high) in zip(expected, action, cell.reach, strict=True):
        if not low - 1e-9 <= value <= high + 1e-9:
            raise ConfigError(f"shot command: {name}: expected {low} to {high}, found {value}")
    return action


def resting(stage: Stage, scene: SceneConfig, readings: int = PER_IMAGE) -> Play:
    """One image of the cell before any shot. Raises ConfigError if the scene cannot show this cell."""
    middle = np.array([(field.low + field.high) / 2 for field in stage.cell.action])
    bodies = stage.bodies(middle, np.array([0.0, stage.time_step]))
    if not set(scene.discs) <= set(bodies):
        raise ConfigError(
            f"cell '{stage.cell.name}' cannot be filmed: the scene shows {sorted(scene.discs)}, "
            f"the cell moves {sorted(bodies)}"
        )
    frames = scene.camera.sub_frames
    still = {name: np.repeat(bodies[name][:1], frames, axis=0)[None] for name in scene.discs}
    before = _before(readings, scene.camera.rate_hz)
    tool = _on_table(stage, np.tile(bodies[TOOL][:1], (readings, 1)))
    return Play(still, 0, (_samples(before, tool, np.zeros((readings, 2))),))


def play(stage: Stage, scene: SceneConfig, action: Floats, readings: int = PER_IMAGE) -> Play:
    """A shot (A,) with still images before and after it; the arm's encoders are read so often for each image."""
    rate = scene.camera.rate_hz
    begin = round(STILL_S * rate)
    count = begin + round((stage.cell.duration + STILL_S) * rate)
    mid_s = (np.arange(count) - begin) / rate
    times = np.clip(exposure_times(scene.camera, mid_s), 0.0, stage.cell.duration)
    before = _before(readings, rate)
    of_arm = (mid_s[:, None] - before).ravel()
    flat = stage.bodies(action, np.concatenate([times.ravel(), np.clip(of_arm, 0.0, stage.cell.duration)]))
    tool = _on_table(stage, flat[TOOL][times.size :]).reshape(count, readings, 2)
    told = stage.told(action, of_arm).reshape(count, readings, 2)
    arm = tuple(_samples(before, *of_image) for of_image in zip(tool, told, strict=True))
    return Play({name: flat[name][: times.size].reshape(*times.shape, 3) for name in scene.discs}, begin, arm)


def _before(readings: int, rate_hz: float) -> Floats:
    """(n,) how long before an image each reading is [s]; the last one is in its middle."""
    return np.asarray(np.arange(readings)[::-1] / (readings * rate_hz))


def _on_table(stage: Stage, poses: Floats) -> Floats:
    """(n, 2) where the tool is for the arm, which stands beside the table and knows nothing of the fiducials."""
    return np.asarray(poses[:, :2] - table_shift(stage.cell, stage.secret.values))


def _samples(before_s: Floats, tool: Floats, told: Floats) -> tuple[ArmSample, ...]:
    return tuple(ArmSample(float(b), *of) for b, *of in zip(before_s, tool, told, strict=True))
