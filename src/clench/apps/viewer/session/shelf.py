"""The hands and objects that the page offers: those that were given, and the built-in ones. No paths come from it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

from clench.core.exceptions import UnknownNameError
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import GraspObject


@dataclass(eq=False)
class Shelf:
    """Load hands and objects by the names that choosers show, each once.

    Args:
        hand_makers, object_makers: what loads each of them, by name.
        hand_models, object_models: what solutions name to load them again, where that is not the name.
        hand_code, object_code: Python that loads them, where that is not by name.
    """

    hand_makers: Mapping[str, Callable[[], Hand]]
    object_makers: Mapping[str, Callable[[], GraspObject]]
    hand_models: Mapping[str, str] = field(default_factory=dict)
    object_models: Mapping[str, str] = field(default_factory=dict)
    hand_code: Mapping[str, str] = field(default_factory=dict)
    object_code: Mapping[str, Sequence[str]] = field(default_factory=dict)
    _hands: dict[str, Hand] = field(default_factory=dict)
    _objects: dict[str, GraspObject] = field(default_factory=dict)

    def hand(self, name: str) -> Hand:
        """Return a hand.

        Raises:
            UnknownNameError: it is not offered. ClenchError: it cannot be loaded.
        """
        if name not in self._hands:
            if name not in self.hand_makers:
                raise UnknownNameError("hand", name, "the viewer", self.hand_makers)
            self._hands[name] = self.hand_makers[name]()
        return self._hands[name]

    def object(self, name: str) -> GraspObject:
        """Return an object; see `hand`."""
        if name not in self._objects:
            if name not in self.object_makers:
                raise UnknownNameError("object", name, "the viewer", self.object_makers)
            self._objects[name] = self.object_makers[name]()
        return self._objects[name]
