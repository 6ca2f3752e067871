"""Kernels are compiled ahead for the arguments of a solve, and nothing depends on the second process."""

import subprocess
import sys

import pytest

import clench
from clench.apps.cli.demo import MUG_POSE
from clench.kernels import closing, depth, family_section, overlap, warming


@pytest.mark.parametrize("kernel", [*warming.HERE, *warming.THERE], ids=lambda kernel: kernel.__name__)
def test_every_parameter_has_a_sample(kernel):
    assert warming.argument_types(kernel, warming.sample_values())


def test_what_is_compiled_is_what_a_solve_calls():
    hand, mug = clench.Hand.load("robonaut2"), clench.GraspObject.load("mug")
    clench.solve(hand, mug, clench.GraspCommand(hand_pose=MUG_POSE))
    values = warming.sample_values()
    called = (family_section.cut_first_families, overlap.find_overlaps, closing.close_items, depth.penetration)
    for kernel in called:
        assert warming.argument_types(kernel, values) in kernel.signatures


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
