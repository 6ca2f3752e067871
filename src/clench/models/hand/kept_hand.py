"""Hands on disk: compiled and understood once, and known in later processes without MuJoCo.

A file has all that is found out about a hand, in the form of `core/caching/kept_arrays.py`. Model, meshes and hand file
are read and checked every time, and their content is part of the key.
"""

from __future__ import annotations

import hashlib
import importlib.util
import os
import sys
import warnings
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from threading import Lock
from typing import Any, Final

from clench.core.caching.fingerprint import fingerprint
from clench.core.caching.kept_arrays import Arrays, arrays_of
from clench.core.caching.number_code import number_code
from clench.core.caching.plain_values import as_arrays, from_arrays
from clench.core.pose import Pose
from clench.models.hand.reading.model_files import ModelText
from clench.models.hand.reading.tendons import TendonMap
from clench.models.mesh import TriangleMesh
from clench.models.shapes import CollisionSource, Shape, ShapeKind

from .findings import Finding, FindingCode, Severity
from .hand import Coupling, Finger, Hand, Joint, JointRole, Link
from .hand_file import HandFile

#: The value of this environment variable that switches the files off is "0".
SWITCH: Final = "CLENCH_HAND_CACHE"
#: The classes of a hand's parts.
CLASSES: Final[dict[str, type[Any]]] = {
    kind.__name__: kind
    for kind in (
        *(Hand, Link, Joint, Coupling, Finger, Finding, TendonMap, Shape, TriangleMesh, Pose),
        *(JointRole, CollisionSource, ShapeKind, FindingCode, Severity),
    )
}
_ONE_AT_A_TIME: Final = Lock()
#: Where Python notes which warnings it has shown.
_SHOWN: Final[dict[Any, Any]] = {}


def kept_hand(
    text: ModelText,
    overrides: HandFile,
    palm: str | None,
    source: CollisionSource,
    make: Callable[[], Hand],
) -> Hand:
    """Return the hand on disk, or else make it, and write it.

    What is read is equal to what was made, to the bit. A hand that cannot be written, or whose making warns of
    something, is made every time.

    Args:
        text, overrides, palm, source: all that the hand depends on. make: returns it.
    """
    if os.environ.get(SWITCH, "1") == "0":
        return make()
    made: list[Hand] = []

    def written() -> Arrays:
        hand, warned = _made(make)
        made.append(hand)
        if warned:
            return []
        try:
            return as_arrays(replace(made[0], path=None, assets={}), CLASSES)
        except (TypeError, ValueError):
            return []

    arrays = arrays_of(hand_key(text, overrides, palm, source), written)
    if made:
        return made[0]
    try:
        found = from_arrays(arrays, CLASSES)
    except ValueError:
        found = None
    return replace(found, path=text.path, assets=text.assets) if isinstance(found, Hand) else make()


def _made(make: Callable[[], Hand]) -> tuple[Hand, bool]:
    """Return a new hand, and whether its making warned of something; warnings are passed on."""
    said: list[warnings.WarningMessage] = []
    try:
        # Python's list of warnings belongs to all threads.
        with _ONE_AT_A_TIME, warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always", UserWarning)
            hand = make()
    finally:
        for each in said:
            warnings.warn_explicit(each.message, each.category, each.filename, each.lineno, registry=_SHOWN)
    return hand, bool(said)


def hand_key(text: ModelText, overrides: HandFile, palm: str | None, source: CollisionSource) -> str:
    """Return the hash of everything that a hand depends on, hexadecimal."""
    assets = {name: hashlib.sha256(content).hexdigest() for name, content in text.assets.items()}
    model = replace(text, path=None, hand_file=None, assets=assets)  # type: ignore[arg-type]
    files = [str(path) for path in (text.path, text.hand_file, overrides.path)]
    return fingerprint("hand", _made_by(), model, replace(overrides, path=None), files, palm, str(source))


@cache
def _made_by() -> str:
    """Return a hash of what makes hands: sources, versions and the processor."""
    root = Path(__file__).parents[2]
    sources = sorted(file for layer in ("core", "models") for file in (root / layer).rglob("*.py"))
    digest = hashlib.sha256()
    for file in sources:
        content = file.read_bytes()
        digest.update(f"|{file.relative_to(root).as_posix()} {len(content)}|".encode() + content)
    return fingerprint(digest.hexdigest(), number_code(), sys.version, _files_of("mujoco"))


def _files_of(package: str) -> list[str]:
    """Return names, sizes and times of a package's own files: they tell its version without loading it."""
    spec = importlib.util.find_spec(package)
    if spec is None or spec.origin is None:
        return []
    with os.scandir(Path(spec.origin).parent) as entries:
        states = [(entry.name, entry.stat()) for entry in entries if entry.is_file()]
    return sorted(f"{name} {state.st_size} {state.st_mtime_ns}" for name, state in states)
