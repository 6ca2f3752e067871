"""Random planar cases, reproducible one by one: ``make_case(seed, index)``. About a third are degenerate on purpose."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from .compiled import Floats, Ints
from .distances import place
from .planar import gap_at
from .scene import PlanarCurve, PlanarFinger, PlanarOutline
from .shapes import CURVES, OUTLINE_KINDS, Rng, outline, outline_core, rectangle, ring_of_sides, turned

TRIES = 6


@dataclass(frozen=True)
class PlanarCase:
    """One finger, one curve, and the name of the kind of scene they come from."""

    name: str
    seed: int
    index: int
    finger: PlanarFinger
    curve: PlanarCurve


def cases(seed: int, count: int, start: int = 0) -> Iterator[PlanarCase]:
    """Yield ``count`` cases of a seed."""
    for index in range(start, start + count):
        yield make_case(seed, index)


def make_case(seed: int, index: int) -> PlanarCase:
    """Return case ``index`` of a seed: the same one whatever else was drawn."""
    rng = np.random.default_rng([seed, index])
    name = str(rng.choice(list(SCENES), p=WEIGHTS))
    finger, curve = SCENES[name](rng)
    factor = float(rng.choice([1.0, 1e3, 1e-4], p=[0.84, 0.08, 0.08]))
    if rng.random() < 0.5:
        finger, curve = mirrored(finger, curve)
    if factor != 1.0:
        finger, curve = scaled(finger, curve, factor)
    return PlanarCase(name, seed, index, finger, curve)


def mirrored(finger: PlanarFinger, curve: PlanarCurve) -> tuple[PlanarFinger, PlanarCurve]:
    """Return the scene seen in a mirror (z to -z): it turns the other way, windings stay counter-clockwise outside."""
    flip = np.array([1.0, -1.0])
    outlines = tuple(
        PlanarOutline(o.joint, o.vertices * flip, o.sides[:, ::-1].copy(), o.radius) for o in finger.outlines
    )
    image = PlanarFinger(finger.pivots * flip, -finger.rates, finger.dof, finger.limits, outlines)
    loops = tuple((loop * flip)[::-1].copy() for loop in curve.loops)
    lines = tuple(line * flip for line in curve.lines)
    return image, PlanarCurve(loops, lines, curve.disks * np.array([1.0, -1.0, 1.0]), curve.two_sided)


def scaled(finger: PlanarFinger, curve: PlanarCurve, factor: float) -> tuple[PlanarFinger, PlanarCurve]:
    """Return the scene with all lengths multiplied."""
    outlines = tuple(PlanarOutline(o.joint, o.vertices * factor, o.sides, o.radius * factor) for o in finger.outlines)
    grown = PlanarFinger(finger.pivots * factor, finger.rates, finger.dof, finger.limits, outlines)
    loops, lines = tuple(p * factor for p in curve.loops), tuple(p * factor for p in curve.lines)
    return grown, PlanarCurve(loops, lines, curve.disks * factor, curve.two_sided)


def random_dofs(count: int, rng: Rng) -> tuple[Ints, Floats]:
    """Return degree of freedom and rate of each joint: mostly one each; some follow an earlier joint, a few of them
    backwards.
    """
    dof, rates = np.zeros(count, dtype=np.int64), np.ones(count)
    coupled = rng.choice([0.0, 0.5])
    for j in range(1, count):
        if rng.random() < coupled:
            dof[j] = dof[j - 1] if rng.random() < 0.7 else rng.integers(0, dof[:j].max() + 1)
            rates[j] = rng.choice([1.0, 0.7, 1.3, rng.uniform(0.2, 1.5), -0.6])
        else:
            dof[j] = dof[:j].max() + 1
            rates[j] = rng.choice([1.0, 1.0, 1.0, 1.0, -1.0])
    return dof, rates


def random_finger(rng: Rng, kinds: tuple[str, ...] = OUTLINE_KINDS, joints: int = 0) -> PlanarFinger:
    """Return a chain of 1 to 5 joints, somewhat curled at its open posture, with one or two outlines on most links."""
    count = joints or int(rng.choice([1, 2, 3, 4, 5], p=[0.3, 0.25, 0.25, 0.1, 0.1]))
    lengths = rng.uniform(0.02, 0.06, count)
    heading = np.cumsum(rng.choice([0.0, 1.0]) * rng.uniform(-0.2, 0.4, count))
    pivots = np.zeros((count, 2))
    pivots[0] = rng.choice([0.0, 1.0]) * rng.uniform(-0.05, 0.05, 2)
    pivots[1:] = np.column_stack([lengths * np.cos(heading), lengths * np.sin(heading)])[:-1]
    outlines: list[PlanarOutline] = []
    for j in range(count):
        for _ in range(int(rng.choice([1, 1, 1, 2])) if j < count - 1 or outlines else 1):
            outlines.append(outline(kinds[int(rng.integers(len(kinds)))], j, lengths[j], heading[j], rng))
    dof, rates = random_dofs(count, rng)
    limits = np.where(rng.random(count) < 0.1, rng.uniform(2.2, 6.2, count), rng.uniform(0.3, 2.2, count))
    return PlanarFinger(pivots, rates, dof, limits, tuple(outlines))


def random_curve(rng: Rng) -> PlanarCurve:
    """Return a curve of any kind near the origin."""
    kind = list(CURVES)[int(rng.integers(len(CURVES)))]
    return CURVES[kind](float(rng.choice([0.008, 0.02, 0.04]) * rng.uniform(0.5, 1.5)), rng)


def is_open(finger: PlanarFinger, curve: PlanarCurve) -> bool:
    """Tell whether the open finger is clear of the curve."""
    return gap_at(finger, curve, np.zeros(finger.dofs)) >= 0.0


def placed_vertices(finger: PlanarFinger, parameters: Floats, index: int) -> Floats:
    """Return the core vertices (n, 2) of an outline, in the plane, at degree of freedom parameters."""
    return place(finger.packed, index, finger.angles(parameters))[1]


def pushed_against(finger: PlanarFinger, curve: PlanarCurve, angle: float, rng: Rng) -> PlanarCurve:
    """Return the curve moved in from outside, from the side at ``angle``, to touch the open finger to about 1e-15."""
    o = int(rng.integers(len(finger.outlines)))
    target = placed_vertices(finger, np.zeros(finger.dofs), o).mean(axis=0)
    inward = -np.array([np.cos(angle), np.sin(angle)])
    curve = curve.moved(target - 4.0 * (finger.length + 0.1) * inward)
    for _ in range(400):
        gap = gap_at(finger, curve, np.zeros(finger.dofs))
        if gap <= 1e-15 or gap > 1.0:
            break
        curve = curve.moved(gap * inward)
    return curve


def _anywhere(rng: Rng) -> tuple[PlanarFinger, PlanarCurve]:
    finger = random_finger(rng)
    for _ in range(TRIES):
        curve = random_curve(rng)
        parameters = np.array([finger.travel(g) * rng.uniform(0.0, 1.0) for g in range(finger.dofs)])
        goal = placed_vertices(finger, parameters, int(rng.integers(len(finger.outlines))))[0]
        curve = curve.moved(goal + rng.normal(0.0, 0.01, 2))
        if is_open(finger, curve):
            break
    return finger, curve


def _touching(rng: Rng) -> tuple[PlanarFinger, PlanarCurve]:
    finger = random_finger(rng)
    curve = pushed_against(finger, random_curve(rng), rng.uniform(0, 2 * np.pi), rng)
    return finger, curve.moved(rng.choice([0.0, 0.0, 1e-14, -1e-13, 1e-12]) * np.array([0.6, 0.8]))


def _grazing(rng: Rng) -> tuple[PlanarFinger, PlanarCurve]:
    """Push the curve against the circle that the first link's farthest vertex sweeps, then off by next to nothing."""
    finger = random_finger(rng, joints=int(rng.choice([1, 1, 2])))
    reach = 0.0
    for o in range(len(finger.outlines)):
        away = placed_vertices(finger, np.zeros(finger.dofs), o) - finger.pivots[0]
        reach = max(reach, float(np.max(np.hypot(away[:, 0], away[:, 1]))) + finger.outlines[o].radius)
    swept = PlanarOutline(0, np.zeros((1, 2)), ring_of_sides(1), reach)
    one = np.ones(1)
    disk = PlanarFinger(finger.pivots[:1], one, np.zeros(1, dtype=np.int64), one, (swept,))
    curve = pushed_against(disk, random_curve(rng), rng.uniform(0.1, finger.travel(0)), rng)
    middle = np.concatenate([curve.segments.reshape(-1, 2), curve.disks[:, :2]]).mean(axis=0) - finger.pivots[0]
    slip = float(rng.choice([-1e-7, -1e-8, -1e-9, -1e-11, -1e-12, 0.0, 1e-12, 1e-9]))
    return finger, curve.moved(slip * middle / np.hypot(*middle))


