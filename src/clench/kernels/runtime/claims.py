"""Let processes that compile at the same time share the work: one compiles a kernel, the others wait and load it.

A claim is a file in a folder that the processes share, for as long as its kernel is compiled. A process waits for
kernels that its own kernel calls only, so no two processes wait for each other.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Final

#: A claim counts for this long [s].
PATIENCE: Final = 300.0
#: How long to sleep between two looks at a claim [s].
_PAUSE: Final = 0.02
#: How names of files end that say that a job is taken, and that it is done.
_JOB, _DONE = ".job", ".done"


class Claims:
    """The claims of the processes that compile at the same time; at first there is one process."""

    def __init__(self) -> None:
        self.share(None)

    def share(self, folder: Path | None, all_live: Callable[[], bool] = lambda: True) -> None:
        """Share kernels with other processes from here on.

        Args:
            folder: for the files; None ends it. all_live: says whether the others still work.
        """
        self.folder, self._all_live = folder, all_live

    def note_done(self, name: str) -> None:
        """Say to all processes that a job is done."""
        if self.folder is not None:
            with suppress(OSError):
                (self.folder / f"{name}{_DONE}").touch()

    def count_done(self) -> int:
        """Return how many jobs are done, by all processes."""
        return 0 if self.folder is None else len(list(self.folder.glob(f"*{_DONE}")))

    def take_job(self, name: str) -> bool:
        """Take a job; return whether no process had done so."""
        return self._take(f"{name}{_JOB}")

    @contextmanager
    def alone(self, name: str) -> Iterator[None]:
        """Wait until no other process compiles a kernel, and keep them from it; a dead process holds up nobody long."""
        mine = self._take(name)
        end = time.monotonic() + PATIENCE
        while not mine and time.monotonic() < end and self._all_live():
            time.sleep(_PAUSE)
            mine = self._take(name)
        try:
            yield
        finally:
            if mine and self.folder is not None:
                with suppress(OSError):
                    (self.folder / name).unlink()

    def _take(self, name: str) -> bool:
        """Claim a kernel; return whether nobody else had done so. Without a folder, none is shared."""
        if self.folder is None:
            return True
        try:
            os.close(os.open(self.folder / name, os.O_CREAT | os.O_EXCL | os.O_WRONLY))
        except FileExistsError:
            return False
        except OSError:
            self.folder = None
        return True


#: Of this process.
CLAIMS: Final = Claims()
