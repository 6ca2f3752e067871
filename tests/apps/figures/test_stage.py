"""Pictures of a stage: pixels show what is nearest, and without OpenGL there is a plain picture."""

from __future__ import annotations

import os
import subprocess
import sys
import warnings
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import clench
from clench.apps.figures.drawing import stage as stages
from clench.apps.figures.drawing.camera import Camera, Picture, halved, look_along
from clench.apps.figures.drawing.contact_labels import _places, photograph
from clench.apps.figures.drawing.stage import Stage
from clench.apps.figures.drawing.viewpoints import focus_of, viewpoints
from clench.core.rendering.opengl import OpenGLError, open_context
from clench.models.appearance import Solid, SolidKind
from clench.models.mesh import TriangleMesh


@pytest.fixture(params=["opengl", "plain"])
def way(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """Draw with OpenGL, where there is one, and without."""
    if request.param == "opengl":
        needs_opengl()
        yield request.param
        return

    def refuse(*_: object) -> None:
        raise OpenGLError("a test says so")

    monkeypatch.setattr(stages, "Offscreen", refuse)
    monkeypatch.setattr(stages, "_told", set())
    with pytest.warns(UserWarning, match="Pictures are plain"):
        yield request.param


def needs_opengl() -> None:
    try:
        open_context(10, 10).free()
    except OpenGLError as error:
        pytest.skip(f"no OpenGL here ({error})")


def camera(width: int = 40, height: int = 30, scale: float = 10.0) -> Camera:
    return Camera(*look_along(np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, 0.0])), np.zeros(3), scale, width, height)


def block(half: tuple[float, float, float], kind: SolidKind = SolidKind.OBJECT, color: str = "#ff0000") -> Solid:
    x, y, z = half
    shape = clench.GraspObject.load(f"box:x={2 * x},y={2 * y},z={2 * z}").bodies[0].shapes[0]
    return Solid(kind, "block", 0, color, shape.to_mesh())


def at(*place: float) -> np.ndarray:
    T = np.eye(4)
    T[:3, 3] = place
    return T


def test_a_block_covers_its_pixels_and_no_others(way: str) -> None:
    with Stage([block((1.0, 0.5, 0.2))], np.array([at(0, 0, 0)])) as stage:
        picture = stage.picture(camera())
    seen = picture.solid >= 0
    assert seen[10:20, 10:30].all()
    assert 200 <= seen.sum() <= 231, "pixels on the border may count"
    assert np.isneginf(picture.nearness[~seen]).all()
    assert picture.nearness[15, 20] == pytest.approx(0.2, abs=1e-3)
    assert (picture.image[~seen] == 1.0).all()
    red, green, blue = picture.image[15, 20]
    assert red > 0.6
    assert max(green, blue) < 0.3


def test_the_nearer_solid_is_seen_and_can_be_left_out(way: str) -> None:
    solids = [block((0.5, 0.5, 0.1)), block((1.0, 1.0, 0.1), SolidKind.HAND, "#0000ff")]
    with Stage(solids, np.array([at(0, 0, 1), at(0, 0, -1)])) as stage:
        assert stage.sight(camera()).solid[15, 20] == 0
        assert stage.sight(camera(), without=(SolidKind.OBJECT,)).solid[15, 20] == 1
        assert stage.sight(camera()).solid[15, 12] == 1
        stage.pose(np.array([at(0, 0, -3), at(0, 0, -1)]))
        assert stage.sight(camera()).solid[15, 20] == 1


@settings(max_examples=12, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_pixels_show_the_nearest_of_crossing_triangles(seed: int) -> None:
    needs_opengl()
    corners = np.random.default_rng(seed).uniform(-1.2, 1.2, (4, 4, 3))
    faces = [[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]]
    solids = [Solid(SolidKind.OBJECT, "a", k, "#808080", TriangleMesh(c, faces)) for k, c in enumerate(corners)]
    view = camera(24, 20, 8.0)
    with Stage(solids, np.tile(np.eye(4), (4, 1, 1))) as stage:
        picture = stage.sight(view)
    flat = view.project(corners[:, faces].reshape(-1, 3, 3))
    compared = 0
    for row in range(view.height):
        for column in range(view.width):
            here, found, clear = np.array([column + 0.5, row + 0.5]), [], True
            for t in flat:
                m = np.vstack([t[:, :2].T, np.ones(3)])
                weights = np.linalg.solve(m, [*here, 1.0])
                clear = clear and abs(weights).min() > 0.02  # away from edges: there either answer will do
                if (weights > 0.0).all():
                    found.append(float(weights @ t[:, 2]))
            if clear:
                compared += 1
                seen = picture.nearness[row, column]
                assert seen == pytest.approx(max(found), abs=3e-3) if found else np.isneginf(seen)
    assert compared > 50


def test_an_empty_stage_and_flat_things_do_no_harm(way: str) -> None:
    flat = Solid(
        SolidKind.OBJECT, "flat", 0, "#00ff00", TriangleMesh([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], [[0, 1, 2]])
    )
    nothing = Solid(SolidKind.HAND, "none", 0, "#00ff00", TriangleMesh(np.empty((0, 3)), []))
    with warnings.catch_warnings():
        if way == "opengl":
            warnings.simplefilter("error")
        check_odd_stages(nothing, flat)


def check_odd_stages(nothing: Solid, flat: Solid) -> None:
    with Stage([], np.empty((0, 4, 4))) as stage:
        assert (stage.picture(camera()).solid == -1).all()
    with Stage([nothing, flat], np.array([at(0, 0, 5), at(0, 0, 0)])) as stage:
        assert len(stage.solids) == 1
        assert stage.picture(camera()).solid[15, 20] == 0


def test_lines_are_drawn_around_solids() -> None:
    solid = np.zeros((30, 40), dtype=np.int64)
    solid[:, 20:] = 1
    picture = Picture(np.zeros((30, 40)), solid, np.ones((30, 40, 3), np.float32))
    image = picture.outlined()
    assert (image[:, 19:21] < 0.5).all()
    assert (image[:, :19] == 1.0).all()
    jump = Picture(np.where(solid, 0.01, 0.0), np.zeros_like(solid), picture.image)
    assert (jump.outlined()[:, 19:21] < 0.5).all()
    assert (jump.outlined(0.02) == 1.0).all()
    assert halved(image).shape == (15, 20, 3)
    np.testing.assert_allclose(halved(image)[7, 3], image[14, 6])


@settings(max_examples=50, deadline=None)
@given(st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda v: np.linalg.norm(v) > 0.1))
def test_views_are_right_handed(towards: tuple[float, float, float]) -> None:
    axes = np.array(look_along(np.array(towards), np.array([0.0, 0.0, 1.0])))
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-9)
    assert np.linalg.det(axes) == pytest.approx(1.0)


