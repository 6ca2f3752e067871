"""The key on disk of arrays that are made of the shapes of a hand's links."""

from __future__ import annotations

from clench.core import pose
from clench.core.caching import kept_arrays
from clench.core.caching.fingerprint import fingerprint
from clench.models import mesh, parts, shapes, tessellation
from clench.models.shapes import CollisionSource

from .hand import Hand


def shapes_key(hand: Hand, source: CollisionSource, what: str, *files: str) -> str:
    """Return the hash of everything that such arrays depend on, hexadecimal.

    Args:
        hand, source: whose shapes. what: name of the arrays.
        files: of the modules without kernels that make them; those that make meshes of shapes count always.
    """
    from clench.kernels.geometry import bodies
    from clench.kernels.runtime.made_by import made_by

    makers = [str(module.__file__) for module in (pose, kept_arrays, mesh, parts, shapes, tessellation)]
    links = [[n, hand.links[n].shapes.get(source, ())] for n in hand.solid_links]
    return fingerprint(what, made_by(str(bodies.__file__), *makers, *files), len(hand.links), str(source), links)
