"""`compass track`: object poses from a video, without ROS."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def add_to(app: typer.Typer) -> None:
    app.command()(track)


def track(
    video: Annotated[Path, typer.Argument(help="video of the table from above")],
    camera: Annotated[Path, typer.Option(help="camera_info as YAML (intrinsics and distortion)")],
    config: Annotated[Path, typer.Option(help="what to track; see config/puck_tracker.yaml")],
    out: Annotated[Path, typer.Option(help="CSV of the tracks")] = Path("tracks.csv"),
) -> None:
    """Follow the objects in a video: stamp, object, x, y in the frame of the table, standard deviation."""
    from compass_ros.tracking.camera import read_camera
    from compass_ros.tracking.config import read_tracker_config
    from compass_ros.tracking.video import track_video

    tracks = track_video(video, read_camera(camera), read_tracker_config(config))
    lines = ["stamp_ns,object,x_m,y_m,std_m"]
    for t in tracks:
        std = t.std if t.std is not None else [float("nan")] * len(t.stamp_ns)
        lines += [
            f"{stamp},{t.object},{value[0]:.6f},{value[1]:.6f},{s:.6f}"
            for stamp, value, s in zip(t.stamp_ns, t.value, std, strict=True)
        ]
    out.write_text("\n".join(lines) + "\n", encoding="utf-8")
    typer.echo(f"{len(tracks)} objects, {len(lines) - 1} poses in {out}")
