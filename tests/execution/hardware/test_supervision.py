"""A stop is heeded whenever it comes and whatever else goes wrong, until it is released; reports say what was sent."""

from __future__ import annotations

import gc
import re
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from types import FrameType
from typing import Any

import fake_driver
import pytest
from hypothesis import HealthCheck, note, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule, run_state_machine_as_test
from recording_driver import MOVING, RecordingDriver
from virtual_clock import VirtualClock

from clench.core.exceptions import CommandError
from clench.execution.execution_report import ExecutionReport
from clench.execution.hardware import supervision
from clench.execution.hardware.driver import DriverError
from clench.execution.hardware.hardware_hand import HardwareHand
from clench.execution.hardware.supervision import (
    ACTIVE,
    TRANSITIONS,
    Event,
    HandStoppedError,
    State,
    Supervision,
    supervision_of,
)
from clench.execution.trajectory import Trajectory, plan_trajectory
from clench.models.hand.hand import Hand
from clench.models.hand.reading.tendons import TendonMap
from clench.solver.solution import GraspSolution

EXECUTION = Path(supervision.__file__).parent
OPEN = {"thumb": 0.0, "index": 0.0}
TENDONS = TendonMap(("thumb", "index"), ((0.01, 0.0), (0.0, 0.01)), (0.0, 1.0), (50.0, 60.0))
SQUEEZE = {
    "feasible": True,
    "text": "Holds 0.1 kg.",
    "offsets": {"thumb": 0.05, "index": 0.03, "index_tip": 0.03},
    "tensions": [12.0, 1.0],
}
ERRORS = [DriverError, OSError, CommandError, KeyboardInterrupt, SystemExit]
AT_REST = (State.IDLE, State.STOPPED, State.FAULTED)


def throw(error: type[BaseException]) -> Callable[[], None]:
    def thrown() -> None:
        raise error("on purpose")

    return thrown


class ScoringContext:
    """Hold one driver with two hands around it, and a solution with every phase: squeeze, tendons, a next step."""

    def __init__(self, pincer: Hand, pinch: GraspSolution) -> None:
        self.hand = replace(pincer, tendons=TENDONS)
        self.solution = replace(pinch, squeeze=SQUEEZE, next_steps=({"thumb": 0.2},))
        self.trajectory: Trajectory = plan_trajectory(self.solution, self.hand, speed=1.0)
        self.driver = RecordingDriver(OPEN)
        self.hands = [HardwareHand(self.hand, self.driver, settling=0.2) for _ in range(2)]

    def again(self, at: dict[int, Callable[[], object]]) -> None:
        self.driver.forget(at)
        self.driver.start, self.driver.path = dict(OPEN), None

    def execute(self, which: int = 0) -> tuple[ExecutionReport | None, BaseException | None]:
        """Return the report, and what was raised."""
        hand = self.hands[which]
        try:
            return hand.execute(self.solution, self.trajectory), None
        except (Exception, KeyboardInterrupt, SystemExit) as error:
            return hand.last_report, error

    def check_truth(self, report: ExecutionReport) -> None:
        """Compare what a report says was sent with what the driver was given."""
        calls, sent = self.driver.calls, report.sent
        assert sent is not None
        assert sent.commands + sent.unconfirmed == calls.count("command")
        assert sent.commands == self.driver.answered.count("command")
        assert sent.tensions == ("pull" in calls)
        assert report.reason.startswith("Not carried out") == (not set(MOVING) & set(calls))
        if self.driver.commands and not sent.unconfirmed:
            last = dict(zip(self.driver.commands[-1].joints, self.driver.commands[-1].positions[-1], strict=True))
            assert sent.last == pytest.approx(last)
        if sent.commands:
            assert report.history is not None
            assert len(report.history.times) > 0


@pytest.fixture
def setting(pincer: Hand, pinch: GraspSolution, clock: VirtualClock) -> ScoringContext:
    return ScoringContext(pincer, pinch)


@contextmanager
def watched_transitions() -> Iterator[None]:
    """Check every change of state against the table."""
    with pytest.MonkeyPatch.context() as patched:

        def watch(method: str, event: Callable[..., Event]) -> None:
            original = getattr(Supervision, method)

            def watched(self: Supervision, *arguments: Any) -> Any:
                before = self.state
                if method == "end" and self.doing is State.IDLE:  # ended before, or never begun
                    return original(self, *arguments)
                returned = original(self, *arguments)
                key = (before, event(*arguments))
                assert key in TRANSITIONS, key
                assert self.state is TRANSITIONS[key], key
                return returned

            patched.setattr(Supervision, method, watched)

        watch("begin", lambda _: Event.BEGIN)
        watch("enter", lambda event: event)
        watch("end", lambda _: Event.END)
        watch("_set", lambda event, _: event)
        watch("release", lambda: Event.RELEASE)
        yield


