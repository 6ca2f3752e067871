"""Measure how far the convex hulls that MuJoCo collides lie off the meshes that they stand for."""

from __future__ import annotations

from typing import Final

import numpy as np

from clench.core.pose import FloatArray
from clench.models.hand.findings import Finding, FindingCode, Severity
from clench.models.hand.hand import Hand
from clench.models.mesh import TriangleMesh
from clench.models.shapes import CollisionSource

#: Distances may be too small by this [m], and hulls that are no farther off belong to convex meshes ...
HULL_TOLERANCE: Final = 1e-4
#: ... or by this share of them [-].
_SHARE: Final = 0.05
#: Number of sample points of one hull, at most, and per call.
_LOOKS: Final = 2000
_AT_ONCE: Final = 64
#: From this distance on the mesh itself is recommended [m].
_LARGE: Final = 1e-3
#: From this distance on, answers with the hulls are wrong for the links' real shapes [m].
_WRONG: Final = 1e-2


def check_hulls(hand: Hand) -> list[Finding]:
    """Return a finding that names every hull that replaces a concave mesh, with the largest distance between them."""
    found = hull_distances(hand)
    if not found:
        return []
    worst = max(found.values())
    links = tuple(sorted(found, key=lambda name: -found[name]))
    listed = ", ".join(f"'{name}' {found[name] * 1e3:.2g} mm" for name in links)
    text = f"Convex hulls replace concave meshes, off by up to (within 5 %): {listed}."
    advice = "Nothing to do: the hulls are close to the meshes."
    if worst > _LARGE:
        advice = (
            'The meshes themselves tell where these links touch: choose collision_source = "raw" (in the hand file or '
            "the command; it may be as fast). Simulations collide hulls in any case."
        )
    numbers = {f"{name}_m": distance for name, distance in found.items()}
    severity = Severity.WARNING if worst > _WRONG else Severity.NOTE
    return [Finding(FindingCode.HULL_OFF_MESH, text, advice, severity, links=links, numbers=numbers)]


def hull_distances(hand: Hand) -> dict[str, float]:
    """Return the largest distance from a link's hulls to the meshes that they replace [m], by name of the link.

    Distances are lower bounds: each was measured, and may be too small by `HULL_TOLERANCE` or 5 % of it. Links whose
    hulls are no farther off than the tolerance are left out.
    """
    known: dict[int, float] = {}
    found: dict[str, float] = {}
    for link in hand.links:
        sources = (link.shapes.get(source, ()) for source in (CollisionSource.ENGINE, CollisionSource.RAW))
        for hull, raw in ((hull.mesh, raw.mesh) for hull, raw in zip(*sources, strict=False)):
            if hull is None or raw is None or hull is raw:
                continue
            if id(raw) not in known:
                known[id(raw)] = largest_distance(hull, raw)
            if known[id(raw)] > HULL_TOLERANCE:
                found[link.name] = max(found.get(link.name, 0.0), known[id(raw)])
    return found


def largest_distance(hull: TriangleMesh, mesh: TriangleMesh) -> float:
    """Return the largest distance from the surface of a convex hull to its mesh [m].

    The distance from a point to a mesh changes by no more than the point moves. Thus one sample bounds it over a whole
    triangle. Triangles are halved until no bound is far above a distance that was seen, or until `_LOOKS` were taken.
    """
    from clench.kernels.geometry.mesh_distance import closest_point
    from clench.kernels.trees.bvh import build_tree

    tree = build_tree(mesh.vertices, mesh.triangles)
    facets = hull.vertices[hull.triangles]
    corners = np.sqrt([closest_point(tree, corner, np.inf)[0] for corner in hull.vertices])
    # No point of a triangle is farther from its nearest corner than this.
    bounds = np.sqrt(_sides(facets).max(axis=1) / 3.0) + corners[hull.triangles].max(axis=1)
    seen, looks = float(corners.max()), 0
    while looks < _LOOKS:
        order = np.argsort(-bounds)
        facets, bounds = facets[order], bounds[order]
        wide = min(int((bounds > seen + max(HULL_TOLERANCE, _SHARE * seen)).sum()), _AT_ONCE)
        if not wide:
            break
        halves = _halves(facets[:wide])
        centers = halves.mean(axis=1)
        distances = np.sqrt([closest_point(tree, center, np.inf)[0] for center in centers])
        reaches = np.linalg.norm(halves - centers[:, None], axis=2).max(axis=1)
        seen, looks = max(seen, float(distances.max())), looks + len(centers)
        tighter = np.minimum(np.tile(bounds[:wide], 2), distances + reaches)
        facets, bounds = np.concatenate([facets[wide:], halves]), np.concatenate([bounds[wide:], tighter])
    return seen


def _sides(facets: FloatArray) -> FloatArray:
    """Return the squared lengths of triangles' sides [m²], (N, 3); side k joins corners k - 1 and k."""
    return np.asarray(((facets - np.roll(facets, 1, axis=1)) ** 2).sum(axis=2))


def _halves(facets: FloatArray) -> FloatArray:
    """Return both halves of every triangle, cut through its longest side, shape (2 N, 3, 3)."""
    rows, k = np.arange(len(facets)), _sides(facets).argmax(axis=1)
    a, b, c = facets[rows, k], facets[rows, k - 1], facets[rows, k - 2]
    middle = 0.5 * (a + b)
    return np.concatenate([np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)])
