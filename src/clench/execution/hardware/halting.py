"""Stop a hand, check whether it stands still, and report the known state."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from typing import Final

from .command_check import CommandCheck
from .driver import HandState
from .driver_session import DriverSession
from .following import HORIZON, PERIOD, Followed

#: Time to wait for a hand to stand still after a stop [s].
STOP_WAIT: Final = 1.0
#: A joint stands still when it is slower than this fraction of its largest speed [-].
STILL: Final = 0.05
#: Interval between checks, and largest age of a state for them [s].
_LOOK: Final = 2.0 * PERIOD


@dataclass(frozen=True)
class Halted:
    """The outcome of a stop: whether the hand was told, and whether it stands still.

    Args:
        untold: why the driver could not tell the hand to stop, empty when it did.
        still: whether the hand was seen to stand still afterwards; None when it was not looked at.
        tensions: whether its tendons were told tensions before.
    """

    untold: str
    still: bool | None
    tensions: bool

    def text(self) -> str:
        """Say it in a sentence."""
        bound = f"it was told nothing beyond {HORIZON:g} s"
        if self.tensions:
            bound = "its tendons may still be pulled"
        if self.untold:
            return f"The hand could not be told to stop ({self.untold.rstrip('.')}, tried twice); {bound}."
        if self.still is None:
            return "The hand was told to stop."
        seen = "it was seen to stand still" if self.still else f"that was not confirmed; {bound}"
        return f"The hand was told to stop: {seen}."


def halt(session: DriverSession, check: CommandCheck | None, found: Followed) -> Halted:
    """Tell the hand to stop, and look whether it stands still where anything had been sent.

    Args:
        session: with the driver. check: the joints and their limits; None when nothing was planned yet.
        found: samples so far; the final positions are added.
    """
    untold, sent = session.stop(), session.sent
    still = None if check is None or not sent.anything else _comes_to_rest(session, check, found)
    return Halted(untold, still, sent.tensions)


def _comes_to_rest(session: DriverSession, check: CommandCheck, found: Followed) -> bool:
    try:
        begun, before = time.monotonic(), None
        while (waited := time.monotonic() - begun) < STOP_WAIT:
            time.sleep(_LOOK)
            state = session.read()
            fresh = all(0.0 <= state.age([name]) <= _LOOK for name in check.limits)
            if fresh and before is not None and _is_still(before, state, check):
                if found.times:
                    found.sample(found.times[-1] + waited + _LOOK, found.commanded[-1], state)
                return True
            before = state if fresh else None
    except BaseException as error:  # the hand was told; an interrupt only ends the looking
        session.keep_interrupt(error)
        return False
    return False


def _is_still(before: HandState, state: HandState, check: CommandCheck) -> bool:
    nowhere = math.nan  # is never still
    return all(
        abs(state.positions.get(name, nowhere) - before.positions.get(name, nowhere)) <= STILL * limits.velocity * _LOOK
        for name, limits in check.limits.items()
    )
