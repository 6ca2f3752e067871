"""Draw a MuJoCo model off screen: colour, distance and geom of each pixel."""

from __future__ import annotations

from types import TracebackType
from typing import Any, Final, Self

import numpy as np
from numpy.typing import NDArray

from clench.core.rendering.opengl import OpenGLError, import_mujoco, open_context

#: Geoms of a scene at most, and the size of MuJoCo's letters, of which none are drawn.
_MOST_GEOMS: Final = 10_000
_FONT: Final = 100


class Offscreen:
    """A renderer of one model; close it, or use it in a `with` statement.

    Args:
        model: a compiled `mujoco.MjModel`. width, height: of the pictures [px].

    Attributes:
        scene: the `mujoco.MjvScene` that is drawn; its cameras and lights may be changed after `update`.

    Raises:
        OpenGLError: nothing can draw here; the text is part of a sentence.
    """

    def __init__(self, model: Any, width: int, height: int) -> None:
        mujoco = import_mujoco()
        self._mujoco, self._model, self._size = mujoco, model, (width, height)
        self._context: Any = None
        self._gl = open_context(width, height)
        model.vis.global_.offwidth, model.vis.global_.offheight = width, height
        try:
            self._context = mujoco.MjrContext(model, _FONT)
            mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._context)
        except Exception as error:  # whatever the graphics library raises
            self.close()
            raise OpenGLError(" ".join(str(error).split())) from None
        self._context.readDepthMap = mujoco.mjtDepthMap.mjDEPTH_ZEROFAR
        self.scene = mujoco.MjvScene(model, maxgeom=_MOST_GEOMS)
        self._options = mujoco.MjvOption()

    def update(self, data: Any, camera: Any = None, hidden: frozenset[int] = frozenset()) -> None:
        """Take over the poses of a state.

        Args:
            data: a `mujoco.MjData`. camera: a `mujoco.MjvCamera`; None: the free camera.
            hidden: groups of geoms that are left out.
        """
        mujoco = self._mujoco
        for group in range(len(self._options.geomgroup)):
            self._options.geomgroup[group] = group not in hidden
        camera = mujoco.MjvCamera() if camera is None else camera
        every = mujoco.mjtCatBit.mjCAT_ALL
        mujoco.mjv_updateScene(self._model, data, self._options, None, camera, every, self.scene)

    def resize(self, width: int, height: int) -> None:
        """Change the size of the pictures [px]."""
        if (width, height) != self._size:
            self._gl.make_current()
            self._mujoco.mjr_resizeOffscreen(width, height, self._context)
            self._size = width, height

    def draw(self) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
        """Return colours, shape (H, W, 3), and the nearness of the visible surface, shape (H, W).

        Nearness is 1 at the near plane of the camera and 0 at its far plane; without perspective it is linear.
        """
        (width, height), mujoco = self._size, self._mujoco
        colors, nearness = np.empty((height, width, 3), np.uint8), np.empty((height, width), np.float32)
        self._gl.make_current()
        view = mujoco.MjrRect(0, 0, width, height)
        mujoco.mjr_render(view, self.scene, self._context)
        mujoco.mjr_readPixels(colors, nearness, view, self._context)
        return colors[::-1], nearness[::-1]

    def draw_geoms(self) -> tuple[NDArray[np.int64], NDArray[np.float32]]:
        """Return the number of the geom that is seen at each pixel, -1 for none, and how near it is, shape (H, W)."""
        flags = list(map(int, (self._mujoco.mjtRndFlag.mjRND_SEGMENT, self._mujoco.mjtRndFlag.mjRND_IDCOLOR)))
        before = self.scene.flags[flags]
        self.scene.flags[flags] = 1
        colors, nearness = self.draw()
        self.scene.flags[flags] = before
        code = colors.astype(np.int64) @ np.array([1, 1 << 8, 1 << 16])
        shown = [geom for geom in self.scene.geoms[: self.scene.ngeom] if geom.segid >= 0]
        geoms = np.full(max((geom.segid for geom in shown), default=-1) + 2, -1, dtype=np.int64)
        for geom in shown:
            geoms[geom.segid + 1] = geom.objid
        return geoms[code], nearness

    def close(self) -> None:
        """Free the memory of the graphics library."""
        if self._context is not None:
            self._gl.make_current()
            self._context.free()
            self._context = None
        if self._gl is not None:
            self._gl.free()
            self._gl = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
