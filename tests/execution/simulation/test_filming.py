"""Pictures of a simulation: as many as its time asks for, of what happens, or one sentence why not."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from clench.apps.cli.inputs.actuators import make_film, make_hold
from clench.core.exceptions import ClenchError, CommandError, FileError
from clench.execution.executing import execute
from clench.execution.simulation.filming import FRAME, Film, covered_geoms, framed
from clench.execution.simulation.hold import Hold
from clench.execution.simulation.mujoco_scene import build_scene
from clench.execution.simulation.simulated_hand import SimulatedHand
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import GraspObject
from clench.solver.solution import GraspSolution


@pytest.mark.parametrize("hold", [None, Hold(friction=1.0, contact_model="soft", duration=0.2)])
def test_a_film_is_as_long_as_what_it_shows(
    pincer: Hand, pinch: GraspSolution, ball: GraspObject, tmp_path: Path, hold: Hold | None
) -> None:
    from PIL import Image

    film = Film(tmp_path / "grasp.gif", tmp_path / "stills")
    try:
        report = execute(pinch, SimulatedHand(pincer, ball, hold=hold, film=film))
    except ClenchError as error:
        if "OpenGL cannot draw here" in str(error):
            pytest.skip("no OpenGL here")
        raise
    video, *stills = film.finish()
    names = ["1_start.png", "2_touch.png"] if hold is None else [f"{n}" for n in _ALL]
    assert [path.name for path in stills] == names
    with Image.open(video) as picture:
        # Pictures that equal the one before are kept as one that is shown longer.
        shown = 0
        for k in range(picture.n_frames):
            picture.seek(k)
            shown += picture.info["duration"]
    if hold is None:
        assert shown / 1000.0 == pytest.approx(report.duration, abs=2 * FRAME)
    start, touch = (np.asarray(Image.open(path)).astype(int) for path in stills[:2])
    assert start.shape == (480, 640, 3)
    assert (np.abs(start - touch).max(axis=2) > 50).sum() > 500  # the fingers have moved
    orange = (start[..., 0] > 150) & (start[..., 2] < 100)
    assert orange.sum() > 500  # the object is there


_ALL = ("1_start.png", "2_touch.png", "3_squeeze.png", "4_end.png")


def test_the_whole_object_is_in_the_picture(pincer: Hand, pinch: GraspSolution, tmp_path: Path) -> None:
    """A bottle that is longer than the hand must not be cut off at the edges."""
    import mujoco
    from PIL import Image

    film = Film(stills=tmp_path)
    tall = GraspObject.load("cylinder:r=0.02,h=0.5").posed(pinch.object_pose)
    scene = build_scene(pincer, tall, pinch.hand_pose, np.zeros(3))
    data = mujoco.MjData(scene.model)
    mujoco.mj_forward(scene.model, data)
    try:
        film.begin(scene, data)
    except ClenchError as error:
        if "OpenGL cannot draw here" in str(error):
            pytest.skip("no OpenGL here")
        raise
    picture = np.asarray(Image.open(film.finish()[0])).astype(int)
    orange = (picture[..., 0] > 150) & (picture[..., 2] < 100)
    assert orange.sum() > 1000
    assert not orange[[0, -1]].any()
    assert not orange[:, [0, -1]].any()


def test_hand_and_object_fill_the_picture_and_stay_inside() -> None:
    """Seen by a pinhole camera as MuJoCo has it, some place lies at the rim that is left free, and none beyond it."""
    rng = np.random.default_rng(0)
    azimuth, elevation = np.deg2rad([135.0, -20.0])
    along = np.array([np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)])
    right = np.array([np.sin(azimuth), -np.cos(azimuth), 0.0])
    up = np.cross(right, along)
    for size in (1e-3, 0.3, 100.0):
        places = size * (rng.normal(size=(50, 3)) * [1.0, 0.2, 0.6] + [3.0, -2.0, 1.0])
        lookat, distance = framed(places, 45.0)
        seen = places - (lookat - distance * along)
        half = np.tan(np.deg2rad(22.5))
        x, y = (seen @ right) / (seen @ along) / (half * 4.0 / 3.0), (seen @ up) / (seen @ along) / half
        assert (seen @ along > 0.0).all()
        assert max(np.abs(x).max(), np.abs(y).max()) == pytest.approx(0.9)
        # Both rims of one direction are reached.
        wide = x if np.abs(x).max() > np.abs(y).max() else y
        assert (wide.min(), wide.max()) == pytest.approx((-0.9, 0.9))


def test_geoms_that_others_are_drawn_over_are_left_out() -> None:
    import mujoco

    def body(name: str, geoms: str) -> str:
        return f'<body name="{name}">{geoms}</body>'

    drawn, collides = '<geom size="1" contype="0" conaffinity="0"/>', '<geom size="1"/>'
    xml = (
        body("both", drawn + collides) + body("bare", collides) + body("shown", drawn) + body("else", drawn + collides)
    )
    model = mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{xml}</worldbody></mujoco>")
    links = [model.body(name).id for name in ("both", "bare", "shown")]
    assert covered_geoms(model, links).tolist() == [False, True, False, False, False, False]


def test_pictures_come_back_from_an_mp4_in_order(tmp_path: Path) -> None:
    ffmpeg = pytest.importorskip("imageio_ffmpeg")
    from PIL import Image

    shades = [(250, 10, 10), (10, 250, 10), (10, 10, 250)]
    frames = [Image.new("RGB", (640, 480), shade) for shade in shades for _ in range(5)]
    files = []
    for name in ("a.mp4", "b.MP4"):
        film = Film(tmp_path / name)
        film._frames = frames
        files += film.finish()
    assert files[0].read_bytes() == files[1].read_bytes()
    reader = ffmpeg.read_frames(str(files[0]))
    about = next(reader)
    assert about["source_size"] == (640, 480)
    assert about["fps"] == pytest.approx(1.0 / FRAME)
    shown = [np.frombuffer(frame, np.uint8).reshape(480, 640, 3)[240, 320] for frame in reader]
    assert len(shown) == len(frames)
    for k, shade in enumerate(shades):
        np.testing.assert_allclose(shown[5 * k + 2].astype(int), shade, atol=12)


def test_what_cannot_be_written_is_said_before_anything_moves(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(FileError, match=r"a\.avi: cannot be written: expected .* ends with \.gif or \.mp4"):
        Film(tmp_path / "a.avi")
    monkeypatch.setattr("importlib.util.find_spec", lambda _: None)
    with pytest.raises(ClenchError, match=r"MP4 needs imageio-ffmpeg: pip install 'clench\[video\]'"):
        Film(tmp_path / "a.mp4")
    with pytest.raises(FileError, match="no folder"):
        Film(tmp_path / "nowhere" / "a.gif")
    (tmp_path / "file").touch()
    with pytest.raises(FileError, match="cannot be made a folder"):
        Film(stills=tmp_path / "file")
    assert make_film(None, None) is None


def test_without_a_screen_and_without_a_way_to_do_without(
    pincer: Hand, pinch: GraspSolution, ball: GraspObject, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The engine's own default would end the whole program."""
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr("sys.platform", "linux")
    monkeypatch.setenv("MUJOCO_GL", "glfw")
    monkeypatch.setattr("clench.core.rendering.opengl._found", [])
    with pytest.raises(
        ClenchError, match=r"OpenGL cannot draw here \(there is no screen\)\. .* install Mesa's libegl1"
    ):
        execute(pinch, SimulatedHand(pincer, ball, film=Film(tmp_path / "a.gif")))


def test_nothing_taken_is_nothing_written(tmp_path: Path) -> None:
    assert Film(tmp_path / "a.gif", tmp_path / "stills").finish() == ()
    assert not list(tmp_path.iterdir())


def test_options_of_the_test_that_was_asked_for() -> None:
    assert make_hold(False, False, None, None) is None
    assert make_hold(True, False, 0.2, None) == Hold(mass=0.2)
    assert make_hold(False, True, None, 0.4) == replace(Hold(test="lift"), friction=0.4)
    with pytest.raises(CommandError, match="two tests"):
        make_hold(True, True, None, None)
    with pytest.raises(CommandError, match="--mass means nothing without --hold or --lift"):
        make_hold(False, False, 0.2, None)
