"""Load a hand: read its files, and take what they make from disk or make it."""

from __future__ import annotations

from pathlib import Path

from clench.core.exceptions import UnknownNameError
from clench.models.hand.reading.model_files import read_model
from clench.models.hand.reading.whole_meshes import with_whole_meshes
from clench.models.shapes import CollisionSource

from .hand import Hand
from .hand_file import HandFile, find_hand_file
from .kept_hand import kept_hand


def load_hand(
    model: str | Path,
    *,
    hand_file: str | Path | None = None,
    palm: str | None = None,
    collision_source: CollisionSource | str | None = None,
) -> Hand:
    """Read a hand; arguments and errors as `Hand.load`.

    Args:
        model: built-in name or path. hand_file: TOML overrides. palm: the palm link's name.
        collision_source: the geometry to use unless a command names one.
    """
    text = with_whole_meshes(read_model(model))
    overrides = find_hand_file(text.path, hand_file or text.hand_file)
    source, named = _source(collision_source, overrides), palm or overrides.palm

    def make() -> Hand:
        # A hand from disk needs neither MuJoCo nor what understands models.
        from .hand_making import make_hand

        return make_hand(text, overrides, named, source)

    return kept_hand(text, overrides, named, source, make)


def _source(given: CollisionSource | str | None, overrides: HandFile) -> CollisionSource:
    if given is None:
        return overrides.collision_source or CollisionSource.ENGINE
    names = [str(s) for s in CollisionSource]
    if str(given) not in names:
        raise UnknownNameError("collision source", str(given), "the collision sources", names)
    return CollisionSource(given)
