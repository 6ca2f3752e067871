"""The states of a supervised hand, the events between them, and the stop that stays in force until released.

Nothing here talks to a driver. One thread executes a solution; any thread, and any signal handler, may stop it.
"""

from __future__ import annotations

import queue
import threading
import weakref
from collections.abc import Iterator
from contextlib import contextmanager
from enum import StrEnum
from typing import Final

from .driver import DriverError


class State(StrEnum):
    """Name the activity of a supervised hand."""

    IDLE = "idle"
    """Nothing is carried out, and an execution may begin."""
    PLANNING = "planning"
    """The controller is connected, and the whole motion is planned and checked. Nothing was sent yet."""
    MOVING = "moving"
    """The hand follows the trajectory."""
    SETTLING = "settling"
    """The trajectory has ended, and the joints arrive."""
    SQUEEZING = "squeezing"
    """The joints go beyond the touch."""
    PULLING = "pulling"
    """The tendons are told their tensions."""
    STEPPING = "stepping"
    """The hand goes to the next steps."""
    STOPPING = "stopping"
    """A stop was requested, and the execution is ending."""
    FAILING = "failing"
    """A fault stopped the hand, and the execution is ending, or a call of the driver has not returned."""
    STOPPED = "stopped"
    """A requested stop is in force. No execution begins before its release."""
    FAULTED = "faulted"
    """The stop after a fault is in force. No execution begins before its release."""


class Event(StrEnum):
    """Name the events that change the state."""

    BEGIN = "begin"
    MOVE = "move"
    SETTLE = "settle"
    SQUEEZE = "squeeze"
    PULL = "pull"
    STEP = "step"
    END = "end"
    STOP = "stop"
    FAULT = "fault"
    RELEASE = "release"


#: States in which commands may be sent, or are about to be.
ACTIVE: Final = (
    State.PLANNING,
    State.MOVING,
    State.SETTLING,
    State.SQUEEZING,
    State.PULLING,
    State.STEPPING,
)
#: Next state, by state and event. An event that is not here is refused in that state.
TRANSITIONS: Final[dict[tuple[State, Event], State]] = {
    (State.IDLE, Event.BEGIN): State.PLANNING,
    (State.PLANNING, Event.MOVE): State.MOVING,
    (State.MOVING, Event.SETTLE): State.SETTLING,
    **{(state, Event.SQUEEZE): State.SQUEEZING for state in (State.SETTLING,)},
    **{(state, Event.PULL): State.PULLING for state in (State.SETTLING, State.SQUEEZING)},
    **{(state, Event.STEP): State.STEPPING for state in ACTIVE[2:]},
    **{(state, Event.END): State.IDLE for state in (State.PLANNING, *ACTIVE[2:])},
    **{(state, Event.STOP): State.STOPPING for state in ACTIVE},
    **{(state, Event.FAULT): State.FAILING for state in ACTIVE},
    **{(state, event): state for state in (State.STOPPING, State.FAILING) for event in (Event.STOP, Event.FAULT)},
    (State.STOPPING, Event.END): State.STOPPED,
    (State.FAILING, Event.END): State.FAULTED,
    (State.IDLE, Event.STOP): State.STOPPED,
    (State.STOPPED, Event.STOP): State.STOPPED,
    (State.FAULTED, Event.STOP): State.FAULTED,
    **{(state, Event.RELEASE): State.IDLE for state in (State.IDLE, State.STOPPED, State.FAULTED)},
}
#: Sentence about a stop on request.
ON_REQUEST: Final = "Stopped on request."


class HandStoppedError(DriverError):
    """Say that a stop is in force, or that another execution is under way: nothing is sent."""


class ExecutionRefusedError(HandStoppedError):
    """Report why an execution does not begin; the driver was not called."""


_OWNER: Final = "owner"


