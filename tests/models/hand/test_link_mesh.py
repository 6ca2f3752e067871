"""What is made of a hand or an object once: it lives as long as they do, and copies start without it."""

import copy
import dataclasses
import gc
import pickle
import threading
import weakref

import pytest

import clench
from clench.models.hand.link_mesh import link_meshes
from clench.models.objects.mass import mass_properties
from models.small_hand import small_hand


class Made:
    """Something that can be watched."""


def test_it_is_made_once_per_key():
    hand = small_hand()
    found = hand.kept(("test", 1), Made)
    assert hand.kept(("test", 1), Made) is found
    assert hand.kept(("test", 2), Made) is not found
    assert small_hand().kept(("test", 1), Made) is not found


@pytest.mark.parametrize(
    "copied", [copy.copy, copy.deepcopy, dataclasses.replace, lambda hand: pickle.loads(pickle.dumps(hand))]
)
def test_a_copy_starts_without_it(copied):
    hand = small_hand()
    hand.kept(("test", 1), lambda: "before")
    assert copied(hand).kept(("test", 1), lambda: "anew") == "anew"


def test_it_goes_with_the_hand():
    hand = small_hand()
    made = weakref.ref(hand.kept(("test", 1), Made))
    assert made() is not None
    del hand
    gc.collect()
    assert made() is None


def test_pickles_of_a_hand_do_not_grow_with_what_was_made_of_it():
    hand = clench.Hand.load("robonaut2")
    before = pickle.dumps(hand)
    assert link_meshes(hand) is link_meshes(hand)
    assert hand.allowed_pairs_for(hand.default_source) is hand.allowed_pairs_for(hand.default_source)
    assert len(pickle.dumps(hand)) == len(before)


def test_an_object_at_other_poses_has_the_same_mass_properties_until_its_bodies_go():
    mug = clench.GraspObject.load("mug")
    found = mass_properties(mug)
    moved = mug.posed(clench.Pose([1.0, 0.0, 0.0])).with_body(clench.GraspObject.load("ball").bodies[0])
    assert mass_properties(mug.posed(clench.Pose([1.0, 0.0, 0.0]))) is found
    assert mass_properties(moved) is not found
    assert mass_properties(mug) is found
    assert len(pickle.dumps(mug)) == len(pickle.dumps(clench.GraspObject.load("mug")))
    kept = weakref.ref(found)
    del mug, moved, found
    gc.collect()
    assert kept() is None


def test_threads_that_make_the_same_get_the_same():
    hand, together, found = small_hand(), threading.Barrier(4), []

    def make() -> Made:
        together.wait()
        return Made()

    threads = [threading.Thread(target=lambda: found.append(hand.kept(("test", 1), make))) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all(each is found[0] for each in found)