class Supervised(RuleBasedStateMachine):
    """Carry out, stop, release and fail in any order; the model knows only whether a stop is in force."""

    setting: ScoringContext

    @initialize()
    def begin(self) -> None:
        self.stopped = False
        self.__class__.setting = ScoringContext(self.setting.hand, self.setting.solution)

    def happening(self, kind: str, which: int) -> Callable[[], None]:
        hand, driver = self.setting.hands[which], self.setting.driver

        def stop() -> None:
            self.stopped = True
            hand.stop()

        def execute() -> None:
            calls = len(driver.calls)
            report = hand.execute(self.setting.solution, self.setting.trajectory)
            assert not report.success
            assert report.reason.startswith("Not carried out: The driver is already in use: another execution is ")
            assert len(driver.calls) == calls

        def release() -> None:
            with pytest.raises(HandStoppedError, match="cannot be released yet"):
                hand.release_stop()

        def stop_and_release() -> None:
            stop()
            release()

        simple = {"stop": stop, "execute": execute, "release": release, "stop and release": stop_and_release}
        errors = {error.__name__: throw(error) for error in ERRORS}

        def checked() -> None:
            try:
                (simple | errors)[kind]()
            except AssertionError as error:  # would count as a failure of the driver
                self.wrong.append(error)

        return checked

    @rule(
        which=st.integers(0, 1),
        happenings=st.dictionaries(
            st.integers(1, 70),
            st.tuples(
                st.sampled_from(["stop", "execute", "release", "stop and release", *[e.__name__ for e in ERRORS]]),
                st.integers(0, 1),
            ),
            max_size=4,
        ),
    )
    def execute(self, which: int, happenings: dict[int, tuple[str, int]]) -> None:
        setting, driver = self.setting, self.setting.driver
        setting.again({number: self.happening(*what) for number, what in happenings.items()})
        refused, self.wrong = self.stopped, list[AssertionError]()
        report, raised = setting.execute(which)
        note(f"{driver.calls} {raised!r} {report and report.reason}")
        happened = {happenings[number][0] for number in happenings if number <= len(driver.calls)}
        assert self.wrong == []
        assert report is not None
        if refused:
            assert driver.calls == []
            assert not report.success
            assert "release it with release_stop()" in report.reason
            return
        setting.check_truth(report)
        if driver.last_order() == "stop":
            self.stopped = True  # by a fault
        if self.stopped:
            assert not report.success
            assert driver.last_order() == "stop"
        if not happened - {"execute", "release"}:
            assert report.success, report.reason
            assert not self.stopped
        if raised is not None:
            assert type(raised) in ERRORS
            if not isinstance(raised, Exception):
                assert self.stopped

    @rule(which=st.integers(0, 1))
    def stop(self, which: int) -> None:
        self.setting.driver.forget({})
        self.setting.hands[which].stop()
        self.stopped = True
        assert self.setting.driver.calls == ["stop"]

    @rule(which=st.integers(0, 1))
    def release(self, which: int) -> None:
        self.setting.hands[which].release_stop()
        self.stopped = False

    @invariant()
    def all_see_the_same(self) -> None:
        states = {hand.state for hand in self.setting.hands}
        assert len(states) == 1
        assert states <= set(AT_REST)
        assert (states != {State.IDLE}) == self.stopped


def test_any_order_of_executions_stops_faults_and_releases(pincer: Hand, pinch: GraspSolution) -> None:
    with pytest.MonkeyPatch.context() as patched, watched_transitions():
        VirtualClock().use(patched, fake_driver)
        Supervised.setting = ScoringContext(pincer, pinch)
        run_state_machine_as_test(
            Supervised,
            settings=settings(
                max_examples=80, stateful_step_count=10, deadline=None, suppress_health_check=list(HealthCheck)
            ),
        )


def number_of_calls(setting: ScoringContext) -> int:
    setting.again({})
    report, raised = setting.execute()
    assert report is not None
    assert report.success, report.reason
    assert raised is None
    return len(setting.driver.calls)


