"""Parts of the page that need no browser: card, code, pulls, meshes, colours, views."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import clench
from clench.apps.viewer.opening import Given, open_session
from clench.apps.viewer.panels.plane_panel import plane_picture
from clench.apps.viewer.panels.status_card import answer_card, failed_card
from clench.apps.viewer.panels.weights_panel import comparison
from clench.apps.viewer.scene.camera_place import good_view
from clench.apps.viewer.scene.contact_marks import cone_lines
from clench.apps.viewer.scene.drawn_meshes import MOST_OF_BODY, drawn
from clench.apps.viewer.scene.film_strip import score_colors
from clench.apps.viewer.scene.finger_pull import find_pull
from clench.apps.viewer.session.quick_answer import QuickAnswer
from clench.apps.viewer.session.scene_code import scene_code
from clench.apps.viewer.session.settled_answer import SettledAnswer

#: A grasp of the built-in hand on the mug.
GOOD_POSE = clench.Pose([-0.05, -0.1, 0.06], wxyz=[0.5, 0.5, 0.5, 0.5])


@pytest.fixture(scope="module")
def settled() -> SettledAnswer:
    hand, mug = clench.Hand.load("robonaut2"), clench.GraspObject.load("mug")
    session = open_session(Given(hand, mug, clench.GraspCommand(GOOD_POSE), {}, 1.0, 0.1, {}))
    session.begin()
    assert session.wait()
    session.close()
    assert session.settled is not None
    return session.settled


def test_the_card_shows_the_bound_while_moving_and_the_exact_margin_at_rest(settled: SettledAnswer) -> None:
    moving, rest = answer_card(settled.quick, None), answer_card(settled.quick, settled, "A note & more.")
    assert f"≥ {settled.quick.bound:.3f}" in moving
    assert 'data-clench="moving"' in moving
    assert f">{settled.quality.epsilon.radius:.3f}<" in rest
    assert settled.solution.reason["text"] in rest
    assert "A note &amp; more." in rest


def test_words_from_files_cannot_be_code_of_the_page() -> None:
    assert "<script>" not in failed_card("no joint '<script>alert(1)</script>'")


def test_the_code_of_a_scene_solves_to_the_same_answer(settled: SettledAnswer) -> None:
    state = replace(settled.quick.state, friction=0.8)
    state = state.with_order(clench.ClosingOrder.TOGETHER).with_source(clench.CollisionSource.RAW)
    state = state.with_weights({"range_of_motion": 1.0})
    code = scene_code(state, "clench.Hand.load('robonaut2')", ("obj = clench.GraspObject.load('mug')",))
    space: dict[str, object] = {}
    exec(code, space)
    assert space["command"] == state.command
    assert (
        space["solution"].joint_angles
        == clench.solve(settled.quick.hand, settled.quick.obj, state.command).joint_angles
    )


def test_a_pull_turns_the_posture_joint_that_follows_it(settled: SettledAnswer) -> None:
    quick = settled.quick
    hand, palm = quick.hand, quick.state.command.hand_pose
    index = hand.finger("index")
    poses = palm.matrix @ hand.link_poses(quick.joint_angles)
    point = poses[index.tip_link][:3, 3]
    yaw = hand.joint_index("index_yaw")
    moved = quick.joint_angles.copy()
    moved[yaw] += 1e-4
    way = (palm.matrix @ hand.link_poses(moved))[index.tip_link][:3, 3] - point
    pull = find_pull(hand, quick.joint_angles, palm, index.tip_link, point, 100.0 * way)
    assert pull is not None
    assert pull.joint == yaw
    assert pull.angle(100.0 * way) == pytest.approx(1e-2, rel=1e-2)
    assert find_pull(hand, quick.joint_angles, palm, hand.palm, point, way) is None


def test_a_mesh_of_very_many_triangles_is_drawn_coarser_and_solved_as_it_is(tmp_path: Path) -> None:
    import trimesh

    fine = trimesh.creation.uv_sphere(radius=0.04, count=[250, 250])
    assert len(fine.faces) > 2 * MOST_OF_BODY
    fine.export(tmp_path / "fine.ply")
    ball = clench.GraspObject.load(tmp_path / "fine.ply")
    mesh = drawn(ball.bodies[0].shapes, MOST_OF_BODY)
    assert 1000 < len(mesh.triangles) <= MOST_OF_BODY
    assert np.linalg.norm(mesh.vertices, axis=1).min() > 0.039
    session = open_session(
        Given(clench.Hand.load("robonaut2"), ball, clench.GraspCommand(GOOD_POSE), {}, None, 0.1, {})
    )
    session.begin()
    assert session.wait(120.0)
    session.close()
    answer = session.answer
    assert answer is not None
    assert answer.obj is ball
    np.testing.assert_allclose(np.linalg.norm(answer.positions, axis=1), 0.04, atol=1e-5)


def test_cones_open_into_the_object_with_the_angle_of_friction() -> None:
    lines = cone_lines(np.zeros((1, 3)), np.array([[0.0, 0.0, 1.0]]), np.array([0.5]))
    rims = lines[:8, 1]
    assert (rims[:, 2] < 0.0).all()
    np.testing.assert_allclose(np.linalg.norm(rims[:, :2], axis=1) / -rims[:, 2], 0.5)


def test_colours_of_scores_rise_in_lightness() -> None:
    colors = score_colors(np.array([0.0, 0.1, 0.2, np.nan]))
    lightness = colors @ [0.2126, 0.7152, 0.0722]
    assert lightness[0] < lightness[1] < lightness[2]
    assert np.isfinite(colors).all()


def test_the_camera_sees_hand_and_object_from_the_side(settled: SettledAnswer) -> None:
    quick: QuickAnswer = settled.quick
    target, place = good_view(quick, clench.Pose.identity())
    way = (place - target) / np.linalg.norm(place - target)
    normal = quick.state.command.hand_pose.rotation @ quick.hand.palm_normal
    assert abs(way @ normal) < 0.6
    assert way[2] > 0.0


def test_the_cut_of_a_finger_is_a_picture_with_words(settled: SettledAnswer) -> None:
    picture, words = plane_picture(settled, "index")
    assert picture is not None
    assert picture.ndim == 3
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 20
    assert words.startswith("**index**")


def test_the_comparison_lists_the_best_preshape_first() -> None:
    each = {"status": "grasp", "total": 1.0}
    text = comparison({"chosen": "b", "text": "b leads.", "compared": {"a": each, "b": {**each, "total": 2.0}}})
    assert text.index("**b**") < text.index("| a |")
    assert comparison(None) == ""
