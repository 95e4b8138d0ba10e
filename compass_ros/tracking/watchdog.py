"""Has the table moved, is an object lost? What goes wrong slowly while every single image looks fine."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from compass_ros.tracking.camera import TableView
from compass_ros.tracking.config import FiducialConfig
from compass_ros.tracking.tracker import Frame, TrackerState

_SETTLED = 6
"""Images over which every corner must be averaged before the table's place is taken down."""


@dataclass(frozen=True)
class Watch:
    """What the watchdog remembers from image to image."""

    place: TableView | None = None
    """Where the table stood when it was first certain, or when a person last said that it may stand there."""
    moved_m: float = 0.0
    """How far the fiducials are from there now: the farthest of them, on the table's plane [m]."""
    first_ns: int | None = None
    """Stamp of the first image in which the table was found."""
    now_ns: int = 0
    seen_ns: Mapping[str, int] = field(default_factory=dict)
    """When each object was last measured, not predicted."""


def look(watch: Watch, state: TrackerState, frame: Frame, fiducials: FiducialConfig) -> Watch:
    """One more image, as the tracker has understood it."""
    view = state.fix.view
    if view is None or frame.problem:
        return watch
    if frame.stamp_ns < watch.now_ns:  # a recording that begins again
        watch = replace(watch, first_ns=None, seen_ns={})
    first = frame.stamp_ns if watch.first_ns is None else watch.first_ns
    seen = {sighting.object: sighting.stamp_ns for sighting in frame.sightings if sighting.seen}
    watch = replace(watch, first_ns=first, now_ns=frame.stamp_ns, seen_ns={**watch.seen_ns, **seen})
    if watch.place is not None and watch.place.camera == view.camera:
        return replace(watch, moved_m=_distance(watch.place, view, fiducials))
    settled = all(corner.images >= _SETTLED for corner in state.fix.corners.values())
    return replace(watch, place=view, moved_m=0.0) if settled else watch


def accept(watch: Watch) -> Watch:
    """A person has looked: the table may stand where it stands."""
    return replace(watch, place=None, moved_m=0.0)


def unseen_s(watch: Watch, name: str) -> float:
    """Seconds since an object was last measured, or since the first image; 0 before any image."""
    since = watch.seen_ns.get(name, watch.first_ns)
    return 0.0 if since is None else max(watch.now_ns - since, 0) * 1e-9


def complaints(watch: Watch, objects: Iterable[str], moved_m: float, lost_s: float) -> tuple[str, ...]:
    """What is wrong, one sentence each.

    Args:
        moved_m: Fiducials that are farther from their place mean that the table or the camera was pushed [m].
        lost_s: An object that is not measured for longer is lost [s].
    """
    said = []
    if watch.moved_m > moved_m:
        said.append(
            f"the table has moved by {1e3 * watch.moved_m:.1f} mm under the camera (or the camera over it): "
            "put it back, or accept its place by ~/accept_table and calibrate again"
        )
    for name in objects:
        if (gone_s := unseen_s(watch, name)) > lost_s:
            since = "" if name in watch.seen_ns else " at all"
            said.append(f"{name} is lost: not seen{since} for {gone_s:.1f} s")
    return tuple(said)


def _distance(before: TableView, now: TableView, fiducials: FiducialConfig) -> float:
    """How far the farthest fiducial has gone on the table's plane [m]."""
    places = np.column_stack([fiducials.x_m, fiducials.y_m, np.zeros(len(fiducials.x_m))])
    found = before.table_from_pixel(now.pixel_from_table(places))
    return float(np.linalg.norm(found - places[:, :2], axis=1).max())
