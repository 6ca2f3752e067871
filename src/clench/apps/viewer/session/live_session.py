"""What all open tabs share: the newest state, its answers, and the way back."""

from __future__ import annotations

import sys
import threading
import traceback
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Final, Protocol

import clench
from clench.core.exceptions import ClenchError
from clench.models.command import GraspCommand
from clench.solver.orders import settled
from clench.solver.solution import SolutionStatus as Status
from clench.solver.solution import posture_reason

from .newest_wins import NewestWins
from .quick_answer import QuickAnswer, QuickSolver
from .settled_answer import SettledAnswer, settle
from .shelf import Shelf
from .view_state import Ask, History, ViewState

#: The exact numbers are computed when nothing has moved for so long [s].
REST: Final = 0.15
_BEST_FIRST: Final = tuple(map(str, (Status.GRASP, Status.PARTIAL, Status.NO_CONTACT, Status.BLOCKED)))


class Listener(Protocol):
    """A listener that shows the answers of a session. The session's thread calls it."""

    def adopted(self, state: ViewState) -> None:
        """Take notice of a state that the session, not the user, brought about."""

    def answered(self, answer: QuickAnswer) -> None:
        """Show where the hand is."""

    def rested(self, answer: SettledAnswer) -> None:
        """Show the exact numbers."""

    def failed(self, sentence: str) -> None:
        """Say what went wrong."""

    def noted(self, sentence: str) -> None:
        """Show a note about the answer."""

    def busy(self, sentence: str) -> None:
        """Say what takes a while; empty when it is over."""


@dataclass(frozen=True)
class _Request:
    """Args: state: the new state. ask: the action. moving: the user may continue. keep: undo returns to this state."""

    state: ViewState
    ask: Ask
    moving: bool
    keep: bool