def _vertex_on_vertex(rng: Rng) -> tuple[PlanarFinger, PlanarCurve]:
    finger = random_finger(rng, ("box", "convex", "nonconvex", "blade"), joints=int(rng.choice([1, 2])))
    for _ in range(TRIES):
        loop = CURVES[str(rng.choice(["box", "star", "needle", "blade"]))](0.02, rng).loops[0]
        parameters = np.zeros(finger.dofs)
        parameters[0] = finger.travel(0) * rng.uniform(0.1, 0.9)
        core = placed_vertices(finger, parameters, 0)
        curve = PlanarCurve((loop - loop[int(rng.integers(len(loop)))] + core[int(rng.integers(len(core)))],))
        if is_open(finger, curve):
            break
    return finger, curve


def _vertex_at_pivot(rng: Rng) -> tuple[PlanarFinger, PlanarCurve]:
    finger = random_finger(rng, ("cornered", "cornered", "disk", "convex"), joints=int(rng.choice([1, 2, 3])))
    pivots = np.cumsum(finger.pivots, axis=0)
    for _ in range(4 * TRIES):
        loop = CURVES[str(rng.choice(["box", "star", "needle", "blade"]))](0.02, rng).loops[0]
        curve = PlanarCurve((loop - loop[int(rng.integers(len(loop)))] + pivots[int(rng.integers(len(pivots)))],))
        if is_open(finger, curve):
            break
    return finger, curve