@pytest.mark.parametrize("error", ERRORS)
def test_whatever_is_raised_at_any_call_stops_the_hand(setting: ScoringContext, error: type[BaseException]) -> None:
    count = number_of_calls(setting)
    what = list(setting.driver.calls)
    assert set(what) == {"connect", "read", "command", "pull", "disconnect"}
    for number in range(1, count + 1):
        setting.again({number: throw(error)})
        report, raised = setting.execute()
        assert report is not None
        setting.check_truth(report)
        if issubclass(error, Exception) and what[number - 1] in ("connect", "disconnect"):
            assert "stop" not in setting.driver.calls  # nothing moved, or nothing moves any more
            assert report.success == (what[number - 1] == "disconnect")
            continue
        if what[number - 1] == "disconnect":
            assert isinstance(raised, error)
        else:
            assert not report.success
            assert "The hand was told to stop" in report.reason
            assert setting.driver.last_order() == "stop"
            assert setting.hands[0].state is (State.FAULTED if issubclass(error, Exception) else State.STOPPED)
            assert (raised is None) == issubclass(error, Exception)
        setting.hands[0].release_stop()


def test_a_stop_at_any_call_is_heeded(setting: ScoringContext) -> None:
    for number in range(1, number_of_calls(setting) + 1):
        order: list[int] = []

        def stop(order: list[int] = order) -> None:
            setting.hands[1].stop()
            order.append(len(setting.driver.calls))

        setting.again({number: stop})
        report, _ = setting.execute()
        assert report is not None
        setting.check_truth(report)
        assert not report.success
        assert "Stopped on request." in report.reason
        assert not set(MOVING) & set(setting.driver.calls[order[0] :])
        assert setting.driver.last_order() == "stop"
        assert setting.hands[0].state is State.STOPPED
        setting.hands[0].release_stop()


def test_a_stop_that_fails_is_told_again_and_reported(setting: ScoringContext) -> None:
    setting.again({9: throw(OSError), 10: throw(KeyboardInterrupt)})
    report, raised = setting.execute()
    assert report is not None
    assert setting.driver.calls[8:11] == ["read", "stop", "stop"] or setting.driver.calls[8:11] == [
        "command",
        "stop",
        "stop",
    ]
    assert isinstance(raised, KeyboardInterrupt)
    assert report.reason.startswith("The driver failed (OSError: on purpose). The hand was told to stop: it was seen")
    setting.hands[0].release_stop()
    setting.again(dict.fromkeys(range(9, 99), throw(OSError)))
    report, _ = setting.execute()
    assert report is not None
    assert (
        "The hand could not be told to stop (The driver failed (OSError: on purpose), tried twice); it was told "
        "nothing beyond 0.3 s."
    ) in report.reason
    assert setting.driver.calls.count("stop") == 2
    setting.driver.forget(dict.fromkeys(range(1, 9), throw(OSError)))
    with pytest.raises(DriverError, match=r"could not be told to stop \(OSError: on purpose\); no further command"):
        setting.hands[1].stop()
    assert setting.hands[0].state is State.FAULTED


def test_how_to_release_is_said_and_a_stop_outlives_its_hand(setting: ScoringContext) -> None:
    setting.hands[1].stop()
    setting.hands.clear()
    gc.collect()
    hand = HardwareHand(setting.hand, setting.driver)
    for _ in range(2):
        report = hand.execute(setting.solution, setting.trajectory)
        assert report.reason == (
            "Not carried out: A stop is in force (Stopped on request); release it with release_stop()."
        )
    assert setting.driver.calls == ["stop"]
    hand.release_stop()
    assert hand.execute(setting.solution, setting.trajectory).success


def test_drivers_share_nothing() -> None:
    class Slots:
        __slots__ = ()

        def __eq__(self, other: object) -> bool:
            return True

        __hash__ = None  # type: ignore[assignment]

    plain = [RecordingDriver(OPEN), RecordingDriver(OPEN), Slots(), Slots()]
    first = [supervision_of(driver) for driver in plain]
    assert len(set(map(id, first))) == 4
    first[0].stop()
    first[2].stop()
    assert [supervision_of(driver) for driver in plain] == first
    assert [bool(found.cause) for found in first] == [True, False, True, False]
    keys = [id(driver) for driver in plain]
    plain.clear()
    gc.collect()
    # Those that cannot be referred to weakly are kept, and with them their stops.
    assert [key in supervision._supervised for key in keys] == [False, False, True, True]


