"""The thread that works on the newest alone."""

from __future__ import annotations

import threading

from clench.apps.viewer.session.newest_wins import NewestWins


def test_what_was_asked_in_between_is_dropped() -> None:
    begun, go_on, done = threading.Event(), threading.Event(), []

    def work(item: int) -> None:
        begun.set()
        go_on.wait(10.0)
        done.append(item)

    worker = NewestWins(work)
    worker.ask(0)
    assert begun.wait(10.0)
    for item in range(1, 100):
        worker.ask(item)
    assert worker.is_outdated()
    go_on.set()
    assert worker.wait(10.0)
    worker.close()
    assert done == [0, 99]


def test_nothing_newer_is_seen_while_nothing_is_asked() -> None:
    seen: list[bool] = []
    worker = NewestWins(lambda _: seen.append(worker.is_outdated(within=0.01)))
    worker.ask(1)
    assert worker.wait(10.0)
    worker.close()
    assert seen == [False]


def test_work_that_waits_for_news_leaves_off_as_soon_as_there_are_some() -> None:
    seen: list[tuple[int, bool]] = []
    begun = threading.Event()

    def work(item: int) -> None:
        begun.set()
        seen.append((item, worker.is_outdated(within=10.0 if item == 1 else 0.0)))

    worker = NewestWins(work)
    worker.ask(1)
    assert begun.wait(10.0)
    worker.ask(2)
    assert worker.wait(5.0)
    worker.close()
    assert seen == [(1, True), (2, False)]


def test_work_that_raises_is_followed_by_the_next(capsys) -> None:
    done = []

    def work(item: int) -> None:
        if item == 1:
            raise ZeroDivisionError
        done.append(item)

    newest = NewestWins(work)
    for item in (1, 2):
        newest.ask(item)
        assert newest.wait(10.0)
    newest.close()
    assert done == [2]
    assert "ZeroDivisionError" in capsys.readouterr().err
