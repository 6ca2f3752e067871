"""Kernels are compiled ahead for the arguments of a solve, and nothing depends on the second process."""

import subprocess
import sys

import pytest

import clench
from clench.apps.cli.commands.demo import MUG_POSE
from clench.core.pose import Pose
from clench.kernels.closing import contact_reading as touches
from clench.kernels.closing import solve_poses
from clench.kernels.geometry import link_frames as frames
from clench.kernels.geometry import link_meshes
from clench.kernels.runtime import warming
from clench.kernels.runtime.compiling import index_of


@pytest.mark.parametrize("kernel", [*warming.HERE, *warming.THERE], ids=lambda kernel: kernel.__name__)
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
    inner = [kernel for kernel in (*warming.HERE, *warming.THERE) if kernel not in called]
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
def test_a_second_process_that_fails_is_let_go(monkeypatch, program, capfd):
    done = []
    monkeypatch.setattr(warming, "_is_cold", lambda: True)
    monkeypatch.setattr(warming, "compile_ahead", done.append)
    monkeypatch.setattr(warming, "_MODULE", "no_such_module")
    monkeypatch.setattr(sys, "executable", program)
    warming.warm_up()
    assert len(done) == (program != "no/such/program")
    assert capfd.readouterr() == ("", "")
