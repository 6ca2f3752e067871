"""Turn triangles into pixels: nearest surface per pixel, lit, without a graphics card or a screen."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from clench.core.pose import FloatArray

#: Red, green and blue per pixel, 0 to 1, shape (H, W, 3).
Image = NDArray[np.float32]
#: Rows of pixels per step, which bounds the memory.
_CHUNK: Final = 1 << 21
_DEPTH_STEPS: Final = (1 << 31) - 1
_NOTHING: Final = np.uint64(0xFFFFFFFFFFFFFFFF)


@dataclass(frozen=True, eq=False)
class Camera:
    """Look at a scene without perspective, so that lengths across the view are true.

    Args:
        right, up, towards: orthonormal axes of the view in the world, `towards` from the scene to the viewer.
        center: the point in the middle of the picture [m], shape (3,).
        scale: pixels per metre. width, height: of the picture in pixels.
    """

    right: FloatArray
    up: FloatArray
    towards: FloatArray
    center: FloatArray
    scale: float
    width: int
    height: int

    def project(self, points: FloatArray) -> FloatArray:
        """Return column, row (downwards) and nearness [m] of points, shape (..., 3)."""
        p = points - self.center
        x = 0.5 * self.width + self.scale * (p @ self.right)
        y = 0.5 * self.height - self.scale * (p @ self.up)
        return np.stack([x, y, p @ self.towards], axis=-1)


@dataclass(frozen=True, eq=False)
class Picture:
    """The nearest surface per pixel.

    Args:
        triangle: index of the triangle that is seen, -1 for none, shape (H, W).
        nearness: of the seen surface [m], -inf for none, shape (H, W).
    """

    triangle: NDArray[np.int64]
    nearness: FloatArray


def look_along(towards: FloatArray, above: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return right, up and towards of a view whose up is as near to `above` as can be."""
    w = towards / np.linalg.norm(towards)
    right = np.cross(above, w)
    if np.linalg.norm(right) < 1e-6:
        right = np.cross(np.eye(3)[int(np.argmin(np.abs(w)))], w)
    right = right / np.linalg.norm(right)
    return right, np.cross(w, right), w


