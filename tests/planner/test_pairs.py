"""Opposing places of an object, by the surface they are drawn from, pair by pair."""

import numpy as np
import pytest

import clench
from clench.closing.collision.packed_object import pack_object
from clench.planner import pairs as paired
from clench.planner.pairs import draw_surface, opposing_pairs


@pytest.mark.parametrize("model", ["mug", "cylinder:r=0.03,h=0.3", "box:x=0.05,y=0.08,z=0.2"])
def test_pairs_oppose_each_other_and_know_where_the_object_extends(model):
    obj = clench.GraspObject.load(model)
    packed, friction, widest = pack_object(obj), 0.6, 0.07
    points, normals = draw_surface(obj, packed, np.random.default_rng(0), paired._PLACES)
    found = opposing_pairs(obj, packed, friction, widest, None, None)
    assert len(found) > 80
    assert (np.diff(found.width) >= 0.0).all()
    # Each pair is there in both senses.
    assert len(found) % 2 == 0 or len(found) == paired._PAIRS
    places = {tuple(np.round(p, 9)): k for k, p in enumerate(points)}
    for n in range(0, len(found), 37):
        half = 0.5 * found.width[n] * found.way[n]
        i, k = (places[tuple(np.round(found.middle[n] + side, 9))] for side in (-half, half))
        assert paired._NEAREST < found.width[n] < widest
        assert np.linalg.norm(found.way[n]) == pytest.approx(1.0)
        least = np.cos(paired._LEAN[0] * np.arctan(friction))
        assert min(-normals[i] @ found.way[n], normals[k] @ found.way[n]) > least - 1e-12
        moments = np.zeros((3, 3))
        for end in (points[i], points[k]):
            around = points - end
            around = around[np.linalg.norm(around, axis=1) < paired._AROUND]
            moments += around.T @ around
        across = np.eye(3) - np.outer(found.way[n], found.way[n])
        values, vectors = np.linalg.eigh(across @ moments @ across)
        assert found.longer[n] == pytest.approx(1.0 - np.sqrt(values[1] / values[2]), abs=1e-9)
        if found.longer[n] > 1e-6:
            assert abs(found.along[n] @ vectors[:, 2]) == pytest.approx(1.0, abs=1e-6)


def test_no_pair_that_opposes_is_left_out():
    obj = clench.GraspObject.load("box:x=0.05,y=0.08,z=0.02")
    packed, friction = pack_object(obj), 0.5
    points, normals = draw_surface(obj, packed, np.random.default_rng(0), paired._PLACES)
    count, least = 0, np.cos(paired._LEAN[0] * np.arctan(friction))
    for p, n in zip(points, normals, strict=True):
        way = points - p
        width = np.linalg.norm(way, axis=1)
        way /= np.maximum(width, 1e-9)[:, None]
        opposed = np.minimum(-way @ n, (way * normals).sum(axis=1))
        count += int(((opposed > least) & (width > paired._NEAREST) & (width < 0.03)).sum())
    assert 100 < count < paired._PAIRS
    assert len(opposing_pairs(obj, packed, friction, 0.03, None, None)) == count
