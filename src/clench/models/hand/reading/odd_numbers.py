"""Refuse numbers in the text of a hand model that are no measurements: NaN, infinite, or far too large."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from pathlib import Path

from clench.core.exceptions import FileError
from clench.core.files.file_limits import MODEL_NUMBER

#: Attributes that hold names, which may look like numbers ("inf").
_NAMES = frozenset(
    (
        *(
            "name",
            "class",
            "childclass",
            "file",
            "filename",
            "link",
            "joint",
            "body",
            "geom",
            "site",
            "mesh",
            "material",
        ),
        *("texture", "hfield", "skin", "tendon", "actuator", "sensor", "camera", "target", "prefix", "model", "plugin"),
        *("joint1", "joint2", "body1", "body2", "geom1", "geom2", "site1", "site2", "tendon1", "tendon2", "slidersite"),
        *("jointinparent", "cranksite", "refsite", "sidesite", "objname", "refname", "reftype", "objtype", "user"),
        *("meshclass", "bodyinparent", "instance", "key", "value_text", "content_type", "dclass", "parent", "type"),
    )
)
#: Open limits are allowed here: infinite limits, and placeholders of any size, are reported where they matter.
_OPEN = frozenset(("effort", "velocity", "ctrlrange", "forcerange", "actfrcrange", "actuatorfrcrange", "actrange"))


def refuse_odd_numbers(root: ET.Element, path: Path) -> None:
    """Look at all numbers of a URDF or MJCF tree.

    Raises:
        FileError: a number that is NaN, infinite or too large, with its element and attribute.
    """
    waiting = [(root, "")]
    while waiting:
        element, owner = waiting.pop()
        name = element.get("name")
        here = f"<{element.tag}>{owner if name is None else f' {chr(39)}{name}{chr(39)}'}"
        for key, text in element.attrib.items():
            if key not in _NAMES and _is_odd(text, key in _OPEN):
                shown = text if len(text) <= 60 else f"{text[:57]}..."
                most = "" if key in _OPEN else f" up to {MODEL_NUMBER:g}"
                raise FileError(path, f"{here}: {key} '{shown}'; expected finite numbers{most}.")
        waiting.extend((child, owner if name is None else f" of '{name}'") for child in reversed(list(element)))


def _is_odd(text: str, is_open: bool) -> bool:
    """Return whether all words of a text are numbers, and one of them is no measurement."""
    try:
        numbers = [float(word) for word in text.split()]
    except ValueError:
        return False
    if is_open:
        return any(map(math.isnan, numbers))
    return not all(abs(number) <= MODEL_NUMBER for number in numbers)
