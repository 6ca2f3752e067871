"""Kernels are compiled ahead for the arguments of a solve, and nothing depends on the other processes."""

import multiprocessing
import os
import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest

import clench
from clench.apps.cli.commands.demo import MUG_POSE
from clench.core.pose import Pose
from clench.kernels.closing import contact_reading as touches
from clench.kernels.closing import solve_poses
from clench.kernels.geometry import link_frames as frames
from clench.kernels.geometry import link_meshes
from clench.kernels.runtime import motion_samples, warming
from clench.kernels.runtime.claims import CLAIMS, Claims
from clench.kernels.runtime.compiling import index_of
from clench.kernels.runtime.warming import Job
from clench.kernels.toi import path_overlap


@pytest.mark.parametrize("kernel", warming.JOBS, ids=lambda kernel: kernel.__name__)
def test_every_parameter_has_a_sample(kernel):
    assert warming.argument_types(kernel, warming.sample_values())


def motion_jobs():
    """Return the kernels of forces and motions, and the types that they are compiled for."""
    values = warming.sample_values()
    values |= motion_samples.motion_values(values)
    return [(kernel, warming.argument_types(kernel, values)) for kernel in motion_samples.MOTIONS]


def test_what_is_compiled_for_motions_is_what_they_call(mug_grasp):
    clench.plan_trajectory(mug_grasp.solution, mug_grasp.hand, obj=mug_grasp.mug)
    clench.execution.complete(mug_grasp.solution, mug_grasp.hand, mug_grasp.mug)
    called = {"first_overlap", "nearer_facets", "least_cost"}
    assert {kernel.__name__ for kernel, _ in motion_jobs()} == called
    for kernel, kinds in motion_jobs():
        assert kernel.signatures == [kinds], kernel


def test_one_triangle_has_every_kernel_of_trees():
    program = """
import numpy as np, clench
from clench.kernels.runtime import warming
from clench.kernels.trees import bvh, connectivity, node_boxes, tree_growth
warming.pack_one_triangle()
kernels = [k for m in (bvh, connectivity, node_boxes, tree_growth) for k in vars(m).values()]
before = {k: list(k.signatures) for k in kernels if hasattr(k, "py_func") and not warming.is_inner(k)}
hand, mug = clench.Hand.load("robonaut2"), clench.GraspObject.load("mug")
clench.solve(hand, mug, clench.Pose([-0.05, -0.1, 0.06], wxyz=[0.5, 0.5, 0.5, 0.5]))
print(len(before), [k.__name__ for k in before if k.signatures != before[k]])
"""
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    count, _, new = run.stdout.strip().partition(" ")
    assert (int(count) > 10, new) == (True, "[]")


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


@pytest.fixture
def nothing_is_warm(monkeypatch):
    """Let this process know nothing of the cache, and start no other one."""
    monkeypatch.setattr(warming, "_WARM", set())
    monkeypatch.setattr(os, "cpu_count", lambda: 1)


def test_the_first_call_says_that_it_compiles_and_compiles_together(monkeypatch, capsys, nothing_is_warm):
    hand, ball = clench.Hand.load("patent15"), clench.GraspObject.load("ball")
    command = clench.GraspCommand(Pose([5, 0, 0]), preshape="open")
    clench.solve(hand, ball, command)
    assert capsys.readouterr().err == "", "they are compiled by now"
    monkeypatch.setattr(warming, "_is_cold", lambda motions: True)
    warming._WARM.clear()
    done = []
    monkeypatch.setattr(warming, "_jobs", lambda motions: [Job("one", lambda: done.append(motions))])
    for _ in range(2):
        clench.solve(hand, ball, command)
        clench.solve_batch(hand, ball, np.eye(4)[None], command)
    assert done == [False], "once per process"
    warming.warm_up(motions=True)
    warming.warm_up(motions=True)
    assert done == [False, True]
    first, second, *more = capsys.readouterr().err.split("clench: compiling its kernels")[1:]
    assert (bool(first), bool(second), more) == (True, True, [])


def test_workers_of_a_pool_leave_it_to_their_parent(monkeypatch, nothing_is_warm):
    monkeypatch.setattr(warming, "_is_cold", lambda motions: True)
    monkeypatch.setattr(warming, "_compile_together", None)
    monkeypatch.setattr(multiprocessing, "parent_process", lambda: SimpleNamespace(pid=1))
    warming.warm_up()


def test_a_cache_without_the_closing_is_cold(monkeypatch, tmp_path):
    assert not warming._is_cold(motions=False)
    monkeypatch.setattr(index_of(solve_poses.solve_poses), "_index_path", str(tmp_path / "none.nbi"))
    assert warming._is_cold(motions=False)
    assert warming._is_cold(motions=True)


def test_a_cache_without_motions_is_cold_for_those_that_move(monkeypatch, tmp_path):
    for kernel, kinds in motion_jobs():
        kernel.compile(kinds)
    assert not warming._is_cold(motions=True)
    monkeypatch.setattr(index_of(path_overlap.first_overlap), "_index_path", str(tmp_path / "none.nbi"))
    assert warming._is_cold(motions=True)
    assert not warming._is_cold(motions=False)


def test_a_cache_of_other_source_is_cold(monkeypatch):
    monkeypatch.setattr(index_of(solve_poses.solve_poses), "_source_stamp", b"of a year ago")
    assert warming._is_cold(motions=False)


def test_compiled_kernels_start_no_process(monkeypatch, nothing_is_warm):
    monkeypatch.setattr(warming, "_is_cold", lambda motions: False)
    monkeypatch.setattr(subprocess, "Popen", None)
    warming.warm_up()


@pytest.mark.parametrize("program", ["no/such/python", sys.executable])
def test_other_processes_that_fail_are_let_go(monkeypatch, program, capfd, nothing_is_warm):
    done = []
    monkeypatch.setattr(warming, "_is_cold", lambda motions: True)
    monkeypatch.setattr(warming, "_jobs", lambda motions: [Job("one", lambda: done.append(1))])
    monkeypatch.setattr(warming, "_MODULE", "no_such_module")
    monkeypatch.setattr(sys, "executable", program)
    monkeypatch.setattr(os, "cpu_count", lambda: 3)
    warming.warm_up()
    assert done == [1]
    assert capfd.readouterr().out == ""
    assert CLAIMS.folder is None


@pytest.mark.parametrize("program", ["/opt/blender/blender", "", None])
def test_a_program_that_contains_python_is_not_started_again(monkeypatch, program):
    monkeypatch.setattr(sys, "executable", program)
    monkeypatch.setattr(subprocess, "Popen", None)
    assert warming._others(3, ["folder"]) == []


def test_jobs_that_another_process_has_taken_are_left_to_it(monkeypatch, tmp_path):
    done = []
    jobs = [Job("free", lambda: done.append(1)), Job("taken", None)]
    other = Claims()
    other.share(tmp_path)
    assert other.take_job("taken")
    monkeypatch.setattr(warming, "CLAIMS", mine := Claims())
    mine.share(tmp_path)
    assert list(warming._jobs_done(jobs)) == [1, 1]
    assert done == [1]


def test_the_bar_is_on_standard_error(capsys):
    with warming._bar(5) as show:
        show(3)
    out, err = capsys.readouterr()
    assert out == ""
    assert err
