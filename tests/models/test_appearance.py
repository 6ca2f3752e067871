"""What hand and object look like: every link and body once, in its own frame."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

import clench
from clench.models.appearance import (
    OBJECT_COLOR,
    OBSTACLE_COLOR,
    PALM_COLOR,
    SolidKind,
    hand_solids,
    mixed,
    object_solids,
    thinned,
)
from clench.models.mesh import TriangleMesh
from clench.models.objects.obstacles import table


def test_every_link_with_a_shape_is_a_solid_once() -> None:
    hand = clench.Hand.load("robonaut2")
    solids = hand_solids(hand, hand.default_source)
    assert [s.index for s in solids] == [i for i, link in enumerate(hand.links) if link.shapes[hand.default_source]]
    assert [s.name for s in solids] == [hand.links[s.index].name for s in solids]
    palm = next(s for s in solids if s.index == hand.palm)
    assert (palm.kind, palm.color) == (SolidKind.HAND, PALM_COLOR)
    tips = {s.color for s in solids if s.name.endswith("_distal")}
    assert tips == {mixed("#009e73", "#ffffff", 0.3), mixed("#cc79a7", "#ffffff", 0.3)}


def test_obstacles_are_told_from_what_is_grasped() -> None:
    scene = clench.GraspObject.load("ball").with_body(table(-0.03))
    ball, board = object_solids(scene, "raw")
    assert (ball.kind, ball.color) == (SolidKind.OBJECT, OBJECT_COLOR)
    assert (board.kind, board.color, board.index) == (SolidKind.OBSTACLE, OBSTACLE_COLOR, 1)


def test_an_engine_sees_the_hull_of_a_mesh() -> None:
    mug = clench.GraspObject.load("mug")
    raw, hull = object_solids(mug, "raw")[0].mesh, object_solids(mug, "engine")[0].mesh
    middle = raw.vertices[:, :2].mean(axis=0)
    assert len(hull.triangles) < len(raw.triangles)
    np.testing.assert_allclose(np.ptp(hull.vertices, axis=0), np.ptp(raw.vertices, axis=0))
    assert np.isfinite(middle).all()


def test_solids_are_in_their_own_frame() -> None:
    ball = clench.GraspObject.load("ball")
    moved = replace(ball, pose=clench.Pose([1.0, 2.0, 3.0]))
    np.testing.assert_array_equal(
        object_solids(ball, "raw")[0].mesh.vertices, object_solids(moved, "raw")[0].mesh.vertices
    )


def test_huge_meshes_are_thinned_without_changing_their_shape() -> None:
    ball = clench.GraspObject.load("sphere:r=0.05").bodies[0].shapes[0].to_mesh(2e-7)
    assert len(ball.triangles) > 50_000
    few = thinned(ball, 5_000)
    assert 500 < len(few.triangles) <= 5_000
    radii = np.linalg.norm(few.vertices[np.unique(few.triangles)], axis=1)
    np.testing.assert_allclose(radii, 0.05, atol=1e-5)
    small = TriangleMesh(np.eye(3), [[0, 1, 2]])
    assert thinned(small, 5_000) is small
