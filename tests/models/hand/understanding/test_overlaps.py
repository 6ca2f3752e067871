"""Links may overlap that always do, in the geometry in use; others are kept apart, or until they have come apart."""

from __future__ import annotations

import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from clench.closing.collision.self_check import check_hand
from clench.closing.link_bodies import hand_bodies
from clench.models.hand.hand import Hand
from clench.models.shapes import CollisionSource
from clench.models.tessellation import BOX_CORNERS, BOX_TRIANGLES
from models.hand.hand_models import PALM, finger, hand, written

ENGINE, RAW, VISUAL = CollisionSource.ENGINE, CollisionSource.RAW, CollisionSource.VISUAL
FAR = finger("far", (-0.3, 0.0, 0.05))


def names(read: Hand, pairs: tuple[tuple[int, int], ...]) -> set[frozenset[str]]:
    """Return the names of the pairs that `allowed_pairs` does not hold already."""
    return {frozenset((read.links[a].name, read.links[b].name)) for a, b in pairs if (a, b) not in read.allowed_pairs}


def pair(*links: str) -> set[frozenset[str]]:
    return {frozenset(links)}


def at(read: Hand, **angles: float) -> np.ndarray:
    q = read.open_angles()
    for name, angle in angles.items():
        q[read.joint_index(name)] = angle
    return q


def folded() -> str:
    """Return a finger whose second link lies in the palm when it is open, and leaves it when its first joint turns."""
    return finger("a", (0.0, 0.0, 0.06), (0.05, 0.03), limits=["0 1.5"] * 2).replace(
        '<body name="a_link1" pos="0 0 0.05">', '<body name="a_link1" pos="0 0 -0.03">'
    )


def test_fingers_that_overlap_at_zero_alone_are_kept_apart(tmp_path) -> None:
    fingers = [finger(n, (x, 0.0, 0.05)) for n, x in (("index", 0.02), ("middle", 0.027))]
    read = Hand.load(written(tmp_path, hand(*fingers)))
    always = pair("index_link0", "middle_link0")  # their roots never come apart
    assert names(read, read.allowed_pairs_for(ENGINE)) == always
    assert names(read, read.allowed_pairs_from(ENGINE, read.open_angles())) == always
    assert any(
        f.code == "self_collision_at_open" and set(f.links) == {"index_link1", "middle_link1"} for f in check_hand(read)
    )


def test_a_knuckle_that_always_overlaps_may(tmp_path) -> None:
    sunk = PALM + '<geom name="cheek" type="sphere" size="0.12" pos="0 0 0.1"/>'
    read = Hand.load(written(tmp_path, hand(finger("a"), FAR, palm=sunk)))
    assert names(read, read.allowed_pairs_for(ENGINE)) == pair("palm", "a_link1")
    found = [f for f in check_hand(read) if f.code == "overlap_allowed" and "a_link1" in f.links]
    assert found
    assert "every posture" in found[0].text


def test_a_link_that_overlaps_the_palm_when_open_is_exempt_only_while_it_does(tmp_path) -> None:
    read = Hand.load(written(tmp_path, hand(folded(), FAR)))
    assert names(read, read.allowed_pairs_for(ENGINE)) == set()
    assert names(read, read.allowed_pairs_from(ENGINE, at(read))) == pair("palm", "a_link1")
    turned = at(read, a_j0=1.5, a_j1=0.0)
    assert names(read, read.allowed_pairs_from(ENGINE, turned)) == set()
    links = read.link_index("palm"), read.link_index("a_link1")
    assert [hand_bodies(read, ENGINE, q).across[links] for q in (at(read), turned)] == [0, 1]
    (note,) = [f for f in check_hand(read) if "a_link1" in f.links and "palm" in f.links]
    assert (note.code, note.severity) == ("overlap_allowed", "note")
    assert "keeps them apart" in note.text


def test_jaws_that_meet_at_zero_are_kept_apart(tmp_path) -> None:
    jaws = [
        finger(n, (x, 0.0, 0.05), (0.08,), ["0 1 0"], [limit])
        for n, x, limit in (("left", -0.007, "-0.8 0"), ("right", 0.007, "0 0.8"))
    ]
    read = Hand.load(written(tmp_path, hand(*jaws)))
    assert names(read, read.allowed_pairs_from(ENGINE, read.open_angles())) == set()
    assert not [f for f in check_hand(read) if f.code in ("self_collision_at_open", "overlap_allowed")]


def forked_palm() -> tuple[str, str]:
    """Return the geom of a palm of two plates in one mesh, whose hull fills what is between, and its asset."""
    plates = np.vstack([BOX_CORNERS * (0.004, 0.02, 0.1) + (x, 0.0, 0.0) for x in (-0.03, 0.03)])
    faces = np.vstack([BOX_TRIANGLES, BOX_TRIANGLES + 8])
    numbers = ["  ".join(" ".join(f"{v:g}" for v in row) for row in rows) for rows in (plates, faces)]
    asset = f'<asset><mesh name="fork" vertex="{numbers[0]}" face="{numbers[1]}"/></asset>'
    return '<geom type="mesh" mesh="fork"/>', asset


