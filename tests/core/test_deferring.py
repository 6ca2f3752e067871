"""Mappings and sequences that are made when they are first read."""

import copy
import pickle
import time
from concurrent.futures import ThreadPoolExecutor

import pytest

from clench.core.caching.deferring import DeferredMapping, DeferredSequence, once

MADE = {"code": "limit", "angles": [0.1, 0.2]}


def test_it_is_made_once_when_it_is_read():
    calls = []
    deferred = DeferredMapping(lambda: calls.append(1) or MADE)
    assert calls == []
    assert not deferred.is_made
    assert deferred["code"] == "limit"
    assert list(deferred) == ["code", "angles"]
    assert len(deferred) == 2
    assert deferred.is_made
    assert calls == [1]
    with pytest.raises(KeyError):
        deferred["other"]


def test_it_reads_as_what_it_holds():
    deferred = DeferredMapping(lambda: MADE)
    assert deferred == MADE
    assert MADE.__eq__(deferred) is NotImplemented  # so that the deferred one is asked
    assert repr(deferred) == repr(MADE)
    assert {**deferred, "more": 1} == {**MADE, "more": 1}
    assert deferred != {"code": "limit"}


@pytest.mark.parametrize("copied", [lambda d: pickle.loads(pickle.dumps(d)), copy.copy, copy.deepcopy])
def test_a_copy_is_the_plain_mapping(copied):
    again = copied(DeferredMapping(lambda: MADE))
    assert type(again) is dict
    assert again == MADE


def test_what_fails_fails_again():
    deferred = DeferredMapping(lambda: {"a": 1 / 0})
    for _ in range(2):
        with pytest.raises(ZeroDivisionError):
            deferred["a"]


def test_a_sequence_is_made_once_when_it_is_read():
    calls = []
    deferred = DeferredSequence(lambda: calls.append(1) or [3, 1, 2])
    assert not deferred.is_made
    assert bool(deferred)
    assert list(deferred) == [3, 1, 2]
    assert (len(deferred), deferred[1], deferred[1:]) == (3, 1, (1, 2))
    assert repr(deferred) == "(3, 1, 2)"
    assert deferred.is_made
    assert calls == [1]
    assert pickle.loads(pickle.dumps(deferred)) == (3, 1, 2)


def test_a_value_is_made_once_for_threads_that_ask_at_once():
    calls = []
    value = once(lambda: (calls.append(1), time.sleep(0.05), object())[2])
    assert calls == []
    with ThreadPoolExecutor(8) as threads:
        found = list(threads.map(lambda _: value(), range(16)))
    assert calls == [1]
    assert all(each is found[0] for each in found)


def test_a_value_that_cannot_be_made_is_tried_again():
    calls = []
    value = once(lambda: calls.append(1) or 1 / (len(calls) - 1))
    with pytest.raises(ZeroDivisionError):
        value()
    assert (value(), value(), len(calls)) == (1.0, 1.0, 2)