class Supervision:
    """Keep the state of the hand of one driver, for all threads.

    The state consists of two facts: the activity of the executing thread, and the stop in force. Only the executing
    thread changes the activity. Any thread sets the second, with one assignment and without a lock, so that a signal
    handler may do so at any moment. Only `release` clears the stop, and never during an execution.
    """

    def __init__(self) -> None:
        # Taken with one call that cannot be interrupted half-way, so its owner always knows of it.
        self._owner: dict[str, object] = {}
        self._doing = State.IDLE
        self._stop: tuple[Event, str] | None = None
        self._wake: queue.SimpleQueue[None] = queue.SimpleQueue()
        #: The thread that hands a command over to the driver at this moment.
        self.sender: int | None = None

    @property
    def state(self) -> State:
        """The present activity of the hand."""
        stop, doing = self._stop, self._doing
        if stop is None:
            return doing
        if doing is State.IDLE:
            return State.STOPPED if stop[0] is Event.STOP else State.FAULTED
        return State.STOPPING if stop[0] is Event.STOP else State.FAILING

    @property
    def doing(self) -> State:
        """The activity of the execution, at present or when a stop ended it."""
        return self._doing

    @property
    def cause(self) -> str:
        """Why a stop is in force, in one sentence; empty when none is."""
        return "" if self._stop is None else self._stop[1]

    def begin(self, owner: object) -> None:
        """Begin an execution, which belongs to an owner until the owner ends it.

        Raises:
            ExecutionRefusedError: a stop is in force, or another execution is under way; the message gives the remedy.
        """
        if self._owner.setdefault(_OWNER, owner) is not owner:
            raise ExecutionRefusedError(
                f"The driver is already in use: another execution is {self.state}; wait until it has ended."
            )
        if self._stop is not None:
            cause = self.cause.rstrip(".")
            self.end(owner)
            raise ExecutionRefusedError(f"A stop is in force ({cause}); release it with release_stop().")
        while not self._wake.empty():
            self._wake.get()
        self._doing = TRANSITIONS[State.IDLE, Event.BEGIN]

    def enter(self, event: Event) -> None:
        """Go on to the next event of the execution.

        Raises:
            HandStoppedError: a stop is in force.
        """
        self.check()
        self._doing = TRANSITIONS[self._doing, event]

    def check(self) -> None:
        """Check that no stop is in force.

        Raises:
            HandStoppedError: one is; the message says why.
        """
        if self._stop is not None:
            raise HandStoppedError(self.cause)

    @contextmanager
    def sending(self) -> Iterator[None]:
        """Allow the calling thread to hand one command over.

        A stop that comes before is heeded here. A stop that comes later sees `sender`, and is told again afterwards.

        Raises:
            HandStoppedError: a stop is in force.
        """
        self.sender = threading.get_ident()
        try:
            self.check()
            yield
        finally:
            self.sender = None

    def stop(self, cause: str = ON_REQUEST) -> None:
        """Put a stop in force; the first one says why."""
        self._set(Event.STOP, cause)

    def fault(self, cause: str) -> None:
        """Put a stop in force because of a fault of the running execution, unless a stop is in force already."""
        self._set(Event.FAULT, cause)

    def end(self, owner: object) -> None:
        """End the execution of an owner; a stop stays in force. Nothing happens when it has ended before."""
        if self._owner.get(_OWNER) is owner:
            self._doing = State.IDLE
            del self._owner[_OWNER]

    def release(self) -> None:
        """Release the stop, so that executions may begin; do nothing without a stop.

        Raises:
            HandStoppedError: an execution is still under way, or a call of the driver has not returned.
        """
        owner = object()
        if self._owner.setdefault(_OWNER, owner) is not owner:
            raise HandStoppedError(
                f"The stop cannot be released yet: an execution is {self.state}, or a call of the driver has not "
                f"returned."
            )
        self._stop = None
        self.end(owner)

    def wait(self, seconds: float) -> None:
        """Wait for a time [s], or until a stop comes."""
        if self._stop is None and seconds > 0.0:
            try:
                self._wake.get(timeout=seconds)
            except queue.Empty:
                return

    def _set(self, event: Event, cause: str) -> None:
        if self._stop is None:
            self._stop = (event, cause)
        self._wake.put(None)


#: By the identity of the driver: the driver itself if it has no weak references, and its supervision.
_supervised: dict[int, tuple[object, Supervision]] = {}


def supervision_of(driver: object) -> Supervision:
    """Return the one supervision of a driver: whoever moves the hand through this driver shares it."""
    key = id(driver)
    if key not in _supervised:
        kept: object = None
        try:
            weakref.finalize(driver, _supervised.pop, key, None).atexit = False
        except TypeError:
            kept = driver
        _supervised.setdefault(key, (kept, Supervision()))  # another thread may have been faster
    return _supervised[key][1]
