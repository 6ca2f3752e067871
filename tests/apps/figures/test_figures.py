"""Pictures: what they show agrees with the solution, and every kind of answer can be drawn."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import clench
from clench.apps.figures import draw_solution
from clench.apps.figures.planes.candidate_grid import MOST_CANDIDATES, _selected, _short, _verdict
from clench.apps.figures.planes.curl_plane import plane_title
from clench.apps.figures.planes.finger_scenes import FingerScenes
from clench.apps.figures.planes.plane_scene import PlaneScene, bounds
from clench.core.exceptions import FileError
from clench.models.command import GraspCommand
from clench.models.objects.obstacles import table
from clench.solver.solution import FingerStatus, GraspSolution
from handmade import make_candidate, make_contact


def grasp(hand: clench.Hand, obj: clench.GraspObject, **options: object) -> tuple[GraspCommand, GraspSolution]:
    """Return a command and its solution that touches with at least one finger."""
    for pose in clench.approach_poses(hand, obj, 8, 0):
        command = GraspCommand(hand_pose=pose, **{"preshape": "open", **options})  # type: ignore[arg-type]
        solution = clench.solve(hand, obj, command)
        if solution.contacts:
            return command, solution
    raise AssertionError("no approach pose gives a contact")


@pytest.fixture(scope="module")
def hand() -> clench.Hand:
    return clench.Hand.load("robonaut2")


@pytest.fixture(scope="module")
def ball() -> clench.GraspObject:
    return clench.GraspObject.load("ball")


@pytest.fixture(scope="module")
def answer(hand: clench.Hand, ball: clench.GraspObject) -> tuple[GraspCommand, GraspSolution]:
    return grasp(hand, ball, planes=3, fingers=("index", "thumb"))


def distance(point: np.ndarray, loop: np.ndarray) -> float:
    """Return the distance from a point to a closed polygon's border [m]."""
    a, b = loop, np.roll(loop, -1, axis=0)
    along = b - a
    s = np.clip(((point - a) * along).sum(axis=1) / np.maximum((along**2).sum(axis=1), 1e-30), 0.0, 1.0)
    return float(np.linalg.norm(a + s[:, None] * along - point, axis=1).min())


def check_contacts(hand: clench.Hand, obj: clench.GraspObject, command: GraspCommand, solution: GraspSolution) -> int:
    """Assert that every drawn contact lies on the drawn link and on the drawn section. Return how many."""
    checked = 0
    for name, result in solution.fingers.items():
        scenes = FingerScenes(hand, obj, command, solution, name, result.candidates[result.chosen])
        for candidate in result.candidates:
            shown = scenes.showing(candidate)
            for axis_group, plane in shown.touched_planes(99):
                scene = shown.scene(axis_group, plane)
                for c in scene.contacts:
                    later = candidate.contacts[candidate.contacts.index(c.contact) + 1 :]
                    if c.contact.passed or c.contact.link in {other.link for other in later}:
                        continue  # a later joint carried the link on
                    links = [loop for s in scene.closed_links if s.name == c.contact.link for loop in s.loops]
                    assert min(distance(c.point, loop.points) for loop in links) < 5e-5, (name, candidate.plane)
                    section = [curve.loop.points for curve in scene.section]
                    assert min(distance(c.point, points) for points in section) < 5e-5, (name, candidate.plane)
                    checked += 1
    return checked


def size_of(path: Path) -> tuple[int, int]:
    from PIL import Image

    with Image.open(path) as image:
        assert image.format == "PNG"
        pixels = np.asarray(image.convert("RGB"))
    assert (pixels != pixels[0, 0]).any(axis=2).mean() > 0.02, f"{path.name} is nearly blank"
    return pixels.shape[1], pixels.shape[0]


def test_a_solve_gives_two_pictures_per_finger_and_one_of_the_hand(
    hand: clench.Hand, ball: clench.GraspObject, answer: tuple[GraspCommand, GraspSolution], tmp_path: Path
) -> None:
    files = draw_solution(hand, ball, *answer, tmp_path)
    names = ["index_plane.png", "index_candidates.png", "thumb_plane.png", "thumb_candidates.png", "grasp.png"]
    assert [f.name for f in files] == names
    assert sorted(p.name for p in tmp_path.iterdir()) == sorted(names)
    for file in files:
        width, height = size_of(file)
        assert 600 <= width <= 1600
        assert 400 <= height <= 1300


