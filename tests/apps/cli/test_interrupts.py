"""Being told to end: which signals interrupt, what is called first, and what is put back afterwards."""

from __future__ import annotations

import signal
import subprocess
import sys
import threading
import time
from contextlib import suppress
from pathlib import Path

import pytest

from clench.apps.cli.interrupts import stopped_by_signals

HEEDED = [signal.SIGINT, signal.SIGTERM, signal.SIGHUP]


pytestmark = pytest.mark.usefixtures("hangups_heard")


@pytest.mark.parametrize("number", HEEDED)
def test_a_signal_calls_stop_and_interrupts(number: signal.Signals) -> None:
    stops: list[bool] = []
    with suppress(KeyboardInterrupt), stopped_by_signals(lambda: stops.append(True)):
        assert callable(signal.getsignal(number))  # by default the signal would end the tests
        signal.raise_signal(number)
        pytest.fail("the signal did not interrupt")
    assert stops == [True]


@pytest.mark.parametrize("error", [None, ValueError])
def test_handlers_are_put_back_however_it_ends(error: type[Exception] | None) -> None:
    before = [signal.getsignal(number) for number in HEEDED]
    with suppress(ValueError), stopped_by_signals():
        inside = [signal.getsignal(number) for number in HEEDED]
        if error is not None:
            raise error
    assert not set(inside) & set(before)
    assert [signal.getsignal(number) for number in HEEDED] == before


def test_only_the_main_thread_sets_handlers() -> None:
    """Python allows no other thread to; what runs there goes on as it is."""
    before = [signal.getsignal(number) for number in HEEDED]
    seen: list[object] = []

    def work() -> None:
        with stopped_by_signals():
            seen.append([signal.getsignal(number) for number in HEEDED])

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert seen == [before]


@pytest.mark.parametrize(("number", "heeded"), [(signal.SIGINT, True), (signal.SIGHUP, False)])
def test_of_signals_that_were_ignored_only_a_hangup_stays_so(number: signal.Signals, heeded: bool) -> None:
    """A script ignores Ctrl-C for what it runs in the background; `nohup` ignores hangups."""
    before = signal.signal(number, signal.SIG_IGN)
    stops: list[bool] = []
    try:
        with suppress(KeyboardInterrupt), stopped_by_signals(lambda: stops.append(True)):
            signal.raise_signal(number)
        assert signal.getsignal(number) is signal.SIG_IGN
    finally:
        signal.signal(number, before)
    assert stops == [True] * heeded


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_being_told_to_end_stops_the_hand(tmp_path: Path, number: int) -> None:
    program = (
        "import time\n"
        "from clench.apps.cli.interrupts import stopped_by_signals\n"
        "try:\n"
        "    with stopped_by_signals():\n"
        "        print('moving', flush=True)\n"
        "        time.sleep(20)\n"
        "except KeyboardInterrupt:\n"
        "    print('stopped', flush=True)\n"
    )
    run = subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True)
    assert run.stdout is not None
    assert run.stdout.readline() == "moving\n"
    time.sleep(0.1)
    run.send_signal(number)
    out, _ = run.communicate(timeout=10)
    assert out == "stopped\n"