def _flush(rng: Rng) -> tuple[PlanarFinger, PlanarCurve]:
    """Lay a face of the object exactly where a flat side of the link arrives."""
    finger = random_finger(rng, joints=1)
    length = 0.05
    core, radius = outline_core(str(rng.choice(["box", "round_box", "capsule", "blade"])), length, rng)
    core[:, 1] = np.where(core[:, 1] > core[:, 1].mean(), core[:, 1].max(), core[:, 1].min())
    top = float(core[:, 1].max() + radius)
    link = PlanarOutline(0, core, ring_of_sides(len(core)), float(radius))
    finger = PlanarFinger(finger.pivots, np.ones(1), finger.dof, np.array([1.5]), (link,))
    ends = np.sort(rng.choice([0.0, 0.3 * length, length, 1.4 * length, *core[:2, 0]], 2, replace=False))
    face = rectangle(ends[0], max(ends[1], ends[0] + 1e-3), top, top + rng.choice([0.01, 1e-4]))
    return finger, PlanarCurve((turned(face, float(rng.choice([0.0, rng.uniform(0.1, 1.4)]))) + finger.pivots[0],))


def _sliding(rng: Rng) -> tuple[PlanarFinger, PlanarCurve]:
    """Let a round link roll about a disk that is concentric with its joint: touching all along."""
    radius, away = rng.uniform(0.003, 0.01), rng.uniform(0.02, 0.05)
    lug = PlanarOutline(0, np.array([[away, 0.0]]), ring_of_sides(1), radius)
    finger = PlanarFinger(np.zeros((1, 2)), np.ones(1), np.zeros(1, dtype=np.int64), np.array([1.5]), (lug,))
    disks = [[0.0, 0.0, away - radius]]
    if rng.random() < 0.7:
        angle = rng.uniform(0.5, 1.4)
        disks.append([away * np.cos(angle), away * np.sin(angle), 0.4 * radius])
    return finger, PlanarCurve(disks=np.array(disks))


SCENES: dict[str, Callable[[Rng], tuple[PlanarFinger, PlanarCurve]]] = {
    "anywhere": _anywhere,
    "touching": _touching,
    "grazing": _grazing,
    "vertex_on_vertex": _vertex_on_vertex,
    "vertex_at_pivot": _vertex_at_pivot,
    "flush": _flush,
    "sliding": _sliding,
}
WEIGHTS = (0.66, 0.1, 0.06, 0.06, 0.06, 0.05, 0.01)