def test_pictures_repeat_to_the_bit(
    hand: clench.Hand, ball: clench.GraspObject, answer: tuple[GraspCommand, GraspSolution], tmp_path: Path
) -> None:
    command, solution = answer
    index = solution.fingers["index"]
    few = replace(index, candidates=(index.candidates[index.chosen], *index.candidates[:1]), chosen=0)
    one = replace(solution, fingers={"index": few})
    first = [f.read_bytes() for f in draw_solution(hand, ball, command, one, tmp_path)]
    second = [f.read_bytes() for f in draw_solution(hand, ball, command, one, tmp_path)]
    assert first == second


def test_drawn_contacts_lie_on_drawn_link_and_section(
    hand: clench.Hand, ball: clench.GraspObject, answer: tuple[GraspCommand, GraspSolution]
) -> None:
    assert check_contacts(hand, ball, *answer) >= 4


def test_alternative_postures_are_drawn_where_they_were_solved(hand: clench.Hand, ball: clench.GraspObject) -> None:
    command, solution = grasp(hand, ball, planes=2, fingers=("index",), yaw_grid=(0.1,), open_variants=(0.2,))
    result = solution.fingers["index"]
    looked_at = 0
    for k, candidate in enumerate(result.candidates):
        if candidate.posture and candidate.contacts:
            other = replace(solution, fingers={"index": replace(result, candidates=(candidate,), chosen=0)})
            looked_at += check_contacts(hand, ball, command, other)
            assert k
    assert looked_at >= 2


def test_joint_motion_agrees_with_the_solution(
    hand: clench.Hand, ball: clench.GraspObject, answer: tuple[GraspCommand, GraspSolution]
) -> None:
    command, solution = answer
    result = solution.fingers["index"]
    scenes = FingerScenes(hand, ball, command, solution, "index", result.candidates[result.chosen])
    joints = scenes.scene(0, 0).joints
    assert [j.name for j in joints] == ["index_proximal", "index_medial", "index_distal"]
    for joint in joints:
        model = hand.joints[hand.joint_index(joint.name)]
        assert joint.angle == pytest.approx(solution.joint_angles[joint.name], abs=1e-12)
        assert abs(joint.turn) == pytest.approx(abs(joint.angle - joint.open_angle), abs=1e-12)
        assert joint.limit == pytest.approx(model.upper, abs=1e-9)
        assert 0.0 <= joint.turn <= joint.full_turn + 1e-12
    for before, after in pairwise(joints):
        np.testing.assert_allclose(before.pivot + before.arm, after.pivot, atol=1e-12)


def test_drawn_pivots_agree_with_the_hands_own_kinematics(
    hand: clench.Hand, ball: clench.GraspObject, answer: tuple[GraspCommand, GraspSolution]
) -> None:
    command, solution = answer
    q = np.array([solution.joint_angles[n] for n in hand.joint_names])
    poses = solution.hand_pose.matrix @ hand.link_poses(q)
    for name, result in solution.fingers.items():
        scenes = FingerScenes(hand, ball, command, solution, name, result.candidates[result.chosen])
        T = solution.hand_pose.matrix @ scenes.frames[0]
        for joint in scenes.scene(0, 0).joints:
            index = hand.joint_index(joint.name)
            link = next(i for i, link in enumerate(hand.links) if link.joint == index)
            anchor = (poses[link] @ np.append(hand.joints[index].anchor, 1.0))[:3]
            local = T[:3, :3].T @ (anchor - T[:3, 3])
            np.testing.assert_allclose(local[[0, 2]], joint.pivot, atol=1e-9)


def between_planes(scenes: FingerScenes) -> list[PlaneScene]:
    """Return what the planes show that go through contacts off the finger's own planes."""
    own = [len(f.offsets) for f in scenes.plan.axis_groups]
    return [scenes.scene(f, k) for f, k in scenes.touched_planes(99) if k >= own[f]]


def test_a_contact_between_the_planes_has_a_plane_of_its_own(
    hand: clench.Hand, ball: clench.GraspObject, answer: tuple[GraspCommand, GraspSolution]
) -> None:
    command, solution = answer
    result = solution.fingers["index"]
    candidate = next(c for c in result.candidates if c.plane is None)
    off = [c.offset for c in candidate.contacts if c.plane is None]
    assert off, "this grasp touches between the planes"
    scenes = FingerScenes(hand, ball, command, solution, "index", candidate)
    scenes_between = between_planes(scenes)
    assert sorted(c.contact.offset for s in scenes_between for c in s.contacts) == pytest.approx(sorted(off), abs=1e-9)
    for scene in scenes_between:
        assert scene.offset == pytest.approx(scene.contacts[0].contact.offset, abs=2e-6)
        assert plane_title(scene, 1) == f"between the planes, y = {scene.offset * 1e3:+.1f} mm"
        assert [link.name for link in scene.open_links] == [link.name for link in scene.closed_links]
    alone = next(c for c in result.candidates if c.plane is not None)
    assert not between_planes(scenes.showing(alone)), "planes through the contacts of one set are not those of another"
    assert plane_title(scenes.showing(alone).scene(0, 1), 1).startswith("plane 1 of 0 to ")


