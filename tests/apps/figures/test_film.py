"""Films and stills of a grasp: the hand moves, then the view does, and contacts are marked at the touch alone."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import clench
from clench.apps.figures import film
from clench.apps.figures.drawing.dots import covered, dotted
from clench.core.exceptions import FileError
from clench.solver.solution import GraspSolution
from mug_grasp import MugGrasp

ORANGE = np.array([0xD5, 0x5E, 0x00])


@pytest.fixture(scope="module")
def hand(mug_grasp: MugGrasp) -> clench.Hand:
    return mug_grasp.hand


@pytest.fixture(scope="module")
def mug(mug_grasp: MugGrasp) -> clench.GraspObject:
    return mug_grasp.mug


@pytest.fixture(scope="module")
def solution(mug_grasp: MugGrasp) -> GraspSolution:
    return mug_grasp.solution


def orange(image: np.ndarray) -> int:
    return int((np.abs(image.astype(int) - ORANGE).sum(axis=2) < 60).sum())


@pytest.mark.parametrize("ending", [".webp", ".gif"])
def test_the_hand_closes_and_the_view_turns(
    hand: clench.Hand,
    mug: clench.GraspObject,
    solution: GraspSolution,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    ending: str,
) -> None:
    from PIL import Image

    monkeypatch.setattr(film, "_CLOSING", 4)
    monkeypatch.setattr(film, "_TURNING", 4)
    path = film.draw_film(hand, mug, solution, tmp_path / f"a{ending}", size=(480, 360))
    with Image.open(path) as image:
        frames = []
        for k in range(image.n_frames):
            image.seek(k)
            frames.append(np.asarray(image.convert("RGB")))
    assert len(frames) == 7, "three of the closing, four of the turn"
    assert frames[0].shape == (360, 480, 3)
    for before, after in pairwise(frames):
        assert (np.abs(before.astype(int) - after).max(axis=2) > 40).mean() > 0.002
    assert orange(frames[0]) == orange(frames[1]) == 0
    assert max(map(orange, frames[3:])) > 5, "some side of the turn shows contacts"


def test_a_planned_path_is_filmed_from_its_start_to_its_end(
    hand: clench.Hand, mug: clench.GraspObject, solution: GraspSolution
) -> None:
    way = clench.plan_trajectory(solution, hand, obj=mug)
    postures = film._postures(hand, solution, way)
    np.testing.assert_allclose(postures[0], way.positions[0])
    np.testing.assert_allclose(postures[-1], way.positions[-1])
    straight = film._postures(hand, solution, None)
    np.testing.assert_allclose(straight[-1], [solution.joint_angles[name] for name in hand.joint_names])
    np.testing.assert_allclose(straight[0], [solution.open_angles[name] for name in hand.joint_names])


def test_a_still_has_its_size_and_its_contacts(
    hand: clench.Hand, mug: clench.GraspObject, solution: GraspSolution, tmp_path: Path
) -> None:
    from PIL import Image

    path = film.draw_still(hand, mug, solution, tmp_path / "still.png", (320, 200))
    image = np.asarray(Image.open(path).convert("RGB"))
    assert image.shape == (200, 320, 3)
    assert orange(image) > 10
    hands = (image != 255).any(axis=2)
    rows, columns = np.flatnonzero(hands.any(axis=1)), np.flatnonzero(hands.any(axis=0))
    assert max(np.ptp(rows) / 200, np.ptp(columns) / 320) > 0.85, "it fills the frame"


def test_files_that_cannot_be_written(
    hand: clench.Hand, mug: clench.GraspObject, solution: GraspSolution, tmp_path: Path
) -> None:
    with pytest.raises(FileError, match=r"no film has the ending '\.avi'; expected \.webp or \.gif"):
        film.draw_film(hand, mug, solution, tmp_path / "a.avi")
    with pytest.raises(FileError, match="no folder"):
        film.draw_film(hand, mug, solution, tmp_path / "none" / "a.gif")
    with pytest.raises(FileError, match="no figure has the ending"):
        film.draw_still(hand, mug, solution, tmp_path / "a.xyz")
    assert not list(tmp_path.iterdir())


def test_dots_and_rings() -> None:
    white = np.ones((40, 60, 3), np.float32)
    image = dotted(white, np.array([[15.0, 20.0], [45.0, 20.0]]), np.array([False, True]), 8.0)
    assert orange(np.round(255 * image)) > 150
    assert (np.abs(255 * image[20, 15] - ORANGE) < 2).all()
    np.testing.assert_allclose(image[20, 45], 1.0, atol=1e-6)
    assert covered((40, 60), np.array([[15.0, 20.0]]), 8.0).sum() == pytest.approx(np.pi * 64, rel=0.03)
