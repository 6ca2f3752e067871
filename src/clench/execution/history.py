"""What was told and what was measured while a solution was carried out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from clench.base.pose import FloatArray


@dataclass(frozen=True, eq=False)
class ExecutionHistory:
    """Hold samples of an execution.

    Args:
        joints: names of the joints that were read. times: from the first command [s], shape (N,).
        commanded, measured: angles [rad], shape (N, J).
    """

    joints: tuple[str, ...]
    times: FloatArray
    commanded: FloatArray
    measured: FloatArray

    def to_dict(self) -> dict[str, Any]:
        """Return the form that reports have."""
        return {
            "joints": list(self.joints),
            "times": self.times.tolist(),
            "commanded": self.commanded.tolist(),
            "measured": self.measured.tolist(),
        }
