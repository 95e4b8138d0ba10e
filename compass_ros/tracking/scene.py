"""What stands still before the virtual camera, drawn once: table, lines, walls, obstacle, fiducials, and the light.

The table's plane is drawn as a texture and seen through the lens by area sampling (a grid `_FINE` times as fine as the
pixels, averaged); walls and obstacle are drawn onto that fine grid through the same lens.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from compass_ros.tracking.camera import TableView
from compass_ros.tracking.scene_config import BoxConfig, Colour, SceneConfig, view_of
from compass_ros.types import Floats

_FINE = 4
_TEXEL_M = 0.0005
_EXTENT_M = (1.5, 1.2)
_SHIFT = 4
"""Fractional bits of OpenCV's drawing coordinates."""
_FLOOR, _SHEET, _RAIL = (96, 86, 76), (226, 230, 231), (150, 112, 78)
_LINE, _GOAL_LINE = (150, 176, 205), (226, 168, 160)


@dataclass(frozen=True)
class Scene:
    """Everything about a picture that does not change from image to image."""

    view: TableView
    slope: NDArray[np.float32]
    """(H, W, 2) a pixel's ray meets the plane z at (x, y) = eye_xy + slope * (eye_z - z)."""
    pixel_slope: NDArray[np.float32]
    """(H, W) side of a pixel in units of slope."""
    light: NDArray[np.float32]
    """(H, W, 1) brightness, 1 in full light."""
    background: NDArray[np.uint8]
    """(H, W, 3) BGR, lit."""


