"""Find an OpenGL that draws without a window, and import MuJoCo where there is none."""

from __future__ import annotations

import importlib.util
import os
import sys
from typing import Any, Final

from clench.core.exceptions import ClenchError

_VARIABLE: Final = "MUJOCO_GL"
#: MuJoCo's value for: do not look for OpenGL.
_OFF: Final = ("disable", "disabled", "off", "false", "0")
#: Libraries that draw without a screen on Linux, the better one first; each has a module of this name in MuJoCo.
_WITHOUT_SCREEN: Final = ("egl", "osmesa")
#: Says to PyOpenGL which library to load; MuJoCo's modules set it.
_PLATFORM: Final = "PYOPENGL_PLATFORM"
#: Why the OpenGL that MUJOCO_GL names could not be loaded, once that was tried.
_failed: list[str] = []
#: What draws here, once it was found: a class of MuJoCo.
_found: list[Any] = []


class OpenGLError(ClenchError):
    """Say why nothing can be drawn with OpenGL."""


def import_mujoco() -> Any:
    """Return MuJoCo, imported without OpenGL if the library that MUJOCO_GL names cannot be loaded.

    GLFW, which only draws on a screen, loads when something uses it. It starts a second Python to look for its library.
    """
    load_late("glfw")
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


def load_late(name: str) -> None:
    """Let a module load when one of its names is first used; do nothing if it is loaded, or not installed."""
    spec = None if name in sys.modules else importlib.util.find_spec(name)
    if spec is None or spec.loader is None:
        return
    module, loader = importlib.util.module_from_spec(spec), spec.loader

    def load(attribute: str) -> Any:
        if attribute.startswith("__"):
            raise AttributeError(f"module '{name}' has no attribute '{attribute}'")
        late = vars(module).pop("__getattr__")
        try:
            loader.exec_module(module)
        except BaseException:
            vars(module)["__getattr__"] = late
            raise
        return getattr(module, attribute)

    vars(module)["__getattr__"] = load
    sys.modules[name] = module


def open_context(width: int, height: int) -> Any:
    """Return a current OpenGL context of MuJoCo that draws off screen; its `free` closes the context.

    MUJOCO_GL chooses the library, as MuJoCo documents it. Without the variable, Linux uses EGL, else OSMesa, else the
    screen. macOS and Windows use their own OpenGL.

    Args:
        width, height: of the largest picture [px].

    Raises:
        OpenGLError: nothing can draw; the text is part of a sentence.
    """
    mujoco = import_mujoco()
    if _failed:
        raise OpenGLError(_failed[0])
    if not hasattr(mujoco, "MjrContext") or os.environ.get(_VARIABLE, "").lower().strip() in _OFF:
        raise OpenGLError(f"MUJOCO_GL={os.environ.get(_VARIABLE, '')} switches it off")
    reasons = []
    for make in _found or _candidates(mujoco):
        try:
            context = (_offscreen(make) if isinstance(make, str) else make)(width, height)
            context.make_current()
        except Exception as error:  # whatever the graphics library raises
            reasons.append(" ".join(str(error).split()) or type(error).__name__)
            continue
        _found[:] = [type(context)]
        return context
    raise OpenGLError("; ".join(dict.fromkeys(reasons)) or "there is no screen")


def _candidates(mujoco: Any) -> list[Any]:
    """Return what may draw here, the best first: names of MuJoCo's modules, or classes."""
    if sys.platform != "linux":
        return [mujoco.GLContext]
    asked = os.environ.get(_VARIABLE, "").lower().strip()
    if asked in _WITHOUT_SCREEN:
        return [asked]
    # The remaining library draws on a screen. Without a screen, it ends the program.
    screen = [mujoco.GLContext] if os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY") else []
    return screen if asked else [*_WITHOUT_SCREEN, *screen]


def _offscreen(name: str) -> Any:
    """Return the context class of a library; leave the environment as it was, and of a failure no trace at all."""
    before, platform = set(sys.modules), os.environ.get(_PLATFORM)
    try:
        return importlib.import_module(f"mujoco.{name}").GLContext
    except Exception:
        # PyOpenGL keeps the first library that it was told to load: the next attempt needs a fresh one.
        for module in set(sys.modules) - before:
            if module.split(".")[0] == "OpenGL" or module.startswith(f"mujoco.{name}"):
                del sys.modules[module]
        raise
    finally:
        # PyOpenGL has read it. Programs that this one starts choose for themselves.
        os.environ.pop(_PLATFORM, None)
        if platform is not None:
            os.environ[_PLATFORM] = platform
