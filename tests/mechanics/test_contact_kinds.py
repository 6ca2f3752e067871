"""Kinds of grasps: every combination of touching links against the definition."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest

from chain_hands import HandBuilder, along_x, mount
from clench.mechanics.grasp.contact_kinds import KINDS, GraspKind, contact_kinds
from clench.models.hand.hand import Hand, Link


def five_fingers() -> Hand:
    """Return a palm with five fingers of two links; a pad is fixed to each tip, and a plate to the palm."""
    builder = HandBuilder(along_x(0.01, 0.1))
    for number in range(5):
        shapes = [along_x(0.007, 0.04), along_x(0.007, 0.03)]
        builder.finger(f"f{number}", shapes, [0.04, 0.03], base=mount((0.0, 0.03 * number, 0.0)))
    hand = builder.hand()
    links, fingers = list(hand.links), list(hand.fingers)
    for number, finger in enumerate(fingers):
        links.append(Link(f"f{number}_pad", finger.tip_link, -1, mount((0.02, 0.0, 0.0)), {}))
        fingers[number] = replace(finger, links=(*finger.links, len(links) - 1))
    links.append(Link("plate", 0, -1, mount(), {}))
    return replace(hand, links=tuple(links), fingers=tuple(fingers), fixed_links=(0, len(links) - 1))


HAND = five_fingers()


def named(code: int) -> GraspKind | None:
    return None if code < 0 else KINDS[code]


def kind_of(*names: str) -> GraspKind | None:
    links = np.array([HAND.link_index(name) for name in names], dtype=np.int64)
    return named(contact_kinds(HAND, np.array([0, len(links)]), links)[0])


@pytest.mark.parametrize(
    ("names", "kind"),
    [
        ((), None),
        (("palm",), None),
        (("palm", "plate"), None),
        (("f0_link_1",), None),
        (("f0_link_0", "f0_link_1"), None),
        (("f0_link_1", "palm"), "power"),
        (("f0_link_1", "plate"), "power"),
        (("f0_link_1", "f1_link_1"), "pinch"),
        (("f0_link_1", "f1_link_1", "f1_link_1"), "pinch"),
        (("f0_link_1", "f1_pad"), "pinch"),
        (("f0_pad", "f0_link_1", "f4_pad"), "pinch"),
        (("f0_link_1", "f1_link_0"), "power"),
        (("f0_link_1", "f1_link_1", "palm"), "power"),
        (("f0_link_1", "f1_link_1", "f2_link_1"), "tripod"),
        (("f0_link_1", "f1_link_1", "f2_link_1", "f2_link_0"), "power"),
        (("f0_link_1", "f1_link_1", "f2_link_1", "f3_link_1"), "precision"),
        (("f0_pad", "f1_pad", "f2_pad", "f3_pad", "f4_pad"), "precision"),
        (("f0_pad", "f1_pad", "f2_pad", "f3_pad", "f4_pad", "plate"), "power"),
    ],
)
def test_kind(names: tuple[str, ...], kind: str | None) -> None:
    assert kind_of(*names) == kind
    assert kind_of(*reversed(names)) == kind


def test_every_combination_of_links_of_three_fingers_and_the_palm() -> None:
    names = ["palm", *(f"f{n}_link_{k}" for n in range(3) for k in range(2))]
    combinations = [c for n in range(len(names) + 1) for c in itertools.combinations(names, n)]
    first = np.concatenate([[0], np.cumsum([len(c) for c in combinations])])
    links = np.array([HAND.link_index(name) for c in combinations for name in c], dtype=np.int64)
    for chosen, code in zip(combinations, contact_kinds(HAND, first, links), strict=True):
        surfaces = {name[:2] for name in chosen}
        if len(surfaces) < 2:
            expected = None
        elif any(not name.endswith("link_1") for name in chosen):
            expected = GraspKind.POWER
        else:
            expected = {2: GraspKind.PINCH, 3: GraspKind.TRIPOD}[len(surfaces)]
        assert named(code) is expected, chosen


def test_contacts_that_do_not_count_are_left_out() -> None:
    links = np.array([HAND.link_index(name) for name in ("f0_link_1", "f1_link_0", "f1_link_1", "f2_link_1")])
    first = np.array([0, 4, 4])
    counted = np.array([True, False, True, True])
    assert [named(code) for code in contact_kinds(HAND, first, links, counted)] == ["tripod", None]


def test_no_grasps_have_no_kinds() -> None:
    assert contact_kinds(HAND, np.zeros(1, dtype=np.int64), np.empty(0, dtype=np.int64)).shape == (0,)
