"""What is made of a hand's shapes is read from disk in later processes, to the bit, and only for the same shapes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from clench.closing import link_bodies
from clench.core.caching import kept_arrays
from clench.kernels.runtime.made_by import made_by
from clench.models.hand import kept_hand, link_mesh
from clench.models.hand.hand import Hand
from clench.models.hand.shapes_key import shapes_key
from clench.models.shapes import CollisionSource


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("CLENCH_CACHE_DIR", str(tmp_path))
    monkeypatch.delenv(kept_arrays.SWITCH, raising=False)
    monkeypatch.setenv(kept_hand.SWITCH, "0")
    return tmp_path / "arrays"


def leaves(value: Any) -> list[tuple[object, ...]]:
    """Return kind, place in memory and bits of every number of a value."""
    if isinstance(value, np.ndarray):
        flags = value.flags
        return [(value.dtype, value.shape, flags.c_contiguous, flags.f_contiguous, flags.writeable, value.tobytes())]
    if isinstance(value, tuple):
        return [leaf for part in value for leaf in leaves(part)]
    return [(type(value), repr(value))]


def made_of(hand: Hand, source: CollisionSource) -> list[tuple[object, ...]]:
    meshes = [
        (m.link, m.tree, m.owners, m.closed, m.center, m.radius, m.points) for m in link_mesh.link_meshes(hand, source)
    ]
    return [*leaves(tuple(meshes)), *leaves(link_bodies.link_bodies(hand, source))]


@pytest.mark.parametrize("source", [CollisionSource.ENGINE, CollisionSource.VISUAL])
def test_a_hand_has_the_same_bodies_from_disk(
    folder: Path, monkeypatch: pytest.MonkeyPatch, source: CollisionSource
) -> None:
    monkeypatch.setenv(kept_arrays.SWITCH, "0")
    without_files = made_of(Hand.load("robonaut2"), source)
    assert not folder.exists()
    monkeypatch.delenv(kept_arrays.SWITCH)
    assert made_of(Hand.load("robonaut2"), source) == without_files
    assert len(list(folder.iterdir())) == 2
    monkeypatch.setattr(link_mesh, "_link_mesh", None)  # nothing is made again
    monkeypatch.setattr(link_bodies, "shape_elements", None)
    assert made_of(Hand.load("robonaut2"), source) == without_files


def test_other_shapes_have_another_key(tmp_path: Path) -> None:
    hand = Hand.load("robonaut2")
    source = CollisionSource.ENGINE
    first = next(n for n in hand.solid_links if hand.links[n].shapes[source])
    link = hand.links[first]
    shape = link.shapes[source][0]
    grown = replace(shape, size=(float(np.nextafter(shape.size[0], 1.0)), *shape.size[1:]))
    links = list(hand.links)
    links[first] = replace(link, shapes={**link.shapes, source: (grown, *link.shapes[source][1:])})
    maker = tmp_path / "maker.py"
    maker.write_text("one = 1\n")
    keys = [
        shapes_key(hand, source, "link meshes"),
        shapes_key(hand, source, "link bodies"),
        shapes_key(hand, CollisionSource.VISUAL, "link meshes"),
        shapes_key(replace(hand, links=tuple(links)), source, "link meshes"),
        shapes_key(hand, source, "link meshes", str(maker)),
    ]
    maker.write_text("one = 2\n")
    made_by.cache_clear()
    keys.append(shapes_key(hand, source, "link meshes", str(maker)))
    assert len(set(keys)) == len(keys)
    assert shapes_key(Hand.load("robonaut2"), source, "link meshes") == keys[0]
