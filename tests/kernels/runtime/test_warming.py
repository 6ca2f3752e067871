"""Kernels are compiled ahead for the arguments of a solve, and nothing depends on the other processes."""

import os
import subprocess
import sys
from types import SimpleNamespace

import pytest

import clench
from clench.apps.cli.commands.demo import MUG_POSE
from clench.core.pose import Pose
from clench.kernels.closing import contact_reading as touches
from clench.kernels.closing import solve_poses
from clench.kernels.geometry import link_frames as frames
from clench.kernels.geometry import link_meshes
from clench.kernels.runtime import warming
from clench.kernels.runtime.claims import CLAIMS, Claims
from clench.kernels.runtime.compiling import index_of


@pytest.mark.parametrize("kernel", warming.JOBS, ids=lambda kernel: kernel.__name__)
def test_every_parameter_has_a_sample(kernel):
    assert warming.argument_types(kernel, warming.sample_values())


def test_what_is_compiled_is_what_a_solve_calls():
    hand, mug = clench.Hand.load("robonaut2"), clench.GraspObject.load("mug")
    clench.solve(hand, mug, clench.GraspCommand(hand_pose=MUG_POSE, preshape="open")).to_dict()
    values = warming.sample_values()
    called = (
        *(solve_poses.solve_poses, frames.relate_poses, frames.place_links),
        *(link_meshes.measure_depths, touches.read_contacts),
    )
    for kernel in called:
        assert warming.argument_types(kernel, values) in kernel.signatures
    inner = [kernel for kernel in warming.JOBS if kernel not in called]
    assert len(inner) > 6
    for kernel in inner:
        missed = sum(kernel.stats.cache_misses.values())
        kernel.compile(warming.argument_types(kernel, values))
        assert sum(kernel.stats.cache_misses.values()) == missed, kernel


def test_the_first_call_says_that_it_compiles(monkeypatch, capsys):
    hand, ball = clench.Hand.load("patent15"), clench.GraspObject.load("ball")
    clench.solve(hand, ball, clench.GraspCommand(Pose([5, 0, 0]), preshape="open"))
    capsys.readouterr()
    warming.announce.cache_clear()
    clench.solve(hand, ball, clench.GraspCommand(Pose([5, 0, 0]), preshape="open"))
    assert capsys.readouterr().err == ""  # they are compiled by now
    monkeypatch.setattr(warming, "_is_cold", lambda: True)
    warming.announce.cache_clear()
    for _ in range(2):
        warming.announce()
    (sentence,) = capsys.readouterr().err.splitlines()
    assert sentence.startswith("clench: compiling its kernels")
    warming.announce.cache_clear()


def test_a_cache_without_the_closing_is_cold(monkeypatch, tmp_path):
    assert not warming._is_cold()
    monkeypatch.setattr(index_of(solve_poses.solve_poses), "_index_path", str(tmp_path / "none.nbi"))
    assert warming._is_cold()


def test_a_cache_of_other_source_is_cold(monkeypatch):
    monkeypatch.setattr(index_of(solve_poses.solve_poses), "_source_stamp", b"of a year ago")
    assert warming._is_cold()


def test_compiled_kernels_start_no_process(monkeypatch):
    monkeypatch.setattr(warming, "_is_cold", lambda: False)
    monkeypatch.setattr(subprocess, "Popen", None)
    warming.warm_up()


@pytest.mark.parametrize("program", ["no/such/program", sys.executable])
def test_other_processes_that_fail_are_let_go(monkeypatch, program, capfd):
    done = []
    monkeypatch.setattr(warming, "_is_cold", lambda: True)
    monkeypatch.setattr(warming, "JOBS", (link_frames_twin(done),))
    monkeypatch.setattr(warming, "argument_types", lambda kernel, values: ())
    monkeypatch.setattr(warming, "_MODULE", "no_such_module")
    monkeypatch.setattr(sys, "executable", program)
    monkeypatch.setattr(os, "cpu_count", lambda: 3)
    warming.warm_up()
    assert done == [()]
    assert capfd.readouterr().out == ""
    assert CLAIMS.folder is None


def link_frames_twin(done):
    """Return a kernel that notes for which arguments it is compiled."""

    def twin():
        pass

    return SimpleNamespace(py_func=twin, compile=done.append)


def test_jobs_that_another_process_has_taken_are_left_to_it(monkeypatch, tmp_path):
    done = []
    kernels = [link_frames_twin(done), SimpleNamespace(py_func=done.append.__class__, compile=None)]
    monkeypatch.setattr(warming, "JOBS", kernels)
    monkeypatch.setattr(warming, "argument_types", lambda kernel, values: ())
    monkeypatch.setattr(warming, "claim_of", lambda kernel, kinds: "free" if kernel is kernels[0] else "taken")
    other = Claims()
    other.share(tmp_path)
    assert other.take_job("taken")
    monkeypatch.setattr(warming, "CLAIMS", mine := Claims())
    mine.share(tmp_path)
    assert list(warming._jobs_done()) == [1, 1]
    assert done == [()]


def test_the_bar_is_on_standard_error(capsys):
    with warming._bar() as show:
        show(3)
    out, err = capsys.readouterr()
    assert out == ""
    assert err
