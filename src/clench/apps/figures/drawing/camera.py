"""Cameras without perspective, and their pictures: colour, nearness and solid of each pixel."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from clench.core.pose import FloatArray

#: Red, green and blue per pixel, 0 to 1, shape (H, W, 3).
Image = NDArray[np.float32]
#: A point farther than this behind the nearest surface is hidden [m].
_HIDDEN: Final = 2e-3
#: How much darker the lines around solids are [-].
_LINE: Final = np.float32(0.45)


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

    def doubled(self) -> Camera:
        """Return the same view with twice the pixels on each side."""
        axes = self.right, self.up, self.towards, self.center
        return Camera(*axes, 2.0 * self.scale, 2 * self.width, 2 * self.height)


@dataclass(frozen=True, eq=False)
class Sight:
    """The nearest solid of each pixel of a camera.

    Args:
        nearness: of the seen surface along `towards` [m], -inf for none, shape (H, W).
        solid: number of the solid that is seen, -1 for none, shape (H, W).
    """

    nearness: FloatArray
    solid: NDArray[np.int64]

    def hides(self, camera: Camera, points: FloatArray, around: int = 0) -> NDArray[np.bool_]:
        """Say which points lie behind the nearest surface of their pixel, shape (N,).

        Args:
            camera: that took the picture. points: in the world [m], shape (N, 3).
            around: a point is hidden when all pixels up to this far from its own lie before it [px].
        """
        p = camera.project(points)
        column = np.clip(p[:, 0].astype(np.int64), 0, camera.width - 1)
        row = np.clip(p[:, 1].astype(np.int64), 0, camera.height - 1)
        farthest = self.nearness[row, column].copy()
        for dx, dy in ((dx, dy) for dx in (-around, 0, around) for dy in (-around, 0, around)):
            beside = np.clip(row + dy, 0, camera.height - 1), np.clip(column + dx, 0, camera.width - 1)
            farthest = np.minimum(farthest, self.nearness[beside])
        hidden: NDArray[np.bool_] = farthest > p[:, 2] + _HIDDEN
        return hidden


@dataclass(frozen=True, eq=False)
class Picture(Sight):
    """The picture of a camera: also the lit colours, white without a solid, shape (H, W, 3)."""

    image: Image

    def outlined(self, jump: float = 4e-3) -> Image:
        """Return the image with dark lines around solids, and where the surface jumps by more than this [m]."""
        image = self.image.copy()
        image[_borders(self, jump) & (self.solid >= 0)] *= _LINE
        return image


def _borders(picture: Sight, jump: float) -> NDArray[np.bool_]:
    near = np.where(picture.solid >= 0, picture.nearness, -1e3)
    result = np.zeros(near.shape, dtype=bool)
    for axis in (0, 1):
        ahead = tuple(slice(1, None) if k == axis else slice(None) for k in (0, 1))
        behind = tuple(slice(None, -1) if k == axis else slice(None) for k in (0, 1))
        change = (picture.solid[ahead] != picture.solid[behind]) | (np.abs(near[ahead] - near[behind]) > jump)
        result[ahead] |= change
        result[behind] |= change
    return result


def look_along(towards: FloatArray, above: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return right, up and towards of a view whose up is as near to `above` as can be."""
    w = towards / np.linalg.norm(towards)
    right = np.cross(above, w)
    if np.linalg.norm(right) < 1e-6:
        right = np.cross(np.eye(3)[int(np.argmin(np.abs(w)))], w)
    right = right / np.linalg.norm(right)
    return right, np.cross(w, right), w


def fitted_camera(
    towards: FloatArray,
    focus: FloatArray,
    size: tuple[int, int],
    scale: float | None = None,
    above: FloatArray | None = None,
    filled: float = 0.9,
) -> Camera:
    """Return a camera that shows all points of the focus, as large as the picture allows or at a given scale.

    Args:
        towards: from the scene to the viewer. focus: shape (N, 3) [m]. size: in pixels. scale: pixels per metre.
        above: the upward direction of the picture; the world's z axis by default.
        filled: used share of the picture [-].
    """
    right, up, back = look_along(towards, np.array([0.0, 0.0, 1.0]) if above is None else above)
    across = np.column_stack([focus @ right, focus @ up])
    low, high = across.min(axis=0), across.max(axis=0)
    fitting = float((filled * np.array(size) / np.maximum(high - low, 1e-6)).min())
    middle = 0.5 * (low + high)
    center = right * middle[0] + up * middle[1]
    return Camera(right, up, back, center, scale or fitting, *size)


def halved(image: Image) -> Image:
    """Return an image of half the size, each pixel the mean of four, shape (H / 2, W / 2, 3)."""
    h, w = 2 * (image.shape[0] // 2), 2 * (image.shape[1] // 2)
    rows = image[0:h:2, :w] + image[1:h:2, :w]
    result: Image = np.float32(0.25) * (rows[:, 0::2] + rows[:, 1::2])
    return result
