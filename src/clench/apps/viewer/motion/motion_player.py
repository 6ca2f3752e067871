"""Play a motion at some speed, stop it anywhere, and let go of it when the user drags."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Final

from .motion_track import Frame, MotionTrack

#: Pictures per second.
RATE: Final = 30.0


class MotionPlayer:
    """Show the frames of a track, one after another.

    Args:
        show: is called with every frame, and with the share of the track that is over [-].
    """

    def __init__(self, show: Callable[[Frame, float], None]) -> None:
        self._show = show
        self._lock = threading.RLock()
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None
        self._time = 0.0
        self.track: MotionTrack | None = None
        self.speed = 1.0

    @property
    def is_playing(self) -> bool:
        """Whether frames follow each other now."""
        return self._thread is not None and self._thread.is_alive()

    def load(self, track: MotionTrack | None) -> None:
        """Take another track, from its start; None: nothing to play."""
        self.pause()
        self.track, self._time = track, 0.0

    def play(self) -> None:
        """Go on from where it is; from the start when it is over."""
        self.pause()
        if self.track is None:
            return
        if self._time >= self.track.duration - 1e-6:
            self._time = 0.0
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, args=(self._stop,), name="clench-player", daemon=True)
        self._thread.start()

    def pause(self) -> None:
        """Stop where it is."""
        self._stop.set()
        if self._thread is not None and self._thread is not threading.current_thread():
            self._thread.join(timeout=5.0)
        self._thread = None

    def go_to(self, share: float) -> None:
        """Stop, and show the frame at a share of the track [-]."""
        self.pause()
        if self.track is not None:
            self._time = share * self.track.duration
            self._show(self.track.at(self._time), share)

    def _run(self, stop: threading.Event) -> None:
        track = self.track
        assert track is not None
        last = time.perf_counter()
        while not stop.is_set():
            self._show(track.at(self._time), self._time / track.duration if track.duration else 1.0)
            if self._time >= track.duration:
                return
            stop.wait(max(0.0, last + 1.0 / RATE - time.perf_counter()))
            now = time.perf_counter()
            self._time = min(self._time + self.speed * (now - last), track.duration)
            last = now
