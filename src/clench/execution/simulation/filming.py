"""Film a simulation: a moving picture (GIF or MP4) and stills (PNG), on request."""

from __future__ import annotations

import importlib.util
import io
import tempfile
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from clench.core.exceptions import ClenchError, FileError
from clench.core.extras import how_to_install
from clench.core.files.json_files import check_folder, check_writable, write_atomically
from clench.core.pose import FloatArray
from clench.core.rendering.offscreen import Offscreen
from clench.core.rendering.opengl import OpenGLError, import_mujoco, open_context
from clench.core.showing.short_repr import short_repr

from .mujoco_scene import Scene

#: Time between two pictures [s]; a GIF counts hundredths.
FRAME: Final = 0.04
_WIDTH, _HEIGHT = 640, 480
_NO_OPENGL: Final = "No video: OpenGL cannot draw here ({}). Without a screen, install Mesa's libegl1."
#: From where the camera looks [degrees].
_AZIMUTH, _ELEVATION = 135.0, -20.0
#: Share of the picture that hand and object fill at the start [-].
_FILLED: Final = 0.9
#: Rise of hand and object that the picture has room for if the palm moves up [m].
_UP: Final = 0.1
#: The camera sees nothing nearer, as a share of its distance [-].
_NEAR: Final = 0.01
#: Group of geoms that are not drawn.
_COVERED: Final = 1


@dataclass
class Film:
    """Take pictures of a simulation and write them.

    Drawing needs OpenGL. Without a screen, Mesa's EGL or OSMesa draws.

    Args:
        video: a GIF or MP4 file, at the speed of the simulation; MP4 needs `clench[video]`.
        stills: a folder for pictures of the start, the touch, the squeeze and the end.
    """

    video: Path | None = None
    stills: Path | None = None
    _frames: list[Any] = field(default_factory=list, init=False, repr=False)
    _kept: dict[str, Any] = field(default_factory=dict, init=False, repr=False)
    _renderer: Any = field(default=None, init=False, repr=False)
    _camera: Any = field(default=None, init=False, repr=False)
    _due: float = field(default=0.0, init=False, repr=False)

    __repr__ = short_repr

    def __post_init__(self) -> None:
        """Refuse files that cannot be written.

        Raises:
            FileError: the file is not GIF or MP4, is a folder, or its folder does not exist.
            ClenchError: MP4 without the library that writes it; an OpenGL that cannot be loaded.
        """
        if self.video is not None and self.video.suffix.lower() not in (".gif", ".mp4"):
            raise FileError(self.video, "cannot be written: expected a file name that ends with .gif or .mp4.")
        if self._is_mp4() and importlib.util.find_spec("imageio_ffmpeg") is None:
            raise ClenchError(f"MP4 needs imageio-ffmpeg: {how_to_install('video')}, or choose a .gif file.")
        if self.video is not None:
            check_writable(self.video)
        if self.stills is not None:
            check_folder(self.stills)
        if self.video or self.stills:
            try:
                open_context(_WIDTH, _HEIGHT).free()
            except OpenGLError as error:
                raise ClenchError(_NO_OPENGL.format(error)) from None

    def begin(self, scene: Scene, data: Any) -> None:
        """Point the camera at the hand and the object.

        Raises:
            ClenchError: there is no OpenGL to draw with.
        """
        mujoco = import_mujoco()
        try:
            self._renderer = Offscreen(scene.model, _WIDTH, _HEIGHT)
        except OpenGLError as error:
            raise ClenchError(_NO_OPENGL.format(error)) from None
        model, links = scene.model, [body for body in scene.link_bodies if body >= 0]
        model.geom_group[:] = np.where(covered_geoms(model, links), _COVERED, 0)
        shown = np.isin(model.geom_bodyid, [*links, scene.object_body]) & (model.geom_group != _COVERED)
        places = np.vstack([_corners(model, data, int(geom)) for geom in np.flatnonzero(shown)])
        if scene.lift >= 0:
            places = np.vstack([places, places + np.array([0.0, 0.0, _UP])])
        self._camera = mujoco.MjvCamera()
        self._camera.azimuth, self._camera.elevation = _AZIMUTH, _ELEVATION
        self._camera.lookat[:], self._camera.distance = framed(places, float(model.vis.global_.fovy))
        model.vis.map.znear = _NEAR * self._camera.distance / model.stat.extent
        self._frames, self._kept, self._due = [], {}, float(data.time)
        self.still("start", data)

    def look(self, data: Any) -> None:
        """Take a picture when one is due."""
        if self.video is not None and data.time >= self._due - 1e-9:
            self._frames.append(self._drawn(data))
            self._due += FRAME

    def go_on(self, data: Any) -> None:
        """Go on from a state that may be earlier than the last picture."""
        self._due = float(data.time)

    def still(self, name: str, data: Any) -> None:
        """Keep a picture."""
        if self.stills is not None:
            self._kept[name] = self._drawn(data)

    def finish(self) -> tuple[Path, ...]:
        """Write the pictures; return the files.

        Raises:
            FileError: a file cannot be written.
        """
        if self._renderer is not None:
            self._renderer.close()
            self._renderer = None
        written = []
        if self.video is not None and self._frames:
            film = (_mp4 if self._is_mp4() else _gif)(self._frames)
            written.append(_written(self.video, film))
        for number, (name, picture) in enumerate(self._kept.items(), start=1):
            assert self.stills is not None
            content = io.BytesIO()
            picture.save(content, "PNG")
            written.append(_written(self.stills / f"{number}_{name}.png", content.getvalue()))
        return tuple(written)

    def _is_mp4(self) -> bool:
        return self.video is not None and self.video.suffix.lower() == ".mp4"

    def _drawn(self, data: Any) -> Any:
        from PIL import Image

        self._renderer.update(data, self._camera, frozenset({_COVERED}))
        return Image.fromarray(self._renderer.draw()[0])


