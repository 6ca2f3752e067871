"""All candidates of all fingers in one call: what they are, arenas that grow, and independence of each other."""

import threading
from dataclasses import replace

import numpy as np
import pytest

from clench.closing.collision.packed_object import pack_object
from clench.closing.finger_plan import plan_finger
from clench.closing.hand_plan import make_hand_plan
from clench.closing.kernel_run import close_candidates, row_of
from clench.closing.packed_problem import capacity_of, pack_problem
from clench.core.pose import Pose
from clench.core.threads import kernel_threads, share_out
from clench.kernels.closing.start_overlap import CROSSED, FREE
from clench.models.objects.grasp_object import GraspObject
from clench.models.shapes import CollisionSource
from small_chain import CLOSING, POSTURE, chain


def planned(hand, count=3, q=None, fingers=None, full_width=True):
    """Return the plan of some fingers of a hand, without sweeps of their width."""
    posture = np.zeros(len(hand.joints)) if q is None else np.array(q)
    some = [hand.fingers[k] for k in (range(len(hand.fingers)) if fingers is None else fingers)]
    finger_postures = [(plan_finger(hand, f, posture, count, CollisionSource.ENGINE), k, 0) for k, f in enumerate(some)]
    plan = make_hand_plan(hand, posture, CollisionSource.ENGINE, finger_postures, full_width=full_width)
    return replace(
        plan, full_width_arrays=plan.full_width_arrays._replace(requested=np.zeros(len(plan.is_full_width), np.int64))
    )


def close(plan, obj):
    """Return the closed candidates of a plan."""
    problem = pack_problem(plan, pack_object(obj), (), False)
    return row_of(close_candidates(problem, obj.pose.matrix[:3]).free, 0)


BALL = GraspObject.load("sphere:r=0.02", pose=Pose([0.04, 0.001, 0.04]))


def test_one_candidate_per_plane_and_one_for_the_full_width():
    hand = chain([CLOSING, CLOSING], names=("a", "b"))
    plan = planned(hand)
    assert plan.candidates.finger_posture.tolist() == [0] * 4 + [1] * 4
    assert plan.is_full_width == (False, False, False, True) * 2
    assert (plan.candidates.high - plan.candidates.low).tolist() == [1, 1, 1, 0] * 2
    assert not any(planned(hand, full_width=False).is_full_width)


def test_fingers_close_as_they_would_alone():
    hand = chain([CLOSING, CLOSING], names=("a", "b"), upper=2.5)
    both, alone = close(planned(hand), BALL), close(planned(hand, fingers=[1]), BALL)
    np.testing.assert_array_equal(both.travel[4:, 2:], alone.travel)
    assert (both.travel > 0.0).any()


def test_each_plane_closes_as_it_would_alone():
    hand = chain([CLOSING, CLOSING], upper=2.5)
    closed, single = close(planned(hand), BALL), close(planned(hand, full_width=False), BALL)
    np.testing.assert_array_equal(single.travel, closed.travel[:3])
    assert (single.travel > 0.0).any()


@pytest.mark.parametrize("roles", [[CLOSING, CLOSING], [CLOSING, POSTURE, CLOSING]])
def test_a_section_that_outgrows_its_arena_is_cut_anew(roles):
    """With room for one segment per plane, the answer is the same as with plenty, which the next solve has at once."""
    import trimesh

    hand = chain(roles, upper=2.5)
    mesh = trimesh.creation.icosphere(subdivisions=4, radius=0.02)
    obj = GraspObject.from_meshes([(mesh.vertices, mesh.faces)], pose=Pose([0.04, 0.001, 0.04]))
    plan = planned(hand, q=[0.0, 0.3, 0.0][: len(roles)] if len(roles) == 3 else None)
    capacity = capacity_of(pack_object(obj))
    capacity.segments = 1
    tight = close(plan, obj)
    assert capacity.segments > 1
    capacity.segments = 4096
    plenty = close(plan, obj)
    assert capacity.segments == 4096
    np.testing.assert_array_equal(tight.travel, plenty.travel)
    np.testing.assert_array_equal(tight.point, plenty.point)
    assert plenty.contacts.sum() > 4


def test_overlap_at_the_start_is_noted_on_planes_for_the_finger_it_concerns():
    plan = planned(chain([CLOSING], names=("a", "b")), full_width=False)
    packed = pack_object(BALL)
    problem = pack_problem(plan, packed, (), False)
    free = close_candidates(problem, BALL.pose.matrix[:3])
    assert free.blocked.tolist() == [[FREE, FREE]]
    inside = close_candidates(problem, Pose([0.02, 0.0, 0.02]).matrix[:3])
    assert inside.blocked.tolist() == [[CROSSED + 1, CROSSED + 2]]
    assert not inside.free.travel.any()


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
