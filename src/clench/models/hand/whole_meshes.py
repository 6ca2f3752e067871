"""Have MuJoCo read every object of an OBJ file: it keeps the vertices of all, but the faces of the first alone."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Final

from .model_files import ModelText

#: Lines that begin another object or group.
_BEGINNING: Final = re.compile(rb"^[ \t]*[og](?:[ \t][^\n]*)?\r?(?:\n|\Z)", re.MULTILINE)


def with_whole_meshes(text: ModelText) -> ModelText:
    """Return a model whose OBJ files are of one object each, with the faces of all that they had."""
    parts = {key: data for key, data in text.assets.items() if key.lower().endswith(".obj")}
    joined = {key: _BEGINNING.sub(b"", data) for key, data in parts.items() if len(_BEGINNING.findall(data)) > 1}
    return replace(text, assets={**text.assets, **joined}) if joined else text