def rasterise(corners: FloatArray, camera: Camera) -> Picture:
    """Find the nearest triangle at every pixel's centre.

    Args:
        corners: of the triangles in the world [m], shape (T, 3, 3). camera: see `Camera`.
    """
    projected = camera.project(corners)
    buffer = np.full(camera.width * camera.height, _NOTHING, dtype=np.uint64)
    near = projected[..., 2]
    far, span = float(near.min(initial=0.0)), float(np.ptp(near)) if len(near) else 0.0
    step = (span or 1.0) / _DEPTH_STEPS
    low = np.clip(np.ceil(projected[..., 1].min(axis=1, initial=np.inf) - 0.5), 0, camera.height)
    high = np.clip(np.floor(projected[..., 1].max(axis=1, initial=-np.inf) - 0.5), -1, camera.height - 1)
    heights = np.maximum(high - low + 1, 0).astype(np.int64)
    ends = np.cumsum(heights)
    start = 0
    while start < len(corners):
        done = ends[start - 1] if start else 0
        stop = max(int(np.searchsorted(ends, done + _CHUNK // 8, side="right")), start + 1)
        chunk = slice(start, stop)
        _fill(projected[chunk], low[chunk].astype(np.int64), heights[chunk], start, camera, buffer, far + span, step)
        start = stop
    seen = buffer != _NOTHING
    triangle = np.where(seen, (buffer & np.uint64(0xFFFFFFFF)).astype(np.int64), -1)
    nearness = np.where(seen, far + span - (buffer >> np.uint64(32)).astype(np.float64) * step, -np.inf)
    shape = (camera.height, camera.width)
    return Picture(triangle.reshape(shape), nearness.reshape(shape))


def _fill(
    p: FloatArray,
    low: NDArray[np.int64],
    heights: NDArray[np.int64],
    first: int,
    camera: Camera,
    buffer: NDArray[np.uint64],
    nearest: float,
    step: float,
) -> None:
    """Write the triangles `p` into the buffer: rows of pixels, then the span of each row between the edges."""
    t = np.repeat(np.arange(len(p)), heights)
    row = low[t] + np.arange(len(t)) - np.repeat(np.cumsum(heights) - heights, heights)
    y = row + 0.5
    left, right = np.full(len(t), np.inf), np.full(len(t), -np.inf)
    for a, b in ((0, 1), (1, 2), (2, 0)):
        (xa, ya), (xb, yb) = p[t, a, :2].T, p[t, b, :2].T
        crosses = (ya <= y) != (yb <= y)
        x = xa + (y - ya) / np.where(crosses, yb - ya, 1.0) * (xb - xa)
        np.minimum(left, x, out=left, where=crosses)
        np.maximum(right, x, out=right, where=crosses)
    x0 = np.clip(np.ceil(left - 0.5), 0, camera.width)
    x1 = np.clip(np.floor(right - 0.5), -1, camera.width - 1)
    widths = np.maximum(x1 - x0 + 1, 0).astype(np.int64)
    u, v = p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]
    area = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    area = np.where(np.abs(area) > 1e-12, area, np.inf)  # seen from its edge: constant nearness
    slope_x = (u[:, 2] * v[:, 1] - v[:, 2] * u[:, 1]) / area
    slope_y = (v[:, 2] * u[:, 0] - u[:, 2] * v[:, 0]) / area
    at_row = p[t, 0, 2] + slope_y[t] * (y - p[t, 0, 1]) + slope_x[t] * (x0 + 0.5 - p[t, 0, 0])
    r = np.repeat(np.arange(len(t)), widths)
    along = np.arange(len(r)) - np.repeat(np.cumsum(widths) - widths, widths)
    near = at_row[r] + slope_x[t][r] * along
    depth = np.clip((nearest - near) / step, 0, _DEPTH_STEPS).astype(np.uint64)
    pixel = row[r] * camera.width + x0[r].astype(np.int64) + along
    np.minimum.at(buffer, pixel, (depth << np.uint64(32)) | (first + t[r]).astype(np.uint64))


def shade(picture: Picture, normals: FloatArray, colors: FloatArray, camera: Camera) -> Image:
    """Return lit colours per pixel, white where nothing is seen, shape (H, W, 3) in 0 to 1.

    Args:
        picture: the nearest surfaces. normals: unit, per triangle, either side up, shape (T, 3).
        colors: per triangle, shape (T, 3).
    """
    facing = np.where((normals @ camera.towards)[:, None] < 0.0, -normals, normals)
    key = camera.towards - 0.55 * camera.right + 0.75 * camera.up
    key = key / np.linalg.norm(key)
    light = 0.42 + 0.50 * np.maximum(facing @ key, 0.0) + 0.14 * np.maximum(facing @ camera.towards, 0.0)
    lit = np.vstack([np.clip(colors * light[:, None], 0.0, 1.0), np.ones((1, 3))]).astype(np.float32)
    return lit[picture.triangle]


def borders(picture: Picture, groups: NDArray[np.int64], jump: float) -> NDArray[np.bool_]:
    """Return the pixels at which the seen body changes, or its surface jumps by more than `jump` [m], shape (H, W)."""
    group = np.append(groups, -1)[picture.triangle]
    near = np.where(picture.triangle >= 0, picture.nearness, -1e3)
    result = np.zeros(group.shape, dtype=bool)
    for axis in (0, 1):
        ahead = tuple(slice(1, None) if k == axis else slice(None) for k in (0, 1))
        behind = tuple(slice(None, -1) if k == axis else slice(None) for k in (0, 1))
        change = (group[ahead] != group[behind]) | (np.abs(near[ahead] - near[behind]) > jump)
        result[ahead] |= change
        result[behind] |= change
    return result


def halved(image: Image) -> Image:
    """Return an image of half the size, each pixel the mean of four, shape (H / 2, W / 2, 3)."""
    h, w = 2 * (image.shape[0] // 2), 2 * (image.shape[1] // 2)
    rows = image[0:h:2, :w] + image[1:h:2, :w]
    result: Image = np.float32(0.25) * (rows[:, 0::2] + rows[:, 1::2])
    return result