def test_contacts_share_a_plane_where_nobody_sees_the_difference(
    hand: clench.Hand, ball: clench.GraspObject, answer: tuple[GraspCommand, GraspSolution]
) -> None:
    command, solution = answer
    result = solution.fingers["index"]
    candidate = next(c for c in result.candidates if c.plane is None)
    contact = next(c for c in candidate.contacts if c.plane is None)
    scenes = FingerScenes(hand, ball, command, solution, "index", candidate)
    y = (solution.hand_pose.matrix @ scenes.frames[0])[:3, 1]
    for step, count in ((1e-6, 1), (1e-5, 1), (1e-3, 2)):
        beside = replace(contact, position=contact.position + step * y)
        shown = scenes.showing(replace(candidate, contacts=(contact, beside)))
        assert len(between_planes(shown)) == count, step


def test_a_contact_on_a_flat_side_in_the_plane_is_drawn_on_the_section(
    hand: clench.Hand, ball: clench.GraspObject, answer: tuple[GraspCommand, GraspSolution]
) -> None:
    command, solution = answer
    candidate = next(c for c in solution.fingers["index"].candidates if c.plane is None)
    contact = next(c for c in candidate.contacts if c.plane is None)
    scenes = FingerScenes(hand, ball, command, solution, "index", candidate)
    axis_group = solution.hand_pose.matrix @ scenes.frames[0]
    for side in (1.0, -1.0):
        # A block of which the contact is on an edge: one of its sides lies in the plane, up to the contact's gap.
        T = axis_group.copy()
        T[:3, 3] = contact.position - (0.01 + 1e-9) * side * axis_group[:3, 1] - 0.01 * axis_group[:3, 2]
        block = clench.GraspObject.load("box:x=0.02,y=0.02,z=0.02")
        moved = replace(solution, object_pose=clench.Pose.from_matrix(T))
        (scene,) = between_planes(
            FingerScenes(hand, block, command, moved, "index", replace(candidate, contacts=(contact,)))
        )
        assert abs(scene.offset - contact.offset) < 2e-6
        assert min(distance(scene.contacts[0].point, curve.loop.points) for curve in scene.section) < 5e-5


@pytest.mark.shared
def test_a_finger_of_two_axis_groups_is_drawn_where_it_touches(shared_data: Path, tmp_path: Path) -> None:
    leap = clench.Hand.load(shared_data / "hands" / "leap_hand_urdf" / "leap_hand_right.urdf")
    can = clench.GraspObject.load("cylinder:r=0.03,h=0.1")
    command, solution = grasp(leap, can, planes=3, fingers=("index", "middle"))
    assert check_contacts(leap, can, command, solution) >= 2
    result = solution.fingers["index"]
    scenes = FingerScenes(leap, can, command, solution, "index", result.candidates[result.chosen])
    assert {axis_group for axis_group, _ in scenes.touched_planes(3)} == {0, 1}
    assert len(draw_solution(leap, can, command, solution, tmp_path)) == 5


def test_answers_without_contact_are_drawn(hand: clench.Hand, ball: clench.GraspObject, tmp_path: Path) -> None:
    far = GraspCommand(
        hand_pose=clench.Pose([1.0, 0.0, 0.0]), planes=1, fingers=("ring",), full_width=False, preshape="open"
    )
    solution = clench.solve(hand, ball, far)
    assert not solution.contacts
    files = draw_solution(hand, ball, far, solution, tmp_path)
    assert [f.name for f in files] == ["ring_plane.png", "ring_candidates.png", "grasp.png"]
    assert all(size_of(f)[0] <= 1600 for f in files)


def test_a_finger_that_overlaps_at_the_start_is_drawn(
    hand: clench.Hand, ball: clench.GraspObject, tmp_path: Path
) -> None:
    tip = hand.link_poses(hand.open_angles())[hand.link_index("index_distal")][:3, 3]
    inside = GraspCommand(hand_pose=clench.Pose(-tip), planes=2, fingers=("index",), preshape="open")
    solution = clench.solve(hand, ball, inside)
    assert solution.fingers["index"].status is FingerStatus.BLOCKED
    assert all(size_of(f)[0] <= 1600 for f in draw_solution(hand, ball, inside, solution, tmp_path))


