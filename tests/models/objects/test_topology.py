"""Edges, and names of vertices, against counting them one by one."""

from collections import Counter

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from clench.models.objects.topology import compact, edge_defects

names = st.integers(0, 6)
triangles = st.lists(st.tuples(names, names, names).filter(lambda t: len(set(t)) == 3), min_size=1, max_size=14)


@given(triangles, st.sampled_from([1, 1000, 10**9, 10**17]))
def test_edges_are_counted_however_far_apart_the_names_of_vertices_are(given_triangles, apart):
    uses, upwards = Counter(), Counter()
    for t in given_triangles:
        for a, b in zip(t, (*t[1:], t[0]), strict=True):
            uses[min(a, b), max(a, b)] += 1
            upwards[min(a, b), max(a, b)] += a < b
    found = edge_defects(apart * np.array(given_triangles))
    assert found.holes == sum(count == 1 for count in uses.values())
    assert found.crowded == sum(count > 2 for count in uses.values())
    assert found.twisted == sum(uses[e] == 2 and upwards[e] != 1 for e in uses)


@given(triangles, st.sampled_from([1, 3, 1000, 10**12]))
def test_vertices_that_triangles_name_are_numbered_in_order(given_triangles, apart):
    faces = apart * np.array(given_triangles)
    used, compacted = compact(faces)
    assert np.array_equal(used, np.unique(faces))
    assert np.array_equal(used[compacted], faces)
    assert compacted.dtype == np.int64
