"""Import MuJoCo on machines that cannot draw: its import looks for OpenGL, which only films need."""

from __future__ import annotations

import os
from typing import Any, Final

_VARIABLE: Final = "MUJOCO_GL"
#: MuJoCo's value for: do not look for OpenGL.
_OFF: Final = ("disable", "disabled", "off", "false", "0")
#: Why the OpenGL that MUJOCO_GL names could not be loaded, once that was tried.
_failed: list[str] = []


def import_mujoco() -> Any:
    """Return MuJoCo, imported without OpenGL if the library that MUJOCO_GL names cannot be loaded."""
    try:
        import mujoco
    except Exception as error:  # whatever the graphics library raises
        asked = os.environ.get(_VARIABLE)
        if not asked or asked.lower().strip() in _OFF:
            raise
        os.environ[_VARIABLE] = _OFF[0]
        try:
            import mujoco
        finally:
            os.environ[_VARIABLE] = asked
        _failed.append(f"MUJOCO_GL={asked} cannot be used: {' '.join(str(error).split())}")
    return mujoco


def why_not_drawn() -> str | None:
    """Return why nothing can be drawn, as part of a sentence; None when nothing speaks against it."""
    mujoco = import_mujoco()
    if _failed:
        return _failed[0]
    if not hasattr(mujoco, "GLContext") or not hasattr(mujoco, "Renderer"):
        return f"MUJOCO_GL={os.environ.get(_VARIABLE, '')} switches it off"
    return None
