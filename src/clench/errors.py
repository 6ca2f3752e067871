"""The exceptions that clench raises for malformed input."""

from __future__ import annotations

from typing import TYPE_CHECKING

from clench.core.lazy_names import lazy_names

if TYPE_CHECKING:
    from clench.core.exceptions import ClenchError, CommandError, FileError, HandError, ObjectError, UnknownNameError
    from clench.execution.hardware.driver import DriverError

_HOMES = {
    "ClenchError": "clench.core.exceptions",
    "CommandError": "clench.core.exceptions",
    "DriverError": "clench.execution.hardware.driver",
    "FileError": "clench.core.exceptions",
    "HandError": "clench.core.exceptions",
    "ObjectError": "clench.core.exceptions",
    "UnknownNameError": "clench.core.exceptions",
}

__all__ = [
    "ClenchError",
    "CommandError",
    "DriverError",
    "FileError",
    "HandError",
    "ObjectError",
    "UnknownNameError",
]

__getattr__, __dir__ = lazy_names(__name__, _HOMES)
