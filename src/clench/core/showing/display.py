"""Let objects show themselves in notebooks and browsers, although what draws them is in a higher layer.

Layers import downwards only. The root of the package, which knows all layers, registers the module that draws; it is
imported when something is displayed for the first time.
"""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

#: Name of the module that displays objects, once it is registered; it has functions `card` and `show`.
_module: list[str] = []


def register_display(module: str) -> None:
    """Name the module whose functions `card(value)` and `show(value, *scene)` display objects."""
    _module[:] = [module]


class Displayed:
    """An object with a card in notebooks: a picture, and a few words and numbers."""

    def _repr_html_(self) -> str | None:
        """Return the card that a notebook shows; None where nothing is registered that makes cards."""
        made: str | None = importlib.import_module(_module[0]).card(self) if _module else None
        return made


def show(value: object, *scene: Any) -> Path | None:
    """Show an object as a page: in a notebook as the output of the cell, elsewhere in the browser.

    Args:
        value: the object. scene: hand and object, where the value does not say which they are.

    Returns:
        the file that the browser opens; None in a notebook.
    """
    shown: Path | None = importlib.import_module(_module[0]).show(value, *scene)
    return shown
