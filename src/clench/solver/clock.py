"""The times of a solve's stages."""

from __future__ import annotations

import time


class Clock:
    """Time the stages of a solve [s]."""

    def __init__(self) -> None:
        self._last = time.perf_counter()
        self._stages: dict[str, float] = {}

    def lap(self, stage: str) -> None:
        """Add the time since the last lap under a name."""
        now = time.perf_counter()
        self._stages[stage] = self._stages.get(stage, 0.0) + now - self._last
        self._last = now

    def stages(self) -> dict[str, float]:
        """Return the stages, with their total."""
        return {**self._stages, "total": sum(self._stages.values())}
