"""Hands and objects of units: loaded once per process, with their hashes and their licences."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Final

from clench.core.exceptions import FileError
from clench.core.files.file_bytes import expanded, read_text
from clench.execution.simulation.convex_pieces import in_pieces
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import GraspObject

#: Names of licence files beside a model.
LICENSES: Final = ("LICENSE", "LICENSE.txt", "LICENSE.md", "LICENCE", "LICENCE.txt", "COPYING")
#: The largest licence that is read [bytes], and the longest first line that is quoted.
_LICENSE_BYTES: Final = 1 << 20
_LINE: Final = 100


@dataclass(frozen=True)
class HandSource:
    """A hand as a dataset describes it once for all rows.

    Args:
        name, model: of the hand. joints, links: names, in the order of the rows' numbers.
        license: see `license_beside`.
    """

    name: str
    model: str
    joints: tuple[str, ...]
    links: tuple[str, ...]
    license: str | None


@lru_cache(maxsize=2)
def load_hand(model: str) -> Hand:
    """Return a hand; the last two are kept."""
    return Hand.load(model)


@lru_cache(maxsize=4)
def load_object(model: str, scale: float, pieces: bool) -> GraspObject:
    """Return an object, in convex pieces if asked; the last four are kept."""
    obj = GraspObject.load(model, scale=scale)
    return in_pieces(obj) if pieces else obj


def hand_source(hand: Hand, model: str) -> HandSource:
    """Return a dataset's description of a hand."""
    links = tuple(link.name for link in hand.links)
    return HandSource(hand.name, model, tuple(hand.joint_names), links, license_beside(model))


@lru_cache(maxsize=64)
def license_beside(model: str) -> str | None:
    """Return name and first line of the licence in the folder of a model's file, or None."""
    path = expanded(model)
    try:
        if not path.is_file():
            return None
        for name in LICENSES:
            if (path.parent / name).is_file():
                return _described(path.parent / name)
    except OSError:
        return None
    return None


def _described(file: Path) -> str:
    try:
        lines = (line.strip() for line in read_text(file, _LICENSE_BYTES).splitlines())
        first = next((line for line in lines if line), "")
    except FileError:
        first = ""
    return f"{file.name}: {first[:_LINE]}" if first else file.name
