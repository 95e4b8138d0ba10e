"""`compass track`: object poses from the images of a video or a bag, without ROS."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from compass_ros.commands.progress import Bar
from compass_ros.errors import BagError, ConfigError, TrackingError
from compass_ros.types import Progress, Track


def add_to(app: typer.Typer) -> None:
    app.command()(track)


def track(
    source: Annotated[Path, typer.Argument(help="video of the table from above, or bag with images")],
    camera: Annotated[Path | None, typer.Option(help="camera calibration as YAML; a bag has its own camera_info")] = (
        None
    ),
    config: Annotated[Path | None, typer.Option(help="what to track, like config/puck_tracker.yaml")] = None,
    topic: Annotated[str, typer.Option(help="topic of the images in a bag that has several")] = "",
    out: Annotated[Path, typer.Option(help="a .csv file; or, from a bag, the folder of a bag with the poses")] = Path(
        "tracks.csv"
    ),
) -> None:
    """Follow the objects in a video or a bag: where each was in every image, in the frame of the table."""
    from compass_ros.episodes.bag import is_bag
    from compass_ros.tracking.camera import read_camera
    from compass_ros.tracking.config import TrackerConfig, read_tracker_config
    from compass_ros.tracking.video import track_video, video_length

    followed = read_tracker_config(config) if config else TrackerConfig()
    model = read_camera(camera) if camera else None
    if source.exists() and is_bag(source):
        from compass_ros.commands.bag_images import camera_of, image_topic, images_of
        from compass_ros.tracking.video import track_images

        images = image_topic(source, topic)
        with Bar() as bar:
            tracks = track_images(
                images_of(source, images.name),
                model or camera_of(source),
                followed,
                str(source),
                lambda count: _tick(bar, count, images.messages),
            )
    else:
        if model is None and source.exists():
            raise TrackingError(f"{source}: a video does not say what its camera is like; give --camera")
        if model is None:
            raise BagError(f"{source}: no such video or bag")
        with Bar() as bar:
            length = video_length(source)
            tracks = track_video(source, model, followed, 0, lambda count: _tick(bar, count, length))
    if out.suffix == ".csv":
        _write_csv(tracks, out)
    else:
        out = _write_bag(tracks, source, out)
    typer.echo(f"{len(tracks)} objects, {sum(len(t.stamp_ns) for t in tracks)} poses in {out}")


def _tick(bar: Bar, count: int, length: int) -> None:
    bar(Progress("track", count, min(count / length, 1.0) if length else 0.0, math.nan, math.nan))


def _write_csv(tracks: Sequence[Track], out: Path) -> None:
    lines = ["stamp_ns,object,x_m,y_m,std_m"]
    for t in tracks:
        std = t.std if t.std is not None else [math.nan] * len(t.stamp_ns)
        lines += [
            f"{stamp},{t.object},{value[0]:.6f},{value[1]:.6f},{s:.6f}"
            for stamp, value, s in zip(t.stamp_ns, t.value, std, strict=True)
        ]
    try:
        out.write_text("\n".join(lines) + "\n", encoding="utf-8")
    except OSError as error:
        raise ConfigError(f"{out}: cannot be written: {error.strerror}") from error


def _write_bag(tracks: Sequence[Track], source: Path, folder: Path) -> Path:
    """A bag with the poses beside the shot of the bag with the images; its name is that bag's."""
    from compass_ros.episodes import read_episode, write_episode
    from compass_ros.episodes.bag import is_bag

    if not is_bag(source):
        raise ConfigError(f"{folder}: a video has no shot to write into a bag; give a name that ends in .csv")
    return write_episode(replace(read_episode(source, ()), tracks=tuple(tracks)), folder)
