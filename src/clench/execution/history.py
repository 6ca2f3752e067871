"""The history of an execution: commands sent, targets and measurements."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

from clench.core.pose import FloatArray
from clench.core.showing.short_repr import short_repr


@dataclass(frozen=True, eq=False)
class ExecutionHistory:
    """Commanded and measured angles of an execution over time.

    Args:
        joints: names of the joints that were read. times: from the first command [s], shape (N,).
        commanded, measured: angles [rad], shape (N, J).
    """

    joints: tuple[str, ...]
    times: FloatArray
    commanded: FloatArray
    measured: FloatArray

    __repr__ = short_repr

    def to_dict(self) -> dict[str, Any]:
        """Return the form that reports have."""
        return {
            "joints": list(self.joints),
            "times": self.times.tolist(),
            "commanded": self.commanded.tolist(),
            "measured": self.measured.tolist(),
        }


@dataclass(frozen=True)
class CommandsSent:
    """The count of commands sent to a controller.

    Args:
        commands: that the driver took.
        unconfirmed: that were handed to the driver when it failed; the hand may have them.
        last: where the last one of either kind led the joints [rad]; empty without one.
        time: when that was handed over, after the first one [s]; None without one.
        tensions: whether tensions of tendons were handed over.
    """

    commands: int = 0
    unconfirmed: int = 0
    last: Mapping[str, float] = field(default_factory=dict)
    time: float | None = None
    tensions: bool = False

    __repr__ = short_repr

    def text(self) -> str:
        """Say it in a sentence."""
        if self.time is None:
            return "No command was sent."
        count = "1 command was sent" if self.commands == 1 else f"{self.commands} commands were sent"
        more = " The last one was handed to the driver, which failed; the hand may have it." * bool(self.unconfirmed)
        return f"{count}; the last one came {self.time:.2f} s after the first.{more}"

    def to_dict(self) -> dict[str, Any]:
        """Return the form that reports have."""
        return asdict(self)
