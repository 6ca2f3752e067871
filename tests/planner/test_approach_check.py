"""Hands that are brought up stop where they touch, judged by sampled places along the way."""

from dataclasses import replace

import fcl
import numpy as np
import pytest

import clench
from chain_hands import HandBuilder, along_x, mount
from clench.closing.collision.packed_object import pack_object
from clench.closing.link_bodies import link_bodies
from clench.models.mesh import TriangleMesh
from clench.models.objects.grasp_object import BodyRole
from clench.models.objects.obstacles import table
from clench.models.shapes import CollisionSource, Shape, ShapeKind
from clench.planner.approach_check import OFF, SHORT, Approach, Approached
from clench.planner.proposals import DEEP, Arm, Proposals, frames, turns_about, vary
from engine.collisions import Collisions
from engine.statistics import HANDS


def draws(count: int) -> Proposals:
    rng = np.random.default_rng(4)
    way = rng.normal(size=(count, 3))
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    T = np.zeros((count, 4, 4))
    T[:, :3, :3] = turns_about(way, rng.uniform(0.0, 6.0, count))
    T[:, :3, 3] = rng.uniform(-0.12, 0.12, (count, 3))
    T[:, 3, 3] = 1.0
    return Proposals(np.arange(count) % 2, T, np.zeros((count, 3)))


def check(hand, obj, arms, asked) -> Approached:
    """Bring up a hand, and let fcl judge where it stops, by triangles that are off by a micrometre at most."""
    q = hand.open_angles()
    came = Approach(hand, q[None], pack_object(obj)).bring_up(asked, arms, 2)
    assert len(came.proposals) + len(came.stopped) + len(came.obstacle) == len(asked)
    judge, poses = Collisions(hand, obj), hand.link_poses(q)

    in_the_way = [body.role is not BodyRole.GRASPABLE for body in obj.bodies for _ in body.shapes]

    def touched(T) -> set[bool]:
        """Return whether what the hand overlaps is in the way, for all of it."""
        placed = [fcl.Transform((T @ pose)[:3, :3], (T @ pose)[:3, 3]) for pose in poses]
        links = [fcl.CollisionObject(t, at) for at, trees in zip(placed, judge.links, strict=True) for t in trees]
        pairs = zip(judge.objects, in_the_way, strict=True)
        return {obstacle for body, obstacle in pairs if any(fcl.collide(link, body) for link in links)}

    def moved(T, way):
        there = T.copy()
        there[:3, 3] += way * T[:3, :3] @ hand.palm_normal
        return there

    for fallen, obstacle in ((came.stopped, False), (came.obstacle, True)):
        for T in fallen.T_object_palm:
            assert obstacle in touched(moved(T, OFF + 1e-4))
    for arm, T in zip(came.proposals.arm, came.proposals.T_object_palm, strict=True):
        into = T[:3, :3] @ hand.palm_normal
        start = next(p for p in asked.T_object_palm if np.allclose(p[:3, :3], T[:3, :3]))
        gone = float((T[:3, 3] - start[:3, 3]) @ into)
        most = DEEP if arms[arm].deep else 0.0
        assert -SHORT - 1e-9 <= gone <= most + 1e-9

        assert not any(touched(moved(T, -back)) for back in (0.0, 0.01, 0.05, 0.15))
        if gone < most - 1e-9:
            assert not touched(moved(T, OFF - 1e-9))
            assert touched(moved(T, OFF + 1e-4))
    return came


ARMS = (Arm(0, ("thumb",), False), Arm(0, ("thumb",), True))


@pytest.mark.parametrize("with_table", [False, True])
@pytest.mark.parametrize("model", ["cylinder:r=0.03,h=0.12", "mug"])
def test_no_hand_overlaps_on_its_way_and_each_goes_as_far_as_it_may(model, with_table):
    hand, obj = clench.Hand.load("robonaut2"), clench.GraspObject.load(model)
    if with_table:
        obj = obj.with_body(table(-0.06 if model != "mug" else 0.0))
    came = check(hand, obj, ARMS, draws(60 if not with_table else 120))
    assert len(came.proposals) > 5
    assert len(came.stopped) > 5
    assert (len(came.obstacle) > 5) == with_table


