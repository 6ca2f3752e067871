"""One execution on a driver: the only access to the hand, with the count of everything sent."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from clench.core.pose import FloatArray

from .driver import (
    DriverLimits,
    HandDriver,
    HandState,
    JointPath,
    TendonDriver,
    connected_joints,
    connected_limits,
    read_state,
)
from .driver_line import DriverLine
from .supervision import Event, Supervision, supervision_of

#: Number of attempts to stop the hand when the driver fails.
STOP_TRIES = 2
#: Number of interrupts that a stop survives.
INTERRUPTS = 10


@dataclass
class Sent:
    """The count of messages sent to the hand.

    Args:
        commands: that the driver took. unconfirmed: handed to the driver, which failed: they may have reached the hand.
        last: where the last one of either kind led the joints, by the controller's names and units.
        first_at, last_at: when the first and the last one were handed over, by the monotonic clock [s].
        tensions: whether tensions of tendons were handed over.
    """

    commands: int = 0
    unconfirmed: int = 0
    last: Mapping[str, float] | None = None
    first_at: float = math.nan
    last_at: float = math.nan
    tensions: bool = False

    def begin(self, path: JointPath, now: float) -> None:
        """Count a path that is handed over at a time of the monotonic clock [s]."""
        self.unconfirmed += 1
        self.last = dict(zip(path.joints, path.positions[-1].tolist(), strict=True))
        self.last_at = now
        if math.isnan(self.first_at):
            self.first_at = now

    def confirm(self) -> None:
        """Count that the driver took it."""
        self.unconfirmed -= 1
        self.commands += 1

    @property
    def anything(self) -> bool:
        """Whether anything was handed over to the driver."""
        return bool(self.commands or self.unconfirmed or self.tensions)


class DriverSession:
    """Use a driver for one execution: no command passes once a stop is in force, and every one is counted."""

    def __init__(self, driver: HandDriver) -> None:
        self.driver = driver
        self.supervision: Supervision = supervision_of(driver)
        self.sent = Sent()
        self._line = DriverLine(driver)
        #: The exception that interrupted the stop of the hand.
        self.interrupt: BaseException | None = None
        self._disconnected = False

    def begin(self) -> None:
        """Begin; `close` ends the session in every case.

        Raises:
            ExecutionRefusedError: a stop is in force, or another execution uses the driver.
        """
        self.supervision.begin(self)
        self._line.start()

    @property
    def failed(self) -> bool:
        """Whether the driver failed in a way that leaves the motion of the hand unknown."""
        return self._line.failed

    def connect(self, timeout: float) -> None:
        """Find the controller, within a time [s], which is the driver's to keep."""
        self._line.call("connect", lambda: self.driver.connect(timeout), limit=None)
        self.supervision.check()

    def joints(self) -> tuple[str, ...]:
        """Return the names of the joints that the controller has."""
        return self._line.call("joints", lambda: connected_joints(self.driver))

    def limits(self) -> DriverLimits:
        """Return the limits of the controller."""
        return self._line.call("limits", lambda: connected_limits(self.driver))

    def read(self) -> HandState:
        """Return the newest state."""
        return self._line.call("read", lambda: read_state(self.driver))

    def enter(self, event: Event) -> None:
        """Go on to the next event of the execution, unless a stop is in force."""
        self.supervision.enter(event)

    def command(self, path: JointPath, now: float) -> None:
        """Send a path at a time of the monotonic clock [s], unless a stop is in force."""

        def send() -> None:
            with self.supervision.sending():
                self.sent.begin(path, now)
                self.driver.command(path)
                self.sent.confirm()

        self._line.call("command", send)

    def pull(self, tensions: FloatArray) -> None:
        """Send tensions of tendons [N], unless a stop is in force, or the driver pulls no tendons."""

        def send() -> None:
            if isinstance(self.driver, TendonDriver):
                with self.supervision.sending():
                    self.sent.tensions = True
                    self.driver.pull(tensions)

        self._line.call("pull", send)

    def wait(self, seconds: float) -> None:
        """Wait for a time [s], or until a stop comes."""
        self.supervision.wait(seconds)

    def stop(self) -> str:
        """Tell the hand to stop, and repeat if the driver fails; return the failure, or nothing.

        An interrupt does not keep the hand from being told; it is in `interrupt` afterwards.
        """
        failures: list[str] = []
        for _ in range(INTERRUPTS):
            try:
                self._line.stop()
            except BaseException as error:
                self.keep_interrupt(error)
                if not self._line.left:  # else the driver did not fail, and is still being told
                    failures.append(str(error) if isinstance(error, Exception) else type(error).__name__)
                if len(failures) == STOP_TRIES:
                    break
            else:
                return ""
        return failures[-1] if failures else "interrupted"

    def keep_interrupt(self, error: BaseException) -> None:
        """Keep an interrupt, to be raised once the hand was stopped; do nothing with an `Exception`."""
        if not isinstance(error, Exception):
            self.interrupt = error

    def close(self, *, disconnect: bool) -> None:
        """End the execution; a call that the driver has not returned from ends it when it returns."""
        if disconnect and not self._disconnected:
            self._disconnected = True  # an interrupt leads here again
            self._line.disconnect()
        self._line.close(lambda: self.supervision.end(self))
