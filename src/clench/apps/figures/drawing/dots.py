"""Put dots into images: contacts as they are seen in small pictures and films."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from clench.core.pose import FloatArray
from clench.models.appearance import rgb

from . import style
from .camera import Image

#: Radius of a dot, width of its rim, and radius of the hole of a ring, as shares of its radius.
RADIUS: Final = 4.0
_RIM: Final = 0.25
_HOLE: Final = 0.5


def dotted(image: Image, places: FloatArray, hidden: NDArray[np.bool_], radius: float = RADIUS) -> Image:
    """Return an image with dots at contacts, and rings at those that are hidden.

    Args:
        image: shape (H, W, 3). places: column and row of every contact [px], shape (C, 2). hidden: shape (C,).
        radius: of a dot [px].
    """
    paper, ink = style.PAPER, style.CONTACT
    discs = ((paper, places, (1.0 + _RIM) * radius), (ink, places, radius), (paper, places[hidden], _HOLE * radius))
    for color, where, size in discs:
        mask = covered(image.shape[:2], where, size)[..., None]
        image = (1.0 - mask) * image + mask * np.array(rgb(color), dtype=np.float32)
    return image


def covered(shape: tuple[int, ...], places: FloatArray, radius: float = (1.0 + _RIM) * RADIUS) -> Image:
    """Return how much of each pixel discs of a radius cover, shape (H, W)."""
    y, x = np.mgrid[: shape[0], : shape[1]] + 0.5
    mask = np.zeros(shape, dtype=np.float32)
    for px, py in places:
        mask = np.maximum(mask, np.clip(radius + 0.5 - np.hypot(x - px, y - py), 0.0, 1.0).astype(np.float32))
    return mask