class LiveSession:
    """Answer the newest of the states that are asked for, and keep going whatever happens.

    Args:
        shelf: what names of hands and objects mean. state: the first one. plan_options: of `clench.plan_grasps`.
        ask: what to do with the first state.
    """

    def __init__(self, shelf: Shelf, state: ViewState, plan_options: dict[str, Any], ask: Ask = Ask.SOLVE) -> None:
        self.shelf = shelf
        self._first_ask = ask
        self.plan_options = plan_options
        self._quick = QuickSolver(shelf)
        self._lock = threading.Lock()
        self._state = state
        self._history = History()
        self._listeners: list[Listener] = []
        self.answer: QuickAnswer | None = None
        self.settled: SettledAnswer | None = None
        #: How preshapes compared when clench last chose one; None before.
        self.compared: Mapping[str, Any] | None = None
        self._worker: NewestWins[_Request] = NewestWins(self._work)

    @property
    def state(self) -> ViewState:
        """The newest state."""
        return self._state

    def begin(self, *listeners: Listener) -> None:
        """Answer the first state; tell these listeners from now on."""
        self._listeners += listeners
        self._ask(self._state, self._first_ask, moving=False)

    def drag(self, change: Callable[[ViewState], ViewState], *, moving: bool) -> None:
        """Change the state while the user drags; `moving` is false when they let go, and only that can be undone."""
        with self._lock:
            self._state = change(self._state)
        self._ask(self._state, Ask.SOLVE, moving, keep=not moving)

    def slide(self, change: Callable[[ViewState], ViewState]) -> None:
        """Change the state by a slider, which never says when it is let go: where it rests can be undone."""
        with self._lock:
            self._state = change(self._state)
        self._ask(self._state, Ask.SOLVE, moving=True)

    def change(self, change: Callable[[ViewState], ViewState], ask: Ask = Ask.SOLVE) -> None:
        """Change the state for good."""
        with self._lock:
            self._state = change(self._state)
        self._ask(self._state, ask, moving=False)

    def plan_another(self) -> None:
        """Plan a grasp from another seed than before."""
        self.plan_options["seed"] = int(self.plan_options.get("seed", 0)) + 1
        self.change(lambda s: s, Ask.PLAN)

    def adopt(self) -> None:
        """Tell the listeners a state that does not come from them."""
        self._tell("adopted", self._state)

    def undo(self) -> bool:
        """Go back to the state before, and return whether there is one."""
        return self._go(self._history.undo)

    def redo(self) -> bool:
        """Go to the state that was undone, and return whether there is one."""
        return self._go(self._history.redo)

    def wait(self, seconds: float = 60.0) -> bool:
        """Wait until everything is answered; return whether it is."""
        return self._worker.wait(seconds)

    def close(self) -> None:
        """End the session's thread."""
        self._worker.close()

    def _go(self, step: Callable[[], ViewState | None]) -> bool:
        with self._lock:
            state = step()
            if state is None:
                return False
            self._state = state
        self._tell("adopted", state)
        self._ask(state, Ask.SOLVE, moving=False)
        return True

    def _ask(self, state: ViewState, ask: Ask, moving: bool, keep: bool = True) -> None:
        self._worker.ask(_Request(state, ask, moving, keep))

    def _work(self, request: _Request) -> None:
        """Answer one request; whatever it raises becomes a sentence."""
        try:
            state, note = self._prepared(request)
            self.settled = None
            self.answer = answer = self._quick.answer(state)
            self._tell("answered", answer)
            if self._worker.is_outdated(within=REST if request.moving else 0.0):
                return
            if request.keep:
                with self._lock:
                    self._history.keep(state)
            self.settled = found = settle(answer, self._worker.is_outdated)
            if found is not None:
                self._tell("rested", found)
                if note:
                    self._tell("noted", note)
        except ClenchError as error:
            self._tell("failed", str(error))
        except Exception as error:
            traceback.print_exc(file=sys.stderr)
            self._tell("failed", f"internal error ({type(error).__name__}: {error}); the terminal shows where.")

    def _prepared(self, request: _Request) -> tuple[ViewState, str]:
        """Return the state of a request with what clench finds for it, and a sentence if that is nothing."""
        state = request.state
        if request.ask is Ask.SOLVE:
            return state, ""
        planning = request.ask is Ask.PLAN
        self._tell("busy", "Planning a grasp …" if planning else "Choosing a preshape …")
        found, note = self._planned(state) if planning else self._chosen(state)
        with self._lock:
            if self._state is not state:
                return state, note  # the user has gone on meanwhile
            self._state = found
        self._tell("adopted", found)
        return found, note

    def _chosen(self, state: ViewState) -> tuple[ViewState, str]:
        """Return a state with the preshape that clench chooses, unless the one it has does better."""
        hand, obj = self.shelf.hand(state.hand), self.shelf.object(state.object)
        free = replace(state.command, preshape={})
        solution = clench.solve(hand, obj, free)
        self.compared = posture_reason(solution)
        found = in_palm_frame(settled(free, solution), solution)
        if state.command.preshape and self.compared is not None:
            now = self._quick.answer(state)
            if _BEST_FIRST.index(now.status) < _BEST_FIRST.index(solution.status.value):
                return state, (
                    f"Of the {len(self.compared['compared'])} preshapes that clench compares none does as well as the "
                    f"one that is set: the best ends as '{solution.status.value}'. It was kept."
                )
        return replace(state, command=found), ""

    def _planned(self, state: ViewState) -> tuple[ViewState, str]:
        hand, obj = self.shelf.hand(state.hand), self.shelf.object(state.object)
        posed = obj if state.command.object_pose is None else obj.posed(state.command.object_pose)
        options = {"mass": state.mass, "friction": state.friction, **self.plan_options}
        plan = clench.plan_grasps(hand, posed, 1, path=False, **options)
        if not len(plan):
            return state, plan.text
        return replace(state, command=planned_command(plan[0].command, plan[0].solution, state.command)), ""

    def _tell(self, what: str, value: Any) -> None:
        for listener in self._listeners:
            getattr(listener, what)(value)


def in_palm_frame(command: GraspCommand, solution: clench.GraspSolution) -> GraspCommand:
    """Return a command whose poses are those of its solution: of the palm, and of the object."""
    placed = command.at(solution.hand_pose, solution.object_pose)
    return replace(placed, root_link=None)


def planned_command(
    found: GraspCommand, solution: clench.GraspSolution, asked: GraspCommand | None = None
) -> GraspCommand:
    """Return the command of a planned grasp with order, geometry and criteria as they were asked for."""
    command = in_palm_frame(found, solution)
    if asked is None:
        return command
    kept = {name: getattr(asked, name) for name in ("order", "criteria", "collision_source", "next_steps", "rounds")}
    return replace(command, **kept)
