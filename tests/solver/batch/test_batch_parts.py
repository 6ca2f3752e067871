"""A batch that was ended goes on: the file is that of a run that was not, and parts of another batch are refused."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import clench
from clench.core.exceptions import FileError
from clench.models.command import GraspCommand
from clench.solver.batch.batch_parts import parts_folder
from clench.solver.batch.batch_solver import BatchSolver

PLANES = GraspCommand(hand_pose=clench.Pose.identity(), planes=2, preshape="open")


@pytest.fixture(scope="module")
def asked():
    hand, obj = clench.Hand.load("patent15"), clench.GraspObject.load("ball")
    return hand, obj, clench.approach_poses(hand, obj, 7, seed=3)


def end_after(count, monkeypatch):
    """End a run like Ctrl-C when so many chunks are solved; return how many are solved in all."""
    solve, done = BatchSolver.solve, []

    def ended(self, *args):
        if len(done) == count:
            raise KeyboardInterrupt
        done.append(args)
        return solve(self, *args)

    monkeypatch.setattr(BatchSolver, "solve", ended)
    return done


def begin(asked, out, monkeypatch, chunks=2, **options):
    with monkeypatch.context() as patch:
        end_after(chunks, patch)
        with pytest.raises(KeyboardInterrupt):
            clench.solve_batch(*asked, PLANES, chunk=2, out=out, **options)


@pytest.mark.parametrize("postures", [None, [0.1, 0.2, 0.1, 0.2, 0.1, 0.2, 0.1]])
def test_it_goes_on_where_it_was_ended(asked, postures, tmp_path, monkeypatch):
    whole, ended = tmp_path / "whole.npz", tmp_path / "ended.npz"
    name = asked[0].fingers[0].joints[0]
    preshapes = None if postures is None else {asked[0].joint_names[name]: postures}
    at_once = clench.solve_batch(*asked, PLANES, chunk=2, preshapes=preshapes, out=whole)
    begin(asked, ended, monkeypatch, preshapes=preshapes)
    assert not ended.exists()
    parts = sorted(parts_folder(ended).glob("*.npz"))
    with np.load(parts[1]) as data:
        assert data["status"].tolist() == at_once.status[[2, 3] if postures is None else [4, 6]].tolist()

    done = end_after(99, monkeypatch)
    # The parts keep their size, whatever is asked for now.
    again = clench.solve_batch(*asked, PLANES, chunk=5, preshapes=preshapes, out=ended)
    assert len(done) == 2
    assert ended.read_bytes() == whole.read_bytes()
    np.testing.assert_array_equal(again.joint_angles, at_once.joint_angles)
    assert again.solution(6).joint_angles == at_once.solution(6).joint_angles
    assert [path.name for path in tmp_path.iterdir() if path.suffix == ".parts"] == []


def test_a_damaged_part_is_solved_again(asked, tmp_path, monkeypatch):
    whole, ended = tmp_path / "whole.npz", tmp_path / "ended.npz"
    clench.solve_batch(*asked, PLANES, chunk=2, out=whole)
    begin(asked, ended, monkeypatch)
    first, second = sorted(parts_folder(ended).glob("*.npz"))
    first.write_bytes(first.read_bytes()[:-100])
    second.write_bytes(b"")
    clench.solve_batch(*asked, PLANES, chunk=2, out=ended)
    assert ended.read_bytes() == whole.read_bytes()


@pytest.mark.parametrize(
    "changed",
    [
        {"joint_angles": np.zeros((2, 99))},
        {"status_codes": np.array([100, 100], dtype=np.int8)},
        {"contact_link": np.array([9999])},
        {"contact_first": np.array([0, 10**9, 0])},
        {"certified": np.array(["yes", "no"])},
        {"planes": None},
    ],
    ids=["angles", "status", "contacts", "places", "text", "missing"],
)
def test_a_part_whose_arrays_do_not_fit_is_solved_again(asked, tmp_path, monkeypatch, changed):
    whole, ended = tmp_path / "whole.npz", tmp_path / "ended.npz"
    clench.solve_batch(*asked, PLANES, chunk=2, out=whole)
    begin(asked, ended, monkeypatch)
    first = min(parts_folder(ended).glob("*.npz"))
    with np.load(first) as found:
        arrays = {**found, **changed}
    np.savez(first, **{name: array for name, array in arrays.items() if array is not None})
    clench.solve_batch(*asked, PLANES, chunk=2, out=ended)
    assert ended.read_bytes() == whole.read_bytes()


def test_parts_of_another_batch_are_refused(asked, tmp_path, monkeypatch):
    out = tmp_path / "grasps.npz"
    hand, obj, poses = asked
    begin(asked, out, monkeypatch)
    others = [
        (hand, obj, poses[1:], PLANES),
        (hand, obj, poses, replace(PLANES, planes=3)),
        (hand, clench.GraspObject.load("ball", scale=1.001), poses, PLANES),
        (hand, obj.posed(clench.Pose([0.0, 0.0, 1e-9])), poses, PLANES),
        (replace(hand, allowed_pairs=hand.allowed_pairs[1:]), obj, poses, PLANES),
    ]
    for other in others:
        with pytest.raises(FileError, match=r"parts of another batch \(patent15 on ball, 7 poses\)"):
            clench.solve_batch(*other, out=out)
    assert not out.exists()
    # Where the hand was read from, and how many threads solve, plays no part.
    clench.solve_batch(replace(hand, path=Path("elsewhere.xml")), obj, poses, PLANES, threads=1, out=out)
    assert out.exists()


def test_a_folder_of_something_else_is_left_alone(asked, tmp_path):
    out = tmp_path / "grasps.npz"
    parts_folder(out).mkdir()
    mine = parts_folder(out) / "mine.npz"
    mine.write_bytes(b"mine")
    with pytest.raises(FileError, match="holds no parts of a batch"):
        clench.solve_batch(*asked, PLANES, out=out)
    assert mine.read_bytes() == b"mine"


@pytest.mark.parametrize("name", ["grasps.npy", "missing/grasps.npz", "folder.npz"])
def test_a_file_that_cannot_be_written_is_told_first(asked, name, tmp_path, monkeypatch):
    (tmp_path / "folder.npz").mkdir()
    done = end_after(0, monkeypatch)
    with pytest.raises(FileError, match=name):
        clench.solve_batch(*asked, PLANES, out=tmp_path / name)
    assert done == []
