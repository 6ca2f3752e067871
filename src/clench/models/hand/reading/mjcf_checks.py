"""Refuse MJCF of a few lines that stands for gigabytes: copies, grids, pictures and arrays of a given size."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Final

from clench.core.exceptions import FileError
from clench.core.files.file_limits import MODEL_PARTS, PICTURE_PIXELS

#: Elements whose count says how many copies of something are made.
_COPIES: Final = ("replicate", "composite", "flexcomp")
#: Elements that take room for each of the numbers named, all multiplied.
_AREAS: Final = {"texture": ("width", "height"), "hfield": ("nrow", "ncol")}
#: Attributes that ask MuJoCo for so many numbers each, for every part or for the whole model.
_COUNTS: Final = ("dim", "nsample", "actdim", "nkey", "offwidth", "offheight", "shadowsize", "resolution")
_COUNT: Final = 65_536
#: Sizes of the whole model in MuJoCo's `size` element.
_SIZES: Final = 1 << 27
_MEMORY: Final = 1 << 30
_UNITS: Final = {"K": 10, "M": 20, "G": 30, "T": 40, "P": 50, "E": 60}
#: Faces of a texture: one for each side of a cube.
_SIDES: Final = 6


def check_mjcf(root: ET.Element, path: Path) -> None:
    """Look at everything in an MJCF tree that makes MuJoCo take room.

    Raises:
        FileError: with the element and the largest value.
    """
    for asset in root.iter("asset"):
        if asset.find("model") is not None:
            raise FileError(path, "attaches another model (<asset><model>); expected one model, or <include>.")
    parts = _parts(root)
    if parts > MODEL_PARTS:
        raise FileError(path, f"makes {parts:.6g} parts with its copies; expected up to {MODEL_PARTS}.")
    for element in root.iter():
        where = f"<{element.tag}> '{element.get('name', '')}'"
        if element.tag in _AREAS:
            area = math.prod(_count(element, key) for key in _AREAS[element.tag])
            if area * (_SIDES if element.tag == "texture" else 1) > PICTURE_PIXELS * _SIDES:
                raise FileError(path, f"{where}: {area:.6g} points; expected up to {PICTURE_PIXELS}.")
        for key in element.attrib:
            if key in _COUNTS and _count(element, key) > _COUNT:
                raise FileError(path, f"{where}: {key} '{element.get(key)}'; expected up to {_COUNT}.")
        if element.tag == "size":
            _check_size(element, path)


def _parts(element: ET.Element) -> float:
    """Return how many elements a tree has when all copies are made."""
    inside = 1.0 + sum(_parts(child) for child in element)
    if element.tag not in _COPIES:
        return inside
    return inside * max(_count(element, "count"), 1.0)


def _count(element: ET.Element, key: str) -> float:
    """Return the product of the whole numbers of an attribute; 1 for an empty one, which MuJoCo will refuse."""
    try:
        return math.prod(max(float(word), 1.0) for word in element.get(key, "1").split())
    except ValueError:
        return 1.0


def _check_size(element: ET.Element, path: Path) -> None:
    for key, text in element.attrib.items():
        number, unit = (text[:-1], text[-1]) if text[-1:].upper() in _UNITS else (text, "")
        try:
            value = float(number) * 2.0 ** _UNITS.get(unit.upper(), 0)
        except ValueError:
            continue  # MuJoCo says what is wrong
        most = _MEMORY if key == "memory" else _COUNT if key.startswith(("nuser_", "nkey")) else _SIZES
        if not value <= most:
            raise FileError(path, f"<size>: {key} '{text}'; expected up to {most}.")