def build_scene(config: SceneConfig, table_shift_m: tuple[float, float] = (0.0, 0.0)) -> Scene:
    """Draw the background. `table_shift_m`: table, walls and obstacle stand this far from where the fiducials say."""
    view = view_of(config.camera)
    width, height = config.camera.width, config.camera.height
    grid = np.stack(np.meshgrid(np.arange(width), np.arange(height)), axis=-1).reshape(-1, 2).astype(np.float64)
    eye = view.position
    slope = ((view.table_from_pixel(grid) - eye[:2]) / eye[2]).reshape(height, width, 2)
    du, dv = np.gradient(slope, axis=1), np.gradient(slope, axis=0)
    pixel = np.sqrt(np.abs(du[..., 0] * dv[..., 1] - du[..., 1] * dv[..., 0]))
    ground = eye[:2] + slope * eye[2]
    light = _light(config, ground)

    size = (width * _FINE, height * _FINE)
    # cv2.resize keeps pixel areas aligned, so the fine grid lies evenly inside of each pixel
    fine_ground = cv2.resize(ground.astype(np.float32), size, interpolation=cv2.INTER_LINEAR)
    texture = _texture(config, np.asarray(table_shift_m))
    column = (fine_ground[..., 0] + _EXTENT_M[0] / 2) / _TEXEL_M - 0.5
    row = (_EXTENT_M[1] / 2 - fine_ground[..., 1]) / _TEXEL_M - 0.5
    drawn = cv2.remap(texture, column, row, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    fine = np.asarray(drawn, dtype=np.uint8)
    for box in (*_rails(config), *config.boxes):
        _draw_box(fine, view, box, np.asarray(table_shift_m))
    seen = cv2.resize(fine, (width, height), interpolation=cv2.INTER_AREA).astype(np.float32) * light
    return Scene(
        view,
        slope.astype(np.float32),
        pixel.astype(np.float32),
        light.astype(np.float32),
        np.clip(np.rint(seen), 0, 255).astype(np.uint8),
    )


def _light(config: SceneConfig, ground: Floats) -> Floats:
    """(H, W, 1) a lamp over the near left, falling off to the far right, and the lens's own fall-off."""
    x, y = ground[..., 0] / 0.5, ground[..., 1] / 0.4
    lamp = np.exp(-((x + 0.45) ** 2 + (y - 0.35) ** 2) / 3.0)
    lens = 1 - 0.10 * (x**2 + y**2)
    brightness = lamp * lens
    span = np.ptp(brightness)
    return np.asarray(1 - config.light * (brightness.max() - brightness) / span)[..., None]


def _texel(xy: Floats) -> NDArray[np.int32]:
    """Points (N, 2) on the plane -> drawing coordinates in the texture with `_SHIFT` fractional bits."""
    texel = np.column_stack([xy[:, 0] + _EXTENT_M[0] / 2, _EXTENT_M[1] / 2 - xy[:, 1]]) / _TEXEL_M - 0.5
    return np.asarray(np.rint(texel * (1 << _SHIFT)), dtype=np.int32)


def _bgr(colour: Colour, factor: float = 1.0) -> tuple[float, float, float]:
    return (colour[2] * factor, colour[1] * factor, colour[0] * factor)


def _rectangle(centre: Floats, width: float, height: float) -> Floats:
    return centre + 0.5 * np.array([[-width, -height], [width, -height], [width, height], [-width, height]])


def _texture(config: SceneConfig, shift: Floats) -> NDArray[np.uint8]:
    columns, rows = (round(extent / _TEXEL_M) for extent in _EXTENT_M)
    texture = np.empty((rows, columns, 3), np.uint8)
    texture[:] = _bgr(_FLOOR)
    # the floor's grain, stretched along x like planks
    planks = np.random.default_rng(7).normal(0, 9, (rows // 4, columns // 80)).astype(np.float32)
    grain = cv2.GaussianBlur(cv2.resize(planks, (columns, rows), interpolation=cv2.INTER_CUBIC), (0, 0), 1.5)
    texture = np.clip(texture + grain[..., None], 0, 255).astype(np.uint8)

    def polygon(xy: Floats, colour: Colour) -> None:
        cv2.fillPoly(texture, [_texel(xy)], _bgr(colour), cv2.LINE_AA, _SHIFT)

    def circle(xy: Floats, radius: float, colour: Colour, thickness_m: float) -> None:
        centre = _texel(xy[None])[0]
        thickness = max(round(thickness_m / _TEXEL_M), 1) if thickness_m > 0 else -1
        size = round(radius / _TEXEL_M * (1 << _SHIFT))
        cv2.circle(texture, centre.tolist(), size, _bgr(colour), thickness, cv2.LINE_AA, _SHIFT)

    length, width = config.table_m
    rail = config.rail_m[0]
    polygon(
        _rectangle(shift + np.array([0.006, -0.008]), length + 2 * rail + 0.012, width + 2 * rail + 0.012), (62, 55, 48)
    )
    polygon(_rectangle(shift, length, width), _SHEET)
    for x in np.arange(-length / 2 + 0.0125, length / 2, 0.025):
        for y in np.arange(-width / 2 + 0.0125, width / 2, 0.025):
            circle(shift + np.array([x, y]), 0.0008, (170, 172, 174), 0)
    goal = np.asarray(config.goal_m[:2]) + shift
    angles = np.linspace(np.pi / 2, 3 * np.pi / 2, 90)
    arc = goal + config.goal_m[2] * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    edge = shift[0] + length / 2
    area = np.vstack([[edge, arc[0, 1]], arc, [edge, arc[-1, 1]]])
    polygon(area, (236, 222, 220))
    cv2.polylines(texture, [_texel(area)], False, _bgr(_GOAL_LINE), round(0.003 / _TEXEL_M), cv2.LINE_AA, _SHIFT)
    polygon(_rectangle(shift, 0.003, width), _LINE)
    circle(shift, 0.07, _LINE, 0.003)
    _draw_markers(texture, config)
    return texture


def _draw_markers(texture: NDArray[np.uint8], config: SceneConfig) -> None:
    """ArUco prints on white cards, lying on the plane."""
    markers = config.fiducials
    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, markers.dictionary))
    cells = dictionary.markerSize + 2
    for number, x, y in zip(markers.ids, markers.x_m, markers.y_m, strict=True):
        bits = cv2.aruco.generateImageMarker(dictionary, number, cells, borderBits=1)
        centre = np.array([x, y])
        card = _rectangle(centre, 1.3 * markers.side_m, 1.3 * markers.side_m)
        cv2.fillPoly(texture, [_texel(card)], (240, 240, 238), cv2.LINE_AA, _SHIFT)
        side = markers.side_m / cells
        for row, column in zip(*np.nonzero(bits == 0), strict=True):
            offset = np.array([column - (cells - 1) / 2, (cells - 1) / 2 - row]) * side
            low = _texel(centre + offset + np.array([[-side / 2, side / 2]]))[0] >> _SHIFT
            high = _texel(centre + offset + np.array([[side / 2, -side / 2]]))[0] >> _SHIFT
            texture[low[1] + 1 : high[1] + 1, low[0] + 1 : high[0] + 1] = 28


def _rails(config: SceneConfig) -> tuple[BoxConfig, ...]:
    (length, width), (rail, height) = config.table_m, config.rail_m
    x, y = (length + rail) / 2, (width + rail) / 2
    long, short = (length + 2 * rail, rail, height), (rail, width, height)
    return (
        BoxConfig((0.0, y), long, _RAIL),
        BoxConfig((0.0, -y), long, _RAIL),
        BoxConfig((x, 0.0), short, _RAIL),
        BoxConfig((-x, 0.0), short, _RAIL),
    )


def _draw_box(fine: NDArray[np.uint8], view: TableView, box: BoxConfig, shift: Floats) -> None:
    """Draw a box onto the fine grid: side faces, then the top."""
    base = _rectangle(np.asarray(box.centre_m) + shift, *box.size_m[:2])
    low = np.column_stack([base, np.zeros(4)])
    high = np.column_stack([base, np.full(4, box.size_m[2])])
    shades = (0.72, 0.55, 0.62, 0.84)
    faces = [(np.array([low[i], low[i - 3], high[i - 3], high[i]]), shades[i]) for i in range(4)]
    for corners, shade in (*faces, (high, 1.0)):
        # long straight edges are bent by the lens
        edge = np.concatenate([np.linspace(corners[i], corners[i - 3], 24, endpoint=False) for i in range(4)])
        pixel = (view.pixel_from_table(edge) + 0.5) * _FINE - 0.5
        points = np.rint(pixel * (1 << _SHIFT)).astype(np.int32)
        cv2.fillPoly(fine, [points], _bgr(box.colour, shade), cv2.LINE_AA, _SHIFT)