def hang(setting: ScoringContext, clock: VirtualClock, number: int) -> tuple[threading.Event, ExecutionReport]:
    """Let a call hang until an event is set; return the event and the report."""
    goes_on = threading.Event()

    def hanging() -> None:
        clock.hanging.set()
        goes_on.wait(60.0)
        clock.hanging.clear()

    def stopping() -> None:
        clock.hanging.clear()

    setting.again({number: hanging, number + 1: stopping})
    report, raised = setting.execute()
    assert report is not None
    assert raised is None
    setting.check_truth(report)
    return goes_on, report


@pytest.mark.parametrize("what", ["read", "command", "pull"])
def test_a_call_that_does_not_return_is_a_fault(setting: ScoringContext, clock: VirtualClock, what: str) -> None:
    number_of_calls(setting)
    number = [k for k, call in enumerate(setting.driver.calls, 1) if call == what][-1]
    goes_on, report = hang(setting, clock, number)
    hand, driver = setting.hands[0], setting.driver
    assert f"{what}() of the driver has not returned after 1 s. The hand was told to stop: " in report.reason
    assert "that was not confirmed" in report.reason
    assert report.history is not None
    assert len(report.history.times) > 3
    assert driver.calls[number - 1 :] == [what, "stop", "disconnect"]
    assert hand.state is State.FAILING
    assert (
        "The driver is already in use: another execution is failing"
        in hand.execute(setting.solution, setting.trajectory).reason
    )
    with pytest.raises(HandStoppedError, match="a call of the driver has not returned"):
        hand.release_stop()
    done = threading.Event()
    driver.at_call[len(driver.calls) + 1] = done.set
    goes_on.set()
    assert done.wait(60.0)  # a command may have come late: the hand is told to stop again
    until = time.monotonic() + 60.0
    while hand.state is State.FAILING and time.monotonic() < until:
        time.sleep(0.001)
    assert hand.state is State.FAULTED
    assert driver.last_order() == "stop"
    hand.release_stop()
    assert hand.state is State.IDLE


def test_every_state_is_in_the_table_and_a_stop_is_possible_in_each() -> None:
    for state in State:
        assert (state, Event.STOP) in TRANSITIONS
        assert any(after is state for after in TRANSITIONS.values())
    for state in ACTIVE:
        assert TRANSITIONS[state, Event.STOP] is State.STOPPING
        assert TRANSITIONS[state, Event.FAULT] is State.FAILING
    moving = {(event, after) for (state, event), after in TRANSITIONS.items() if state not in (State.IDLE, *ACTIVE)}
    assert not moving & {(event, after) for event in Event for after in ACTIVE}  # nothing leads back but a release


def test_the_page_has_the_table() -> None:
    page = (Path(__file__).parents[3] / "docs/controllers.md").read_text()
    _, _, rest = page.partition("| state | event | next state |")
    found: dict[tuple[str, str], str] = {}
    for line in rest.split("\n\n")[0].splitlines()[2:]:
        states, events, after = (re.findall(r"`(\w+)`", cell) for cell in line.strip("|").split("|"))
        found |= {(state, event): (after or [state])[0] for state in states for event in events}
    assert found == {(str(state), str(event)): str(after) for (state, event), after in TRANSITIONS.items()}


def signalled(setting: ScoringContext, number: int) -> Callable[[], None]:
    """Return a happening that sends a signal to the main thread, and goes on when the stop is in force."""

    def happening() -> None:
        signal.pthread_kill(threading.main_thread().ident or 0, number)
        until = time.monotonic() + 60.0
        while not supervision_of(setting.driver).cause and time.monotonic() < until:
            time.sleep(0.001)

    return happening


@pytest.mark.parametrize("what", ["read", "command", "pull"])
@pytest.mark.parametrize("handled", ["interrupt", "stop"])
def test_a_signal_in_the_middle_of_a_call_stops_the_hand_after_it(
    setting: ScoringContext, what: str, handled: str
) -> None:
    """Ctrl-C, or a handler that calls `stop`: the call is not torn, and the hand is told to stop afterwards."""
    hand, driver = setting.hands[0], setting.driver
    number_of_calls(setting)
    number = [k for k, call in enumerate(driver.calls, 1) if call == what][-1]
    setting.again({number: signalled(setting, signal.SIGINT)})
    handler = signal.default_int_handler if handled == "interrupt" else lambda *_: hand.stop()
    before = signal.signal(signal.SIGINT, handler)
    try:
        report, raised = setting.execute()
    finally:
        signal.signal(signal.SIGINT, before)
    assert report is not None
    setting.check_truth(report)
    assert isinstance(raised, KeyboardInterrupt) == (handled == "interrupt")
    assert not report.success
    assert ("Interrupted (KeyboardInterrupt)" if handled == "interrupt" else "Stopped on request") in report.reason
    assert report.history is not None
    assert driver.answered.index("stop") > 0
    assert driver.last_order() == "stop"
    assert not set(MOVING) & set(driver.calls[number:])
    assert what in driver.answered
    assert hand.state is State.STOPPED


