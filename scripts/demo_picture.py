"""The picture of the README, from what a demonstration has left in a folder.

    compass demo && python scripts/demo_picture.py out/demo docs/images/demo.jpg

Left: the camera's view of one held-out shot, drawn anew from the truth that the cell has revealed, with the recorded
tracks on it. Right: the same shot on the table, as recorded and as two simulators say.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import cv2
import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Rectangle

from compass_ros.cells import load
from compass_ros.concealed.stage import Stage, read_secret
from compass_ros.episodes import Source, read_episodes
from compass_ros.nodes.play import play, table_shift
from compass_ros.reporting.palette import LIGHT
from compass_ros.results import scene_of
from compass_ros.simulation import Simulator
from compass_ros.tracking.scene_config import SceneConfig
from compass_ros.tracking.virtual_camera import make_camera, render
from compass_ros.types import Floats, Track

SHOWN_S = 0.9
"""Moment of the image, after the command."""
SEEN_M = 0.005
"""A pose that is less certain was predicted."""
COLOUR = {"puck1": "#c62828", "puck2": "#1f5fd0"}


def main(folder: Path, out: Path) -> None:
    """Draw the held-out episode whose pucks travel furthest."""
    cell = load("air_hockey")
    result = json.loads((folder / "calibration" / "result.json").read_text())
    sources = [Source(one.topic, one.name, one.quantity) for one in cell.objects]
    held_out = [e for e in read_episodes([folder / "bags"], sources) if e.name in result["episodes"]["held_out"]]
    episode = max(held_out, key=lambda e: min(float(np.ptp(t.value, axis=0).sum()) for t in e.tracks))
    action = np.array([episode.action[field.name] for field in cell.action])
    simulator = Simulator(cell)
    secret = read_secret(folder / "truth.json", cell)
    found = np.array([row["value"] for row in result["parameters"]])

    config, shift = SceneConfig(), table_shift(cell, secret.values)
    camera = make_camera(config, 0, shift)
    film = play(Stage(cell, secret), config, action)
    image = render(camera, film.poses(film.begin + round(SHOWN_S * config.camera.rate_hz)), 0)
    paths = {track.object: _after(track, episode.start_ns) for track in episode.tracks}

    figure = Figure(figsize=(12.4, 4.4), layout="compressed")
    left, right = figure.subplots(1, 2, width_ratios=[1.0, 1.42])
    left.imshow(cv2.cvtColor(image, cv2.COLOR_BGR2RGB))
    for name, path in paths.items():
        top = np.full(len(path), config.discs[name].height_m)
        pixels = camera.scene.view.pixel_from_table(np.column_stack([path, top]))
        left.plot(*pixels.T, ".", color="white", markersize=3.4)
        left.plot(*pixels.T, ".", color=COLOUR[name], markersize=2.0)
    left.set_axis_off()
    left.set_title("Camera image, and where the tracker saw the pucks", loc="left", fontsize=10)

    time = np.linspace(0, cell.duration, 300)
    for model, values, style in (("default parameters", cell.defaults, ":"), ("calibrated", found, "-")):
        seen = simulator.observe(values[None], action[None], time[None])[0]
        tint = LIGHT["nominal"] if style == ":" else LIGHT["calibrated"]
        for i in range(len(paths)):
            label = f"simulator, {model}" if i == 0 else None
            right.plot(*seen[:, 2 * i : 2 * i + 2].T, style, color=tint, linewidth=1.8, label=label)
    for i, path in enumerate(paths.values()):
        label = "recorded, never fitted" if i == 0 else None
        right.plot(*path[::4].T, "o", color=LIGHT["real"], markersize=3, markerfacecolor="none", label=label)
    for shape in scene_of(cell).shapes:
        place = np.array(shape.centre_m) + shift
        half = np.array(shape.size_m) / 2
        if shape.kind == "circle":
            right.add_patch(Circle(tuple(place), half[0], color=LIGHT["with_effects"], alpha=0.1))
        else:
            fill = shape.role == "obstacle"
            right.add_patch(Rectangle(tuple(place - half), *(2 * half), fill=fill, color=LIGHT["faint"], alpha=0.6))
    right.set_aspect("equal")
    right.set_xlim(shift[0] - 0.47, shift[0] + 0.47)
    right.set_ylim(shift[1] - 0.24, shift[1] + 0.24)
    right.set_xlabel("x [m]")
    right.set_ylabel("y [m]")
    right.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3, fontsize=9, frameon=False)
    out.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(out, dpi=110, bbox_inches="tight", pad_inches=0.08, pil_kwargs={"quality": 88})


def _after(track: Track, start_ns: int) -> Floats:
    """(F, 2) where the tracker saw the object from the command on."""
    assert track.std is not None
    return np.asarray(track.value[(track.stamp_ns >= start_ns) & (track.std < SEEN_M)])


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
