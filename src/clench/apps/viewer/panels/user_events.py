"""Separate changes by the user in the page from changes by the program."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any


def when_set(widget: Any, act: Callable[[Any], None]) -> None:
    """Call a function with the value of a widget whenever a user, not the program, changes it."""

    def told(event: Any) -> None:
        if event.client is not None:
            act(widget.value)

    widget.on_update(told)
