"""Objects that are bodies of revolution: a bottle and a screwdriver handle, with their convex pieces."""

from __future__ import annotations

from typing import Final

import numpy as np

from clench.core.pose import FloatArray
from clench.models.mesh import TriangleMesh
from clench.models.shapes import Shape, ShapeKind
from clench.models.tessellation import circle, revolve

from .grasp_object import Body

Profile = list[tuple[float, float]]

COLUMNS: Final = 96
#: The screwdriver's section is `1 + LOBE_DEPTH cos(LOBES angle)`; convex as long as `LOBE_DEPTH (LOBES² - 1) <= 1`.
LOBES: Final = 6
LOBE_DEPTH: Final = 0.025


def bottle() -> Body:
    """Return a closed half-litre bottle, 66 mm wide and 203 mm high, that stands on z = 0."""
    profile = [
        *_arc(0.029, 0.033, 0.0, 0.004, 6),
        *_blend(0.033, 0.0135, 0.118, 0.168, 16),
        (0.0135, 0.182),
        (0.0150, 0.182),
        (0.0150, 0.202),
        (0.0140, 0.203),
    ]
    return _body("bottle", profile, circle(COLUMNS))


def screwdriver() -> Body:
    """Return a screwdriver along +z, its butt at z = 0: a lobed handle of 112 mm and a shaft up to 195 mm."""
    profile = [
        *_arc(0.008, 0.0165, 0.0, 0.010, 8),
        *_blend(0.0165, 0.0120, 0.045, 0.078, 12),
        *_blend(0.0120, 0.0145, 0.080, 0.100, 10),
        (0.0145, 0.104),
        (0.0110, 0.112),
        (0.0040, 0.112),
        (0.0040, 0.195),
    ]
    round_section = circle(COLUMNS)
    angle = np.arctan2(round_section[:, 1], round_section[:, 0])
    lobed = round_section * (1.0 + LOBE_DEPTH * np.cos(LOBES * angle))[:, None]
    return _body("screwdriver", profile, lobed)


def convex_pieces(profile: Profile, section: FloatArray) -> tuple[TriangleMesh, ...]:
    """Split a body of revolution, with a convex section, into convex bodies that fill it exactly.

    A run of the profile whose radius is a concave function of height makes a convex body; a step at one height ends it.

    Args:
        profile: radius and height [m], heights not falling, without the poles. section: as for `revolve`.
    """
    pieces, start = [], 0
    for i in range(1, len(profile)):
        if not _rises(profile, i - 1):
            start = i
            continue
        ends = i + 1 == len(profile) or not _rises(profile, i) or _slope(profile, i) > _slope(profile, i - 1) + 1e-12
        if ends:
            run = profile[start : i + 1]
            pieces.append(revolve([(0.0, run[0][1]), *run, (0.0, run[-1][1])], section))
            start = i
    return tuple(pieces)


def _body(name: str, profile: Profile, section: FloatArray) -> Body:
    surface = revolve([(0.0, profile[0][1]), *profile, (0.0, profile[-1][1])], section)
    shape = Shape(ShapeKind.MESH, mesh=surface, name=name)
    return Body(name, (shape,), pieces=convex_pieces(profile, section))


def _rises(profile: Profile, i: int) -> bool:
    return profile[i + 1][1] > profile[i][1]


def _slope(profile: Profile, i: int) -> float:
    return (profile[i + 1][0] - profile[i][0]) / (profile[i + 1][1] - profile[i][1])


def _arc(r0: float, r1: float, z0: float, z1: float, steps: int) -> Profile:
    """Return a quarter of an ellipse from `(r0, z0)`, flat there, to `(r1, z1)`, upright there."""
    t = np.arange(steps + 1) * (np.pi / 2.0 / steps)
    return list(zip((r0 + (r1 - r0) * np.sin(t)).tolist(), (z1 - (z1 - z0) * np.cos(t)).tolist(), strict=True))


def _blend(r0: float, r1: float, z0: float, z1: float, steps: int) -> Profile:
    """Return a cosine from `(r0, z0)` to `(r1, z1)`, upright at both ends."""
    t = np.arange(steps + 1) / steps
    radius = r0 + (r1 - r0) * (1.0 - np.cos(np.pi * t)) / 2.0
    return list(zip(radius.tolist(), (z0 + (z1 - z0) * t).tolist(), strict=True))