def test_an_object_is_translucent_only_where_it_hides_contacts(way: str) -> None:
    solids = [block((1.0, 1.0, 0.1)), block((0.4, 0.4, 0.1), SolidKind.HAND, "#0000ff")]
    with Stage(solids, np.array([at(0, 0, 1), at(0, 0, -1)])) as stage:
        behind, beside = np.array([[0.0, 0.0, -0.9]]), np.array([[1.3, 0.0, 0.0]])
        ghost, _, hidden = photograph(stage, camera(), behind)
        solid, _, seen = photograph(stage, camera(), beside)
    assert hidden.tolist() == [True]
    assert seen.tolist() == [False]
    assert ghost[15, 20, 2] > solid[15, 20, 2] + 0.2, "the blue hand shows through"
    np.testing.assert_allclose(ghost[15, 28], solid[15, 28], atol=1e-6)


def test_labels_cover_nothing_where_there_is_room() -> None:
    free = np.ones((300, 400), dtype=bool)
    free[60:240, 100:300] = False
    points = np.array([[200.0, 150.0]] * 3 + [[120.0, 80.0], [280.0, 220.0]])
    places = _places(points, [12] * 5, free)
    for k, (x, y) in enumerate(places.astype(int)):
        assert free[y - 12 : y + 13, x - 12 : x + 13].all()
        others = np.abs(np.delete(places, k, axis=0) - places[k])
        assert ((others[:, 0] >= 24) | (others[:, 1] >= 24)).all()
    everywhere = _places(points, [12] * 5, np.zeros((300, 400), dtype=bool))
    assert np.isfinite(everywhere).all()
    assert _places(np.empty((0, 2)), [], free).shape == (0, 2)


def test_viewpoints_differ_and_are_the_same_each_time() -> None:
    solids = [block((1.0, 1.0, 0.1)), block((0.4, 0.4, 0.1), SolidKind.HAND, "#0000ff")]
    with Stage(solids, np.array([at(0, 0, 1), at(0, 0, -1)])) as stage:
        for points in (np.array([[0.0, 0.0, -1.1]]), np.empty((0, 3))):
            found = viewpoints(stage, focus_of(stage), points, 3)
            assert max(found[i] @ found[j] for i in range(3) for j in range(i)) < 0.5
            np.testing.assert_array_equal(found, viewpoints(stage, focus_of(stage), points, 3))
            if len(points):
                assert found[0][2] < 0.0, "the contact is seen from below only"


def test_without_opengl_the_picture_is_plain_and_a_sentence_says_so(tmp_path: Path) -> None:
    code = (
        "import clench; from clench.apps.figures.maps.hand_map import draw_hand_map; from pathlib import Path;"
        "draw_hand_map(clench.Hand.load('patent15'), Path('hand.png'))"
    )
    environment = {**os.environ, "MUJOCO_GL": "off"}
    command = [sys.executable, "-c", code]
    run = subprocess.run(command, env=environment, cwd=tmp_path, capture_output=True, text=True, check=True)
    assert run.stderr.count("Pictures are plain: OpenGL cannot draw here (MUJOCO_GL=off switches it off).") == 1
    assert (tmp_path / "hand.png").stat().st_size > 10_000


@pytest.mark.skipif(sys.platform != "linux", reason="macOS and Windows have their own OpenGL")
@pytest.mark.parametrize("library", ["egl", "osmesa"])
def test_both_libraries_draw_without_being_asked_for(library: str) -> None:
    """A library that is missing leaves no trace: the next one draws."""
    code = (
        "import sys, clench.core.rendering.opengl as gl; gl._WITHOUT_SCREEN = ('nothing', sys.argv[1]); "
        "gl.open_context(10, 10).free(); print(gl._found[0].__module__)"
    )
    environment = {k: v for k, v in os.environ.items() if k not in ("MUJOCO_GL", "DISPLAY", "WAYLAND_DISPLAY")}
    command = [sys.executable, "-c", code, library]
    run = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    if "OpenGLError" in run.stderr:
        pytest.skip(f"no {library} here")
    assert run.stdout == f"mujoco.{library}\n"


@pytest.mark.parametrize("size", [1e-6, 1e-4, 1.0, 100.0])
def test_things_of_any_size_have_a_picture(way: str, size: float) -> None:
    """MuJoCo ends the process where a scene has no extent, as a speck had that one point stood for."""
    near = camera(scale=20.0 / size)
    with Stage([block((0.5 * size,) * 3)], np.eye(4)[None]) as stage:
        assert np.ptp(stage.points(SolidKind.OBJECT), axis=0) == pytest.approx(np.full(3, size))
        picture = stage.picture(near)
    assert (picture.solid >= 0).sum() == pytest.approx(400, abs=80)
