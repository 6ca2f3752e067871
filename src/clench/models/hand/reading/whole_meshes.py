"""Have MuJoCo read every object of an OBJ file: it keeps the vertices of all, but the faces of the first alone."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from .model_files import ModelText


def with_whole_meshes(text: ModelText) -> ModelText:
    """Return a model whose OBJ files have one object each, with the faces of all their objects."""
    parts = {key: data for key, data in text.assets.items() if key.lower().endswith(".obj")}
    found = {key: list(_beginnings(data)) for key, data in parts.items()}
    joined = {key: _commented(parts[key], places) for key, places in found.items() if len(places) > 1}
    return replace(text, assets={**text.assets, **joined}) if joined else text


def _beginnings(data: bytes) -> Iterator[int]:
    """Yield where lines are that begin an object or a group; both letters are rare, so looking for them is fast."""
    for letter in (b"o", b"g"):
        place = data.find(letter)
        while place >= 0:
            before, after = data[max(place - 1, 0) : place], data[place + 1 : place + 2]
            if before in (b"", b"\n", b"\r") and after in (b"", b" ", b"\t", b"\n", b"\r"):
                yield place
            place = data.find(letter, place + 1)


def _commented(data: bytes, places: list[int]) -> bytes:
    changed = bytearray(data)
    for place in places:
        changed[place] = ord("#")
    return bytes(changed)
