"""Remember hand and object of recent solutions, so that a caller can draw a solution without giving them again."""

from __future__ import annotations

from collections import OrderedDict
from threading import Lock
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from clench.models.hand.hand import Hand
    from clench.models.objects.grasp_object import GraspObject

#: So many pairs are kept.
_KEPT: Final = 4
_scenes: OrderedDict[str, tuple[Hand, GraspObject]] = OrderedDict()
_lock: Final = Lock()


def remember_scene(geometry_hash: str, hand: Hand, obj: GraspObject) -> None:
    """Keep hand and object of a geometry; of many, the latest few."""
    with _lock:
        _scenes[geometry_hash] = hand, obj
        _scenes.move_to_end(geometry_hash)
        if len(_scenes) > _KEPT:
            _scenes.popitem(last=False)


def recent_scene(geometry_hash: str) -> tuple[Hand, GraspObject] | None:
    """Return hand and object of a geometry, if they are among the latest few."""
    return _scenes.get(geometry_hash)
