"""Call a driver in a thread of its own, so that a call that does not return delays neither a stop nor the report."""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any, Final, TypeVar

from clench.core.exceptions import ClenchError

from .driver import DriverError, HandDriver

#: Time limit of a driver's call, except `connect` and `disconnect` [s].
CALL_LIMIT: Final = 1.0
#: Time limit of `disconnect` [s].
LEAVING_LIMIT: Final = 5.0
#: Time that a stop waits for a call that an interrupt left alone [s]: two messages on one line would mix.
SHORTLY: Final = 0.1

#: Calls whose failure leaves the motion of the hand unknown.
MOVING_CALLS: Final = ("read", "command", "pull", "stop")

#: Function to call when an abandoned call returns after all, if it is not `stop` alone.
_WHEN_LATE: Final = {"connect": ("stop", "disconnect"), "disconnect": ()}

T = TypeVar("T")


@dataclass(eq=False)
class Call:
    """One call of a driver, and its outcome once it has returned.

    Args:
        what: name of the driver's method. function: the function to run. returned: whether it has returned.
        result, error: its return value, or its exception. abandoned: whether its caller gave up waiting.
    """

    what: str
    function: Callable[[], Any]
    returned: bool = False
    result: Any = None
    error: BaseException | None = None
    abandoned: bool = False
    _wake: queue.SimpleQueue[None] = field(default_factory=queue.SimpleQueue)

    def run(self) -> None:
        """Run the function, and wake who waits."""
        try:
            self.result = self.function()
        except BaseException as error:
            self.error = error
        self.returned = True
        self._wake.put(None)

    def wait(self, limit: float | None) -> bool:
        """Wait until it has returned, at most so long [s]; return whether it has. An interrupt loses nothing."""
        with suppress(queue.Empty):
            if not self.returned:
                self._wake.get(timeout=limit)
        return self.returned


class DriverLine:
    """Call a driver, one call after the other, from one thread.

    The caller waits for at most `CALL_LIMIT`. A call that has not returned by then is abandoned. After that, the driver
    is called only to stop and to disconnect, in further threads. When the abandoned call returns after all, the hand is
    told to stop once more: the call may have been a command.
    """

    def __init__(self, driver: HandDriver) -> None:
        self._driver = driver
        self._calls: queue.SimpleQueue[Call | None] = queue.SimpleQueue()
        self._under_way: Call | None = None
        self._abandoning = threading.Lock()
        self._freed: Callable[[], None] = lambda: None
        self._closing = False
        #: The driver's method that has not returned, or empty.
        self.stuck = ""
        #: Whether one of `MOVING_CALLS` failed.
        self.failed = False
        self._thread = threading.Thread(target=self._serve, name="clench driver", daemon=True)

    def start(self) -> None:
        """Begin to serve calls."""
        self._thread.start()

    def call(self, what: str, function: Callable[[], T], limit: float | None = CALL_LIMIT) -> T:
        """Run a function that calls the driver, and return its result.

        Args:
            what: name of the driver's method. function: runs in the thread of this line.
            limit: how long it may take [s]; None: without end.

        Raises:
            DriverError: it raised an `Exception`, or took too long. BaseException: any other exception of the function.
        """
        if self.stuck:
            raise DriverError(f"The driver has not returned from {self.stuck}().")
        if self._closing:
            raise DriverError("The execution has ended.")
        call = Call(what, function)
        self._calls.put(call)
        self._under_way = call
        result: T = self._answer(call, limit)
        return result

    @property
    def left(self) -> bool:
        """Whether an interrupt left a call alone, which goes on."""
        return self._under_way is not None

    def stop(self) -> None:
        """Tell the hand to stop, in spite of a call that does not return.

        Raises:
            DriverError: the driver failed. BaseException: any other exception of the driver.
        """
        self._aside("stop", CALL_LIMIT)

    def disconnect(self) -> None:
        """Let the controller go, however that ends."""
        with suppress(Exception):
            self._aside("disconnect", LEAVING_LIMIT)

    def close(self, freed: Callable[[], None]) -> None:
        """Call the driver no more; `freed` is called once the last call has returned, however late that is.

        An interrupted `close` may be called again; `freed` is then called more than once.
        """
        self._freed = freed
        self._closing = True
        self._calls.put(None)
        if not self._thread.is_alive():
            freed()
        elif not self.stuck:
            self._thread.join(CALL_LIMIT)

    def _aside(self, what: str, limit: float) -> None:
        """Call a method in turn, or in a further thread when the turn does not come."""
        left, self._under_way = self._under_way, None
        if left is not None and not self.stuck:  # an interrupt left it alone
            with suppress(Exception):
                self._answer(left, SHORTLY)
        if self._thread.is_alive() and not (self.stuck or self._closing):
            self.call(what, getattr(self._driver, what), limit)
            return
        call = Call(what, getattr(self._driver, what))
        threading.Thread(target=call.run, name=f"clench {what}", daemon=True).start()
        if not call.wait(limit):
            raise DriverError(f"{what}() of the driver has not returned after {limit:g} s.")
        if call.error is not None:
            raise _as_driver_error(call.error, what)

    def _answer(self, call: Call, limit: float | None) -> Any:
        if not call.wait(limit):
            self._under_way = None
            self.failed |= call.what in MOVING_CALLS
            with self._abandoning:
                call.abandoned = True
                if not call.returned:
                    self.stuck = call.what
            raise DriverError(f"{call.what}() of the driver has not returned after {limit:g} s.")
        self._under_way = None
        if call.error is not None:
            self.failed |= call.what in MOVING_CALLS
            raise _as_driver_error(call.error, call.what)
        return call.result

    def _serve(self) -> None:
        while (call := self._calls.get()) is not None:
            call.run()
            with self._abandoning:
                if not call.abandoned:
                    continue
            for late in _WHEN_LATE.get(call.what, ("stop",)):
                with suppress(BaseException):
                    getattr(self._driver, late)()
            self.stuck = ""
        self._freed()


def _as_driver_error(error: BaseException, what: str) -> BaseException:
    """Return the exception for an error of a driver: one kind for all its failures, others unchanged."""
    if isinstance(error, DriverError) or not isinstance(error, Exception):
        return error
    if isinstance(error, ClenchError):
        return error if what == "connect" else DriverError(str(error))
    told = DriverError(f"The driver failed ({type(error).__name__}: {error}).")
    told.__cause__ = error
    return told