def covered_geoms(model: Any, bodies: list[int]) -> NDArray[np.bool_]:
    """Return the geoms of some bodies that collide and that others of the body are drawn over, shape (G,).

    Both in one place would flicker.
    """
    colliding = (model.geom_contype != 0) | (model.geom_conaffinity != 0)
    drawn = np.unique(model.geom_bodyid[~colliding])
    covered: NDArray[np.bool_] = colliding & np.isin(model.geom_bodyid, np.intersect1d(drawn, bodies))
    return covered


def framed(places: FloatArray, fovy: float) -> tuple[FloatArray, float]:
    """Return what the camera looks at, shape (3,), and from how far [m], so that places fill the picture.

    A place p appears at `x / (distance + depth)`, where x is across the view and depth along it. So each side of the
    picture bounds the distance and the middle linearly, and the best of both is known in closed form.

    Args:
        places: in the world [m], shape (N, 3). fovy: vertical field of view [degrees].
    """
    azimuth, elevation = np.deg2rad([_AZIMUTH, _ELEVATION])
    level = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
    along = np.cos(elevation) * level + np.array([0.0, 0.0, np.sin(elevation)])
    right = np.array([level[1], -level[0], 0.0])
    up = np.cross(right, along)
    depth, half = places @ along, _FILLED * np.tan(0.5 * np.deg2rad(fovy))
    middle, off = 0.0 * along, -np.inf
    for axis, share in ((right, half * _WIDTH / _HEIGHT), (up, half)):
        across = places @ axis / share
        most, least = float((across - depth).max()), float((-across - depth).max())
        middle = middle + 0.5 * share * (most - least) * axis
        off = max(off, 0.5 * (most + least))
    ahead = 0.5 * float(depth.min() + depth.max())
    return middle + ahead * along, off + ahead


def _corners(model: Any, data: Any, geom: int) -> Any:
    """Return the corners of the box around a geom in the world [m], shape (8, 3)."""
    center, half = model.geom_aabb[geom].reshape(2, 3)
    signs = np.array(np.meshgrid(*[(-1.0, 1.0)] * 3)).reshape(3, -1).T
    return data.geom_xpos[geom] + (center + signs * half) @ data.geom_xmat[geom].reshape(3, 3).T


def _gif(frames: list[Any]) -> bytes:
    first, *others = frames
    content = io.BytesIO()
    first.save(content, "GIF", save_all=True, append_images=others, duration=round(FRAME * 1000), loop=0, optimize=True)
    return content.getvalue()


def _mp4(frames: list[Any]) -> bytes:
    """Return H.264 that browsers play, the same bytes for the same pictures.

    Raises:
        ClenchError: ffmpeg cannot be run.
    """
    import imageio_ffmpeg

    same = ["-threads", "1", "-fflags", "+bitexact", "-flags:v", "+bitexact", "-movflags", "+faststart"]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "film.mp4"
        try:
            writer = imageio_ffmpeg.write_frames(str(path), frames[0].size, fps=1.0 / FRAME, output_params=same)
            writer.send(None)
            for frame in frames:
                writer.send(frame.tobytes())
            writer.close()
            return path.read_bytes()
        except (OSError, RuntimeError) as error:
            why = (str(error).strip() or type(error).__name__).splitlines()[-1]
            raise ClenchError(f"No video: ffmpeg could not write it ({why.rstrip('.')}).") from None


def _written(path: Path, content: bytes) -> Path:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileError(path.parent, f"cannot be made a folder ({error.strerror or error}).") from None
    write_atomically(path, content)
    return path