def test_what_is_said_of_a_candidate_that_is_blocked() -> None:
    blocked = make_candidate(status=FingerStatus.BLOCKED, contacts=(), penetration=None)
    assert _verdict(blocked)[-1] == "blocked: it does not move"
    assert _verdict(make_candidate(status=FingerStatus.LIMIT, contacts=(), penetration=None))[-1] == "no contact"


def test_obstacles_are_told_from_the_object(hand: clench.Hand, tmp_path: Path) -> None:
    box = clench.GraspObject.load("box:x=0.04,y=0.06,z=0.08")
    scene = box.with_body(table(-0.04))
    command, solution = grasp(hand, scene, planes=1, fingers=("index",))
    result = solution.fingers["index"]
    scenes = FingerScenes(hand, scene, command, solution, "index", result.candidates[result.chosen])
    kinds = {c.obstacle for p in range(len(scenes.plan.axis_groups[0].offsets)) for c in scenes.scene(0, p).section}
    assert kinds == {True, False}
    low, high = bounds([scenes.scene(0, 0)])
    assert (high - low).max() < 0.5, "the table does not decide how much is shown"
    draw_solution(hand, scene, command, solution, tmp_path)


def test_a_finger_without_candidates_has_no_picture(
    hand: clench.Hand, ball: clench.GraspObject, answer: tuple[GraspCommand, GraspSolution], tmp_path: Path
) -> None:
    command, solution = answer
    idle = replace(solution.fingers["thumb"], candidates=(), chosen=0, status=FingerStatus.NO_MOTION)
    files = draw_solution(hand, ball, command, replace(solution, fingers={"thumb": idle}), tmp_path)
    assert [f.name for f in files] == ["grasp.png"]


def test_a_folder_that_is_missing_is_made(
    hand: clench.Hand, ball: clench.GraspObject, answer: tuple[GraspCommand, GraspSolution], tmp_path: Path
) -> None:
    command, solution = answer
    without = replace(solution, fingers={})
    files = clench.draw_solution(hand, ball, command, without, str(tmp_path / "new" / "deep"))
    assert files == [tmp_path / "new" / "deep" / "grasp.png"]
    assert files[0].is_file()
    with pytest.raises(FileError, match=r"grasp\.png: cannot be made a folder"):
        draw_solution(hand, ball, command, without, files[0])


def test_drawing_leaves_global_state_alone(
    hand: clench.Hand, ball: clench.GraspObject, answer: tuple[GraspCommand, GraspSolution], tmp_path: Path
) -> None:
    import matplotlib as mpl

    before = (mpl.rcParams.copy(), mpl.get_backend(auto_select=False))
    command, solution = answer
    draw_solution(hand, ball, command, replace(solution, fingers={}), tmp_path)
    assert (mpl.rcParams.copy(), mpl.get_backend(auto_select=False)) == before


def test_many_candidates_are_thinned_evenly_and_keep_the_chosen_one() -> None:
    alike = [make_candidate(plane=k, offset=0.001 * k) for k in range(30)] + [make_candidate()]
    for chosen in (alike[0], alike[17], alike[-1]):
        shown = _selected(alike, chosen)
        assert len(shown) == MOST_CANDIDATES
        assert chosen in shown
        assert alike[-1] in shown
        offsets = [c.offset for c in shown if c.offset is not None]
        assert offsets == sorted(offsets)
        assert min(offsets) == 0.0
        assert max(offsets) == pytest.approx(0.029)
        assert np.diff(offsets).max() < 0.012
    assert _selected(alike[:2], alike[0]) == alike[:2]


@pytest.mark.parametrize(
    ("names", "expected"),
    [
        (["index_proximal", "index_medial"], ["proximal", "medial"]),
        (["ff_j_1", "ff_j_2"], ["1", "2"]),
        (["a", "b"], ["a", "b"]),
        (["index_curl"], ["index_curl"]),
        (["curl", "curl_tip"], ["curl", "curl_tip"]),
        (["same", "same"], ["same", "same"]),
    ],
)
def test_shared_words_are_left_out_of_joint_names(names: list[str], expected: list[str]) -> None:
    assert _short(names) == expected


def test_a_contact_keeps_the_number_it_has_in_the_solution(
    hand: clench.Hand, ball: clench.GraspObject, answer: tuple[GraspCommand, GraspSolution]
) -> None:
    command, solution = answer
    before = make_contact(finger="thumb", link="thumb_distal", stops_joint=None)
    listed = replace(solution, contacts=(before, *solution.contacts))
    name = solution.contacts[0].finger
    result = solution.fingers[name]
    scenes = FingerScenes(hand, ball, command, listed, name, result.candidates[result.chosen])
    assert [listed.contacts[c.number] for c in scenes.contacts] == [c.contact for c in scenes.contacts]
    assert scenes.contacts[0].number == 1
