"""The mismatch for eyes: a grid and markers for RViz and Foxglove, in the frame `table`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from geometry_msgs.msg import Point, Pose, Quaternion, Vector3
from nav_msgs.msg import MapMetaData, OccupancyGrid
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker, MarkerArray

from compass_ros.operation.current import Residuals
from compass_ros.operation.mismatch_map import MismatchMap
from compass_ros.types import Floats

FULL_FLOORS = 5.0
"""The darkest cell of the map differs by this many noise floors or more."""
_HEIGHT_M = 0.002
_RECORDED = ColorRGBA(r=0.95, g=0.55, b=0.10, a=1.0)
_SIMULATED = ColorRGBA(r=0.15, g=0.45, b=0.90, a=1.0)
_REGION = ColorRGBA(r=0.85, g=0.10, b=0.35, a=0.35)
_TEXT = ColorRGBA(r=0.6, g=0.6, b=0.6, a=1.0)


def grid_message(found: MismatchMap, noise_floor_m: float, header: Header) -> OccupancyGrid:
    """0: the simulator is right here; 100: it differs by FULL_FLOORS noise floors or more; -1: no object was here."""
    rows, columns = found.mean_m.shape
    x, y = found.origin_m
    origin = Pose(position=Point(x=x, y=y), orientation=Quaternion(w=1.0))
    info = MapMetaData(
        map_load_time=header.stamp, resolution=found.size_m, width=columns, height=rows, origin=origin
    )  # fmt: skip
    full_m = max(FULL_FLOORS * noise_floor_m, 1e-6)
    return OccupancyGrid(header=header, info=info, data=found.percent(full_m))


def markers_message(residuals: Residuals, mismatch: Mapping[str, Any], header: Header) -> MarkerArray:
    """For each object the recording that differs most (orange) and its simulation (blue); region and verdict."""
    markers = [_everything_before(header)]
    for name in residuals.planar():
        recorded, simulated = residuals.paths(name)
        squared = np.nansum((recorded - simulated) ** 2, axis=(1, 2))
        worst = int(np.argmax(squared))
        markers.append(_line(f"{name} recorded", recorded[worst], _RECORDED, header))
        markers.append(_line(f"{name} simulated", simulated[worst], _SIMULATED, header))
    region = (mismatch.get("where") or {}).get("region")
    if region:
        x, y = region["centre_m"]
        size = Vector3(x=2 * region["radius_m"], y=2 * region["radius_m"], z=_HEIGHT_M)
        markers.append(_marker("region", Marker.CYLINDER, header, size, _REGION, (x, y)))
    text = _marker("verdict", Marker.TEXT_VIEW_FACING, header, Vector3(z=0.03), _TEXT, (0.0, -0.38))
    text.text = str(mismatch["sentence"])
    return MarkerArray(markers=[*markers, text])


def _everything_before(header: Header) -> Marker:
    return Marker(header=header, action=Marker.DELETEALL)


def _marker(
    name: str, kind: int, header: Header, size: Vector3, colour: ColorRGBA, at: tuple[float, float] = (0.0, 0.0)
) -> Marker:
    pose = Pose(position=Point(x=float(at[0]), y=float(at[1]), z=_HEIGHT_M), orientation=Quaternion(w=1.0))
    return Marker(
        header=header, ns=name, type=kind, action=Marker.ADD, pose=pose, scale=size, color=colour
    )  # fmt: skip


def _line(name: str, path: Floats, colour: ColorRGBA, header: Header) -> Marker:
    """(F, 2) a path [m]; NaN where nothing is known."""
    marker = _marker(name, Marker.LINE_STRIP, header, Vector3(x=0.003), colour)
    known = path[~np.isnan(path).any(axis=1)]
    marker.points = [Point(x=float(x), y=float(y)) for x, y in known]
    return marker