def test_a_second_interrupt_does_not_keep_the_hand_from_being_stopped(setting: ScoringContext) -> None:
    """One comes from the driver, and another one while the hand is told to stop for the second time."""
    driver = setting.driver

    def interrupted() -> None:
        signal.pthread_kill(threading.main_thread().ident or 0, signal.SIGINT)
        seen.wait(60.0)

    def handler(*_: object) -> None:
        seen.set()
        raise KeyboardInterrupt

    seen = threading.Event()
    setting.again({9: throw(OSError), 10: throw(KeyboardInterrupt), 11: interrupted})
    before = signal.signal(signal.SIGINT, handler)
    try:
        report, raised = setting.execute()
    finally:
        signal.signal(signal.SIGINT, before)
    assert report is not None
    assert isinstance(raised, KeyboardInterrupt)
    assert report.reason.startswith("The driver failed (OSError: on purpose). The hand was told to stop: it was seen")
    assert driver.last_order() == "stop"
    assert setting.hands[0].state is State.FAULTED


class Interrupt:
    """Raise KeyboardInterrupt before the n-th line of clench.execution that the executing thread comes to."""

    def __init__(self, at: int) -> None:
        self.at, self.lines, self.where = at, 0, ""

    def __call__(self, frame: FrameType, event: str, _: object) -> Interrupt | None:
        if str(EXECUTION) not in frame.f_code.co_filename:
            return None
        if event == "line":
            self.lines += 1
            if self.lines == self.at:
                self.where = f"{frame.f_code.co_filename}:{frame.f_lineno}"
                sys.settrace(None)
                raise KeyboardInterrupt
        return self


@pytest.mark.parametrize("fault", [{}, {9: throw(OSError)}], ids=["no fault", "after a fault"])
def test_an_interrupt_at_any_line_leaves_the_hand_stopped_and_the_driver_free(
    setting: ScoringContext, fault: dict[int, Callable[[], object]]
) -> None:
    before = sys.gettrace()

    def interrupted(at: int) -> Interrupt:
        setting.again(fault)
        interrupt = Interrupt(at)
        sys.settrace(interrupt)
        try:
            setting.execute()
        finally:
            sys.settrace(before)
        return interrupt

    count = interrupted(0).lines
    setting.hands[0].release_stop()
    assert count > 1000
    for at in [*range(1, 100, 3), *range(100, count, 53)]:
        interrupt = interrupted(at)
        assert interrupt.where
        if set(MOVING) & set(setting.driver.calls) and setting.driver.last_order() != "stop":
            # Only when the execution has ended: everything was reached, and the hand was let go.
            assert setting.driver.calls[-1] == "disconnect", interrupt.where
            assert interrupt.where.startswith(str(EXECUTION / "driven_hand.py")), interrupt.where
            assert not fault
        assert setting.hands[0].state in AT_REST, interrupt.where
        setting.hands[0].release_stop()


def test_a_stop_from_another_thread_is_told_again_after_a_command_on_its_way(setting: ScoringContext) -> None:
    hand, driver = setting.hands[0], setting.driver
    order: list[str] = []

    def late() -> None:
        stopping = threading.Thread(target=lambda: (hand.stop(), order.extend(driver.calls)))
        stopping.start()
        until = time.monotonic() + 60.0
        while "stop" not in driver.calls and time.monotonic() < until:
            time.sleep(0.001)
        driver.calls.append("command")  # the line delivers it now

    number_of_calls(setting)
    setting.again({driver.calls.index("command") + 1: late})
    report, _ = setting.execute()
    assert report is not None
    assert report.reason.startswith("Stopped on request.")
    until = time.monotonic() + 60.0
    while not order and time.monotonic() < until:
        time.sleep(0.001)
    assert order[order.index("stop") :][:2] == ["stop", "command"]
    assert "stop" in order[order.index("stop") + 2 :]  # before `stop` returned
    assert driver.calls.count("stop") == 3  # twice by this thread, once by the execution