def test_pairs_are_those_of_the_geometry_in_use(tmp_path) -> None:
    """Both links of the finger lie between the plates: the hull holds them, the plates do not touch them."""
    palm, asset = forked_palm()
    read = Hand.load(
        written(tmp_path, hand(finger("a", (0, 0, -0.05), limits=["0 0.3"] * 2), FAR, palm=palm, extra=asset))
    )
    assert names(read, read.allowed_pairs_for(ENGINE)) == pair("palm", "a_link1")
    for source in (RAW, VISUAL):
        assert names(read, read.allowed_pairs_for(source)) == set()
    links = read.link_index("palm"), read.link_index("a_link1")
    assert [hand_bodies(read, source).across[links] for source in (ENGINE, RAW)] == [0, 1]


def test_pairs_are_found_once_and_travel_with_the_hand(tmp_path) -> None:
    palm, asset = forked_palm()
    read = Hand.load(
        written(tmp_path, hand(finger("a", (0, 0, -0.05), limits=["0 0.3"] * 2), FAR, palm=palm, extra=asset))
    )
    found = read.allowed_pairs_for(ENGINE)
    assert read.allowed_pairs_for(ENGINE) is found
    assert pickle.loads(pickle.dumps(read)).allowed_pairs_for(ENGINE) == found
    assert replace(read, overlaps_allowed=False).allowed_pairs_for(ENGINE) == read.allowed_pairs


@pytest.mark.shared
@pytest.mark.parametrize(
    ("model", "counts"),
    [
        ("hands/wuji_hand/urdf/right.urdf", {ENGINE: 4, RAW: 0}),
        ("hands/shadow_hand_mjcf/right_hand.xml", {ENGINE: 0, RAW: 0}),
        ("hands_reference/robonaut2_left_urdf/r2_left_hand.urdf", {ENGINE: 1, RAW: 0}),
    ],
)
def test_hulls_of_real_hands_overlap_where_their_meshes_do_not(
    shared_data: Path, model: str, counts: dict[CollisionSource, int]
) -> None:
    read = Hand.load(shared_data / model)
    assert {source: len(names(read, read.allowed_pairs_for(source))) for source in counts} == counts


def excluded(*pairs: tuple[str, str]) -> str:
    listed = "".join(f'<exclude body1="{a}" body2="{b}"/>' for a, b in pairs)
    return f"<contact>{listed}</contact>"


TWO = [finger(n, (x, 0.0, 0.05)) for n, x in (("index", 0.03), ("thumb", -0.03))]


def test_excluded_pairs_of_two_fingers_are_counted_and_named(tmp_path) -> None:
    one = ("index_link1", "thumb_link1")
    same_finger, with_palm = ("index_link0", "index_link1"), ("palm", "thumb_link1")
    read = Hand.load(written(tmp_path, hand(*TWO, extra=excluded(one, same_finger, with_palm))))
    (found,) = [f for f in read.findings if f.code == "pairs_excluded"]
    assert found.severity == "warning"
    assert found.text == (
        "One pair of links of different fingers is never checked against each other, because the model excludes them: "
        "'index_link1' - 'thumb_link1'."
    )
    assert found.links == one
    every = [(f"index_link{i}", f"thumb_link{k}") for i in range(2) for k in range(2)]
    read = Hand.load(written(tmp_path, hand(*TWO, extra=excluded(*every))))
    (found,) = [f for f in read.findings if f.code == "pairs_excluded"]
    assert found.text.startswith("4 pairs of links of different fingers are never checked against each other, ")
    assert found.text.endswith(
        "'index_link0' - 'thumb_link0', 'index_link0' - 'thumb_link1', 'index_link1' - 'thumb_link0', …."
    )
    assert found.numbers == {"pairs": 4}


def test_pairs_of_two_fingers_excluded_by_masks_are_counted(tmp_path) -> None:
    apart = [
        text.replace("<geom ", f'<geom contype="{m}" conaffinity="{m}" ') for text, m in zip(TWO, (1, 2), strict=True)
    ]
    palm = PALM.replace("<geom ", '<geom contype="3" conaffinity="3" ')
    (found,) = [f for f in Hand.load(written(tmp_path, hand(*apart, palm=palm))).findings if f.code == "pairs_excluded"]
    assert found.numbers == {"pairs": 4}


def test_pairs_of_the_hand_file_are_not_the_models(tmp_path) -> None:
    model = written(tmp_path, hand(*TWO))
    model.with_suffix(".hand.toml").write_text('allowed_pairs = [["index_link1", "thumb_link1"]]')
    read = Hand.load(model)
    assert (read.link_index("index_link1"), read.link_index("thumb_link1")) in read.allowed_pairs
    assert not [f for f in read.findings if f.code == "pairs_excluded"]
