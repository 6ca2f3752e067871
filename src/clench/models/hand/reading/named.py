"""Find hands by name in MuJoCo Menagerie and robot_descriptions, where these packages are installed."""

from __future__ import annotations

import contextlib
import importlib
import importlib.util
import sys
from pathlib import Path
from types import ModuleType
from typing import Any, Final

from clench.core.exceptions import HandError, UnknownNameError
from clench.core.extras import how_to_install

MENAGERIE: Final = "mujoco_menagerie"
DESCRIPTIONS: Final = "robot_descriptions"
_INSTALL: Final = how_to_install("hands")
#: Hands whose models were loaded and solved, so that messages may suggest them. The packages also have grippers with
#: prismatic fingers or closed linkages, which clench refuses, and models that were not tried.
_LOADING: Final = frozenset(
    {"shadow_hand", "wonik_allegro", "shadow_hand_mj_description", "allegro_hand_mj_description"}
)


def find_named(model: str) -> Path | None:
    """Return the file of a named hand, fetched into the package's cache if necessary; None for an unknown name.

    Args:
        model: ``"shadow_hand"`` or ``"shadow_hand/right_hand"`` (Menagerie: robot and entry), or
            ``"allegro_hand_description"`` or ``"allegro_hand_description/right"`` (robot_descriptions: module and
            side), each with or without the package's name and a colon before it.

    Raises:
        UnknownNameError: the package is named, or the robot found, but not the rest. HandError: the package is not
            installed, or the files cannot be fetched.
    """
    package, colon, rest = model.rpartition(":")
    if colon and package not in (MENAGERIE, DESCRIPTIONS):
        return None
    name, _, variant = rest.partition("/")
    for candidate, names, find in (
        (MENAGERIE, _menagerie_names, _in_menagerie),
        (DESCRIPTIONS, _description_names, _in_descriptions),
    ):
        if package == candidate and not _installed(package):
            raise HandError(f"Hand '{model}': the package {package} is not installed; hands by name need {_INSTALL}.")
        if package not in ("", candidate) or not _installed(candidate):
            continue
        if name in names(hands=False):
            return find(name, variant)
        if package:
            raise UnknownNameError("hand", name, f"the package {package}", _suggested(names(hands=True)))
    return None


def known_names() -> tuple[str, ...]:
    """Return the names in installed packages of hands that load; see `_LOADING`."""
    return (
        *(_suggested(_menagerie_names(hands=True)) if _installed(MENAGERIE) else ()),
        *(_suggested(_description_names(hands=True)) if _installed(DESCRIPTIONS) else ()),
    )


def _suggested(names: list[str]) -> list[str]:
    return [name for name in names if name in _LOADING]


def how_to_get_more() -> str:
    """Return the packages to install for hands by name; empty if both are installed."""
    return "" if _installed(MENAGERIE) and _installed(DESCRIPTIONS) else f"; more hands by name need {_INSTALL}"


def _installed(package: str) -> bool:
    return package in sys.modules or importlib.util.find_spec(package) is not None


def _menagerie_names(*, hands: bool) -> list[str]:
    menagerie = importlib.import_module(MENAGERIE)
    return [str(r.name) for r in menagerie.robots("end_effector" if hands else None)]


def _in_menagerie(name: str, entry: str) -> Path:
    menagerie = importlib.import_module(MENAGERIE)
    robot = menagerie.get(name)
    if entry and entry not in robot.entry_names:
        raise UnknownNameError("model", entry, f"'{name}' of {MENAGERIE}", robot.entry_names)
    try:
        return Path(robot.xml(entry or robot.default_model))
    except (menagerie.MenagerieError, OSError) as error:
        raise _unreachable(f"{name}/{entry}" if entry else name, error, "MENAGERIE_ROOT to a checkout") from None


def _description_names(*, hands: bool) -> list[str]:
    found: Any = importlib.import_module(DESCRIPTIONS).DESCRIPTIONS
    return [str(name) for name, d in found.items() if not hands or "end_effector" in d.tags]


def _in_descriptions(name: str, side: str) -> Path:
    module = _fetched_description(name)
    paths = {key: str(value) for key, value in vars(module).items() if key.startswith(("URDF_PATH", "MJCF_PATH"))}
    if not paths:
        raise HandError(f"Hand '{name}': {DESCRIPTIONS} has neither URDF nor MJCF of it that needs no other program.")
    sides = {key[len("URDF_PATH") :].lstrip("_").lower(): path for key, path in paths.items()}
    if side not in sides:
        raise UnknownNameError("model", side, f"'{name}' of {DESCRIPTIONS}", [key for key in sides if key])
    return Path(sides[side])


def _fetched_description(name: str) -> ModuleType:
    """Import the module of a description, which clones its repository; its output is dropped."""
    try:
        with contextlib.redirect_stdout(sys.stderr):
            return importlib.import_module(f"{DESCRIPTIONS}.{name}")
    except Exception as error:
        raise _unreachable(name, error, "ROBOT_DESCRIPTIONS_CACHE to a folder that has it") from None


def _unreachable(name: str, error: Exception, instead: str) -> HandError:
    why = " ".join(str(error).split())[:200]
    return HandError(
        f"Hand '{name}': its files are not here and cannot be fetched ({why}). "
        f"Try again with a network, or set {instead}."
    )
