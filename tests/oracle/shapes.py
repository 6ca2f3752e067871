"""Random outlines and curves, the nasty ones on purpose. Sizes in metres, for a finger of about 0.1 m."""

from collections.abc import Callable

import numpy as np

from .compiled import Floats, Ints
from .scene import PlanarCurve, PlanarOutline

Rng = np.random.Generator
BLADE = 1e-4


def turned(points: Floats, angle: float) -> Floats:
    """Return points (n, 2) rotated about the origin."""
    c, s = np.cos(angle), np.sin(angle)
    moved: Floats = points @ np.array([[c, s], [-s, c]])
    return moved


def ring_of_sides(count: int) -> Ints:
    """Return the sides of a polygon; none for one vertex, two opposite ones for two."""
    first = np.arange(count if count > 1 else 0)
    return np.column_stack([first, (first + 1) % count])


def rectangle(x0: float, x1: float, z0: float, z1: float) -> Floats:
    """Return the corners of a rectangle, counter-clockwise."""
    return np.array([[x0, z0], [x1, z0], [x1, z1], [x0, z1]])


def around(count: int, a: float, b: float, rng: Rng, low: float = 1.0) -> Floats:
    """Return points round an ellipse at random rising angles, at least 5; ``low`` < 1 draws them in at random."""
    steps = rng.uniform(0.3, 1.0, count)
    angle = np.cumsum(steps / steps.sum()) * 2 * np.pi + rng.uniform(0, 2 * np.pi)
    radius = rng.uniform(low, 1.0, count) if low < 1.0 else np.ones(count)
    return np.column_stack([a * radius * np.cos(angle), b * radius * np.sin(angle)])


OUTLINE_KINDS = (
    "disk",
    "capsule",
    "tapered",
    "box",
    "round_box",
    "convex",
    "nonconvex",
    "round_nonconvex",
    "blade",
    "cornered",
)


def outline_core(kind: str, length: float, rng: Rng) -> tuple[Floats, float]:
    """Return the vertices of a link of this length along +x, and its radius."""
    thick = rng.uniform(0.003, 0.009)
    start = rng.choice([0.0, rng.uniform(0.05, 0.4)]) * length
    box = rectangle(start, length, -thick, thick * rng.uniform(0.3, 1.0))
    middle = np.array([0.5 * (start + length), 0.0])
    half = 0.5 * (length - start)
    if kind == "disk":
        return np.array([[length * rng.uniform(0.3, 1.0), thick * rng.uniform(-0.5, 0.5)]]), thick
    if kind == "capsule":
        return np.array([[start, 0.0], [length, thick * rng.uniform(-0.5, 0.5)]]), thick
    if kind == "tapered":
        box[1:3, 1] *= rng.uniform(0.1, 0.8)
        return box, rng.uniform(0.0005, 0.004)
    if kind in ("box", "round_box"):
        return box, 0.0 if kind == "box" else rng.choice([1e-6, 1e-4, 0.003])
    if kind == "blade":
        return rectangle(start, length, 0.0, BLADE), rng.choice([0.0, 0.0, BLADE])
    if kind == "cornered":
        return rectangle(0.0, length, -2 * thick, 0.0), 0.0
    low = 1.0 if kind == "convex" else 0.4
    radius = 0.003 if kind == "round_nonconvex" else 0.0
    return around(int(rng.integers(5, 10)), half, 1.5 * thick, rng, low) + middle, radius


def outline(kind: str, joint: int, length: float, heading: float, rng: Rng) -> PlanarOutline:
    """Return an outline of a named kind whose link points along ``heading`` at the open posture."""
    core, radius = outline_core(kind, length, rng)
    return PlanarOutline(joint, turned(core, heading), ring_of_sides(len(core)), float(radius))


def _circle(size: float, rng: Rng) -> PlanarCurve:
    return PlanarCurve((around(int(rng.integers(6, 40)), size, size, rng),))


def _ellipse(size: float, rng: Rng) -> PlanarCurve:
    return PlanarCurve(
        (turned(around(int(rng.integers(6, 30)), size, size * rng.uniform(0.2, 0.8), rng), rng.uniform(0, 7)),)
    )


def _box(size: float, rng: Rng) -> PlanarCurve:
    wide = size * rng.uniform(0.3, 1.0)
    return PlanarCurve((turned(rectangle(-size, size, -wide, wide), rng.uniform(0, 7)),))


def _star(size: float, rng: Rng) -> PlanarCurve:
    return PlanarCurve((around(int(rng.integers(6, 24)), size, size, rng, 0.3),))


def _blade(size: float, rng: Rng) -> PlanarCurve:
    return PlanarCurve((turned(rectangle(-size, size, 0.0, BLADE * rng.choice([1.0, 0.01])), rng.uniform(0, 7)),))


def _needle(size: float, rng: Rng) -> PlanarCurve:
    return PlanarCurve((turned(np.array([[-size, 0.0], [size, 0.0], [-size, BLADE]]), rng.uniform(0, 7)),))


def _disk(size: float, rng: Rng) -> PlanarCurve:
    return PlanarCurve(disks=np.array([[0.0, 0.0, size * rng.choice([1.0, 0.1])]]))


def _ring(size: float, rng: Rng) -> PlanarCurve:
    count = int(rng.integers(8, 24))
    return PlanarCurve(
        (around(count, 1.1 * size, 1.1 * size, rng), around(count, 0.7 * size, 0.7 * size, rng)[::-1].copy())
    )


def _zigzag(size: float, rng: Rng) -> PlanarCurve:
    x = np.linspace(-size, size, int(rng.integers(2, 12)))
    line = turned(np.column_stack([x, size * rng.uniform(-0.2, 0.2, len(x))]), rng.uniform(0, 7))
    return PlanarCurve(lines=(line,), two_sided=True)


def _flipped(size: float, rng: Rng) -> PlanarCurve:
    return PlanarCurve((_star(size, rng).loops[0][::-1].copy(),), two_sided=True)


def _stuttering(size: float, rng: Rng) -> PlanarCurve:
    loop = _star(size, rng).loops[0]
    return PlanarCurve((np.repeat(loop, rng.integers(1, 3, len(loop)), axis=0),))


def _pieces(size: float, rng: Rng) -> PlanarCurve:
    loops: list[Floats] = []
    for _ in range(int(rng.integers(2, 4))):
        make = (_circle, _box, _star, _blade)[int(rng.integers(4))]
        loops += make(0.5 * size, rng).moved(rng.uniform(-1.0, 1.0, 2) * size).loops
    disks = np.array([[*rng.uniform(-1.0, 1.0, 2) * size, 0.3 * size]])
    return PlanarCurve(tuple(loops), disks=disks if rng.random() < 0.3 else np.zeros((0, 3)))


CURVES: dict[str, Callable[[float, Rng], PlanarCurve]] = {
    "circle": _circle,
    "ellipse": _ellipse,
    "box": _box,
    "star": _star,
    "blade": _blade,
    "needle": _needle,
    "disk": _disk,
    "ring": _ring,
    "zigzag": _zigzag,
    "flipped": _flipped,
    "stuttering": _stuttering,
    "pieces": _pieces,
}
