"""Processes that compile at once leave a kernel to the one that claimed it, and wait for no dead one."""

import os
import subprocess
import sys
import threading
import time

from clench.kernels.runtime import claims
from clench.kernels.runtime.claims import Claims

#: Two kernels, of which one calls the other.
MODULE = """
from clench.kernels.runtime.compiling import entry_kernel, kernel

@kernel
def leaf(x):
    return x + 1.0

@entry_kernel
def caller(x):
    return 2.0 * leaf(x)

@entry_kernel
def other_caller(x):
    return 3.0 * leaf(x)
"""

#: Calls a kernel; prints the answer, and how many kernels were compiled here.
CALL = """
import sys
from pathlib import Path
from clench.kernels.runtime.claims import CLAIMS
import some_kernels as m
CLAIMS.share(Path(sys.argv[1]))
x = getattr(m, sys.argv[2])(3.0)
print(x, *(sum(k.stats.cache_misses.values()) for k in (m.leaf, m.caller, m.other_caller)))
"""


def sharing(folder, all_live=lambda: True):
    shared = Claims()
    shared.share(folder, all_live)
    return shared


def test_a_second_process_waits_until_the_first_is_done(tmp_path):
    first, second, order = sharing(tmp_path), sharing(tmp_path), []

    def wait():
        with second.alone("kernel"):
            order.append("second")

    with first.alone("kernel"):
        waiting = threading.Thread(target=wait)
        waiting.start()
        time.sleep(5 * claims._PAUSE)
        order.append("first")
    waiting.join()
    assert order == ["first", "second"]
    assert list(tmp_path.iterdir()) == []


def test_other_kernels_are_free(tmp_path):
    with sharing(tmp_path).alone("one"), sharing(tmp_path).alone("two"):
        assert len(list(tmp_path.iterdir())) == 2


def test_nobody_waits_for_a_process_that_failed(tmp_path):
    (tmp_path / "kernel").touch()
    with sharing(tmp_path, all_live=lambda: False).alone("kernel"):
        pass
    assert (tmp_path / "kernel").exists(), "it is not ours to end"


def test_a_claim_ends_after_a_while(tmp_path, monkeypatch):
    monkeypatch.setattr(claims, "PATIENCE", 0.1)
    (tmp_path / "kernel").touch()
    with sharing(tmp_path).alone("kernel"):
        pass


def test_a_failure_ends_the_claim(tmp_path):
    try:
        with sharing(tmp_path).alone("kernel"):
            raise ValueError("of the compiler")
    except ValueError:
        pass
    assert list(tmp_path.iterdir()) == []


def test_a_lost_folder_ends_the_sharing(tmp_path):
    shared = sharing(tmp_path / "lost")
    with shared.alone("kernel"):
        assert shared.folder is None
    assert shared.take_job("job")
    shared.note_done("job")
    assert shared.count_done() == 0


def test_a_job_is_taken_once_and_counted_when_done(tmp_path):
    first, second = sharing(tmp_path), sharing(tmp_path)
    assert first.take_job("job")
    assert not second.take_job("job")
    assert second.count_done() == 0
    first.note_done("job")
    assert second.count_done() == 1
    with second.alone("job"):
        pass


def test_processes_compile_each_kernel_once(tmp_path):
    (tmp_path / "some_kernels.py").write_text(MODULE)
    (tmp_path / "claims").mkdir()
    environment = {**os.environ, "PYTHONPATH": str(tmp_path), "NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    command = [sys.executable, "-c", CALL, str(tmp_path / "claims")]
    running = [
        subprocess.Popen([*command, name], stdout=subprocess.PIPE, text=True, env=environment)
        for name in ("caller", "other_caller", "caller")
    ]
    answers = [[float(part) for part in process.communicate()[0].split()] for process in running]
    assert [answer[0] for answer in answers] == [8.0, 12.0, 8.0]
    assert [sum(answer[place] for answer in answers) for place in (1, 2, 3)] == [1.0, 1.0, 1.0]
