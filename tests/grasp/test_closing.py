"""All candidates of all fingers in one call: items, arenas that grow, and independence of each other."""

import threading

import numpy as np
import pytest
from small_chain import CLOSING, POSTURE, chain

from clench.base.pose import Pose
from clench.grasp import closing
from clench.grasp.closing import close_hand, items_around, kernel_threads, make_hand_plan, planes_tell, share_out
from clench.grasp.plan import plan_finger
from clench.grasp.scene import pack_object
from clench.kernels.exact import planes_only
from clench.models.objects.grasp_object import GraspObject
from clench.models.shapes import CollisionSource


def plans(hand, count=3, q=None):
    posture = np.zeros(len(hand.joints)) if q is None else np.array(q)
    return [plan_finger(hand, f, posture, count, CollisionSource.ENGINE) for f in hand.fingers]


def close(found, obj, full_width=True, rounds=1):
    plan = make_hand_plan(found, range(len(found)), [0] * len(found), full_width, False)
    exact = planes_only(len(plan.whole), len(found))
    return plan, close_hand(plan, exact, pack_object(obj), obj.pose.matrix, rounds)


BALL = GraspObject.load("sphere:r=0.02", pose=Pose([0.04, 0.001, 0.04]))


def test_one_item_per_plane_and_one_for_the_full_width():
    found = plans(chain([CLOSING, CLOSING], names=("a", "b")))
    plan, _ = close(found, BALL)
    assert plan.items.entry.tolist() == [0] * 4 + [1] * 4
    assert plan.whole == (False, False, False, True) * 2
    assert plan.items.high.tolist() == [1, 2, 3, 3] * 2
    plan, _ = close(found, BALL, full_width=False)
    assert not any(plan.whole)


def test_fingers_close_as_they_would_alone():
    hand = chain([CLOSING, CLOSING], names=("a", "b"), upper=2.5)
    found = plans(hand)
    _, together = close(found, BALL)
    _, alone = close(found[1:], BALL)
    np.testing.assert_array_equal(together.answer.travel[4:, 2:], alone.answer.travel)
    assert (together.answer.travel > 0.0).any()


def test_each_plane_closes_as_it_would_alone():
    hand = chain([CLOSING, CLOSING], upper=2.5)
    (three,) = plans(hand)
    _, closed = close([three], BALL)
    for k, offset in enumerate(three.families[0].offsets):
        _, single = close([three], BALL, full_width=False)
        np.testing.assert_array_equal(single.answer.travel[k], closed.answer.travel[k], err_msg=f"{offset}")


@pytest.mark.parametrize("roles", [[CLOSING, CLOSING], [CLOSING, POSTURE, CLOSING]])
def test_a_section_that_outgrows_its_arena_is_cut_anew(roles):
    """With room for one segment per plane, the answer is the same as with plenty, which the next solve has at once."""
    import trimesh

    hand = chain(roles, upper=2.5)
    mesh = trimesh.creation.icosphere(subdivisions=4, radius=0.02)
    obj = GraspObject.from_meshes([(mesh.vertices, mesh.faces)], pose=Pose([0.04, 0.001, 0.04]))
    found = plans(hand, q=[0.0, 0.3, 0.0][: len(roles)] if len(roles) == 3 else None)
    arena = closing.arena_of(pack_object(obj).tree)
    arena.capacity = 1
    _, tight = close(found, obj)
    assert arena.capacity > 1
    arena.capacity = 4096
    _, plenty = close(found, obj)
    assert arena.capacity == 4096
    np.testing.assert_array_equal(tight.answer.travel, plenty.answer.travel)
    np.testing.assert_array_equal(tight.answer.point[..., :8], plenty.answer.point[..., :8])
    assert plenty.answer.contacts.sum() > 4


def test_overlap_at_the_start_is_noted_on_planes_for_the_finger_it_concerns():
    hand = chain([CLOSING], names=("a", "b"))
    _, closed = close(plans(hand), BALL, full_width=False)
    assert closed.overlaps.tolist() == [-1, -1]
    inside = BALL.posed(Pose([0.02, 0.0, 0.02]))
    plan, closed = close(plans(hand), inside, full_width=False)
    assert (closed.overlaps >= 0).all()
    assert plan.arrays.outlines.link[closed.overlaps].tolist() == [1, 2]


@pytest.mark.parametrize("model", ["sphere:r=0.02", "box:x=0.02,y=0.02,z=0.02", "cylinder:r=0.02,h=0.02"])
def test_the_full_width_has_planes_around_what_is_swept_as_a_polyhedron_alone(model):
    (three,) = plans(chain([CLOSING]))
    plan = make_hand_plan([three], [0], [0], True, False)
    curved = model.startswith("cylinder")
    packed = pack_object(GraspObject.load(model))
    items = items_around(plan, packed)
    assert (items.high - items.low).tolist() == [1, 1, 1, 3 if curved else 0]
    assert planes_tell(items, plan.whole) == curved
    alone = make_hand_plan([three], [0], [0], False, False)
    single = items_around(alone, packed)
    assert planes_tell(single, alone.whole)
    assert single.high.tolist() == [1, 2, 3]
    assert items_around(plan, None).high.tolist() == [1, 2, 3, 0]


@pytest.mark.parametrize("threads", [1, 2, 5])
@pytest.mark.parametrize("count", [0, 1, 7])
def test_every_part_is_done_once_whoever_does_it(threads, count):
    done = []
    share_out(done.append, range(count), threads)
    assert sorted(done) == list(range(count))


def test_threads_work_at_the_same_time():
    both = threading.Barrier(2, timeout=20.0)
    share_out(lambda part: both.wait(), range(2), 2)


def test_threads_that_have_not_begun_are_not_waited_for():
    free, begun = threading.Event(), threading.Event()
    busy = kernel_threads(1).submit(lambda: begun.set() or free.wait(20.0))
    assert begun.wait(20.0)
    done = []
    share_out(done.append, range(4), 2)
    assert done == [0, 1, 2, 3]
    assert not busy.done()
    free.set()
    assert busy.result()


@pytest.mark.parametrize("where", ["here", "there"])
def test_what_fails_is_told_and_the_rest_is_left(where):
    here, both, done = threading.get_ident(), threading.Barrier(2, timeout=20.0), []

    def work(part):
        if part < 2:
            both.wait()  # one part in either thread
            if (threading.get_ident() == here) == (where == "here"):
                raise ZeroDivisionError
        done.append(part)

    with pytest.raises(ZeroDivisionError):
        share_out(work, range(2), 2)
    assert len(done) == 1
