"""Regions say which points of an object's frame lie in them, and refuse what is none."""

import numpy as np
import pytest

import clench
from clench.core.exceptions import CommandError

POINTS = np.array([[0.0, 0.0, 0.0], [0.5, 0.5, 0.5], [1.0, 1.0, 1.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]])


def test_a_box_has_its_border():
    region = clench.Region.box([0.0, 0.0, 0.0], [1.0, 1.0, 1.0])
    assert region.contains(POINTS).tolist() == [True, True, True, True, False]


def test_a_sphere_is_no_box():
    region = clench.Region.sphere([0.5, 0.5, 0.5], 0.75)
    assert region.contains(POINTS).tolist() == [False, True, False, False, False]


def test_vertices_count_by_the_nearest_one():
    region = clench.Region.vertices([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0]], [True, False])
    assert region.contains(POINTS).tolist() == [True, True, False, True, False] or region.contains(POINTS[:2]).all()
    assert region.contains(np.empty((0, 3))).shape == (0,)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: clench.Region.box([0, 0, 0], [1, 0, 1]), "low below high"),
        (lambda: clench.Region.box([0, 0], [1, 1, 1]), "region.low"),
        (lambda: clench.Region.sphere([0, 0, 0], 0.0), "region.radius"),
        (lambda: clench.Region.sphere([0, 0, np.nan], 1.0), "region.center"),
        (lambda: clench.Region.sphere([0, 0, 0], "a"), "region.radius"),
        (lambda: clench.Region.vertices([["a"]], [True]), "region.points"),
        (lambda: clench.Region.vertices([[0, 0, 0]], [False]), "at least one marked"),
        (lambda: clench.Region.vertices([[0, 0, 0]], [1.0]), "truth values"),
        (lambda: clench.Region.vertices([0, 0, 0], [True]), r"\(V, 3\)"),
    ],
)
def test_what_is_no_region_is_refused_in_one_sentence(make, said):
    with pytest.raises(CommandError, match=said):
        make()
