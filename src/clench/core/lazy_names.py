"""Names of a package that are imported when they are first used."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable, Mapping, Sequence
from typing import Any

#: Public names that have another name now.
_RENAMED = {"Actuator": "Executor", "DrivenHand": "HardwareHand"}


def lazy_names(
    package: str, homes: Mapping[str, str], namespaces: Sequence[str] = (), modules: Sequence[str] = ()
) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """Return `__getattr__` and `__dir__` of a package.

    Args:
        package: its name. homes: the module that defines each name.
        namespaces: modules of the package whose names it has, too, without listing them. modules: other modules of the
            package that need no import by name.
    """

    def find(name: str) -> Any:
        module = sys.modules[package]
        if name in homes:
            value = getattr(importlib.import_module(homes[name]), name)
        elif name in namespaces or name in modules:
            return importlib.import_module(f"{package}.{name}")
        else:
            value = _in_namespaces(package, name, namespaces)
        setattr(module, name, value)
        return value

    def listed() -> list[str]:
        return sorted(sys.modules[package].__all__)

    return find, listed


def _in_namespaces(package: str, name: str, namespaces: Sequence[str]) -> Any:
    if not name.startswith("_"):
        for each in namespaces:
            module = importlib.import_module(f"{package}.{each}")
            if name in module.__all__:
                return getattr(module, name)
    has = f"it is called '{_RENAMED[name]}' now" if name in _RENAMED else _listed(package, namespaces)
    raise AttributeError(f"module '{package}' has no attribute '{name}'; {has}")


def _listed(package: str, namespaces: Sequence[str]) -> str:
    names = ", ".join(sorted(sys.modules[package].__all__))
    return f"it has: {names}" + (f"; and the namespaces {', '.join(namespaces)}" if namespaces else "")