@pytest.mark.shared
@pytest.mark.parametrize(("name", "source"), [("Allegro", "engine"), ("LEAP", "engine"), ("LEAP", "raw")])
@pytest.mark.parametrize("made_of", ["mug", "scan"])
def test_hands_of_meshes_stop_where_their_links_touch(shared_data, name, source, made_of):
    """LEAP's own meshes are concave in part: their triangles tell where they stop."""
    hand = clench.Hand.load(shared_data / HANDS[name], collision_source=source)
    assert (link_bodies(hand, hand.default_source).hulls.convex.min() == 0) == (source == "raw")
    obj = clench.GraspObject.load("mug" if made_of == "mug" else shared_data / "objects/ycb_mug/textured.obj")
    came = check(hand, obj, ARMS, draws(60))
    assert len(came.proposals) > 5


def test_what_a_post_passes_between_does_not_stop_at_it():
    """The palm is one mesh of two boxes, or of three with a notch between them, and the post goes in between."""
    import trimesh

    pair = [trimesh.creation.box((0.02, 0.02, 0.02)).apply_translation((x, 0.0, 0.0)) for x in (-0.05, 0.05)]
    across = trimesh.creation.box((0.12, 0.02, 0.02)).apply_translation((0.0, 0.0, -0.02))
    post = clench.GraspObject.load("box:x=0.01,y=0.01,z=0.1")
    for parts, stop in ((pair, -0.03), ([*pair, across], -0.05 + 0.01 - OFF)):
        mesh = trimesh.util.concatenate(parts)
        shape = Shape(ShapeKind.MESH, mesh=TriangleMesh(np.asarray(mesh.vertices), np.asarray(mesh.faces)))
        chain = HandBuilder().finger("a", [along_x(0.006, 0.04)], [0.04], base=mount((0.5, 0.0, 0.0))).hand()
        shapes = [(shape,), *(link.shapes[CollisionSource.ENGINE] for link in chain.links[1:])]
        links = [replace(x, shapes={CollisionSource.RAW: s}) for x, s in zip(chain.links, shapes, strict=True)]
        hand = replace(chain, links=tuple(links), default_source=CollisionSource.RAW)
        T = np.eye(4)[None].copy()
        T[0, 2, 3] = -0.03
        asked = Proposals(np.zeros(1, dtype=int), T, np.zeros((1, 3)))
        came = Approach(hand, hand.open_angles()[None], pack_object(post)).bring_up(asked, ARMS[:1], 1)
        assert len(came.proposals) == 1
        assert came.proposals.T_object_palm[0, 2, 3] == pytest.approx(stop, abs=2e-6)


def test_a_hand_without_shapes_is_not_stopped():
    hand = clench.Hand.load("robonaut2")
    bare = replace(hand, links=tuple(replace(link, shapes={}) for link in hand.links))
    packed = pack_object(clench.GraspObject.load("mug"))
    came = Approach(bare, bare.open_angles()[None], packed).bring_up(draws(6), ARMS, 1)
    assert len(came.proposals) == 6


def test_frames_and_turns_are_rotations_with_the_given_axes():
    rng = np.random.default_rng(1)
    axes = np.vstack([np.eye(3), -np.eye(3), rng.normal(size=(20, 3))])
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    made = frames(axes)
    np.testing.assert_allclose(made[:, :, 0], axes, atol=1e-12)
    np.testing.assert_allclose(made @ made.transpose(0, 2, 1), np.broadcast_to(np.eye(3), made.shape), atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(made), 1.0)
    angles = rng.uniform(-4.0, 4.0, len(axes))
    turned = turns_about(axes, angles)
    np.testing.assert_allclose(np.einsum("nij,nj->ni", turned, axes), axes, atol=1e-12)
    np.testing.assert_allclose(np.trace(turned, axis1=1, axis2=2), 1.0 + 2.0 * np.cos(angles), atol=1e-12)


def test_variations_turn_about_the_point_and_shift_by_what_is_asked():
    rng = np.random.default_rng(2)
    T = np.repeat(np.eye(4)[None], 4000, axis=0)
    point = np.broadcast_to([0.1, 0.0, 0.05], (4000, 3))
    still = vary(rng, T, point, 0.3, 0.0)
    moved = np.einsum("nij,nj->ni", still[:, :3, :3], point) + still[:, :3, 3]
    np.testing.assert_allclose(moved, point, atol=1e-12)
    shifted = vary(rng, T, point, 0.0, 0.01)
    assert np.std(shifted[:, :3, 3]) == pytest.approx(0.01, rel=0.05)
    np.testing.assert_allclose(shifted[:, :3, :3], T[:, :3, :3])
