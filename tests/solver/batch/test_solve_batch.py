"""Many poses at once: the bits of single solves, whatever the threads and chunks; one sentence for bad input."""

from __future__ import annotations

import pickle
import time
from dataclasses import fields, replace

import numpy as np
import pytest

import clench
from clench.core.exceptions import ClenchError, CommandError
from clench.core.pose import Pose
from clench.solver.batch import batch_progress
from clench.solver.batch.batch_solver import BatchSolver
from clench.solver.batch.grasp_batch import PER_POSE, GraspBatch
from clench.solver.preshapes import posture_choice
from clench.solver.preshapes.posture_choice import PostureSolver

HANDS = {name: clench.Hand.load(name) for name in ("robonaut2", "patent15")}
BOX = "box:x=0.05,y=0.06,z=0.08"


def some_poses(hand: clench.Hand, obj: clench.GraspObject, count: int = 2) -> list[Pose]:
    """Return approach poses, the same pushed and turned into the object, one far away, and one inside the object."""
    rng = np.random.default_rng(5)
    poses = []
    for pose in clench.approach_poses(hand, obj, count, 0):
        turned = pose.wxyz + 0.1 * rng.normal(size=4)
        poses += [pose, Pose(pose.position + 0.02 * rng.normal(size=3), turned / np.linalg.norm(turned))]
    return [*poses, Pose(poses[0].position + 5.0), Pose(obj.pose.position)]


def assert_same_bits(batch: GraspBatch, one_by_one: list[clench.GraspSolution]) -> None:
    assert len(batch) == len(one_by_one)
    for i, solution in enumerate(one_by_one):
        assert list(solution.joint_angles) == list(batch.joint_names)
        assert list(solution.joint_angles.values()) == batch.joint_angles[i].tolist()
        assert solution.status == batch.status[i]
        assert solution.certified == batch.certified[i]
        assert [solution.fingers[name].status for name in batch.finger_names] == batch.finger_status[i].tolist()
        part = slice(*batch.contacts.first[i : i + 2])
        c = batch.contacts
        named = [
            (batch.finger_names[f], batch.link_names[k], batch.body_names[b], batch.joint_names[j], p, q)
            for f, k, b, j, p, q in zip(
                c.finger[part], c.link[part], c.body[part], c.joint[part], c.plane[part], c.passed[part], strict=True
            )
        ]
        assert named == [
            (t.finger, t.link, t.body, t.stops_joint, -1 if t.plane is None else t.plane, t.passed)
            for t in solution.contacts
        ]
        for values, key in ((c.position, "position"), (c.normal, "normal"), (c.gap, "gap")):
            expected = np.array([getattr(t, key) for t in solution.contacts]).reshape(values[part].shape)
            np.testing.assert_allclose(values[part], expected, rtol=0.0, atol=1e-13)


def assert_equal_batches(a: GraspBatch, b: GraspBatch) -> None:
    for name in ("joint_angles", "status_codes", "certified", "finger_codes", "planes", "hand_poses", "object_poses"):
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name))
    for field in fields(a.contacts):
        np.testing.assert_array_equal(getattr(a.contacts, field.name), getattr(b.contacts, field.name))


@pytest.mark.parametrize("full_width", [True, False], ids=["certified", "planes"])
@pytest.mark.parametrize("model", ["mug", "ball", BOX])
@pytest.mark.parametrize("name", HANDS)
def test_the_bits_of_single_solves(name: str, model: str, full_width: bool) -> None:
    hand, obj = HANDS[name], clench.GraspObject.load(model)
    poses = some_poses(hand, obj)
    command = clench.GraspCommand(hand_pose=poses[0], full_width=full_width, planes=3, preshape="open")
    batch = clench.solve_batch(hand, obj, poses, command)
    assert batch.status[-2] == "no_contact"
    assert batch.status[-1] == "blocked" or model == "mug"  # whose middle is empty
    alone = [clench.solve(hand, obj, replace(command, hand_pose=pose)) for pose in poses]
    assert_same_bits(batch, alone)
    assert batch.certified.any() == full_width


def test_any_number_of_threads_and_any_chunk_give_the_same() -> None:
    hand, obj = HANDS["patent15"], clench.GraspObject.load("ball")
    poses = some_poses(hand, obj, 4)
    one = clench.solve_batch(hand, obj, poses, threads=1)
    for threads, chunk in ((2, 1000), (3, 3), (1, 1), (2, 7)):
        assert_equal_batches(one, clench.solve_batch(hand, obj, poses, threads=threads, chunk=chunk))
    streamed = list(clench.solve_stream(hand, obj, iter(poses), chunk=4))
    assert [len(part) for part in streamed] == [4, 4, 2]
    assert_equal_batches(one, GraspBatch.joined(streamed))


def test_poses_in_any_form() -> None:
    hand, obj = HANDS["patent15"], clench.GraspObject.load("ball")
    poses = some_poses(hand, obj)
    rows = np.array([np.concatenate([1.0001 * p.wxyz, p.position]) for p in poses])
    command = clench.GraspCommand(hand_pose=Pose.identity(), full_width=False, planes=2, preshape="open")
    again = [Pose(p.position, 1.0001 * p.wxyz) for p in poses]
    assert_equal_batches(clench.solve_batch(hand, obj, again, command), clench.solve_batch(hand, obj, rows, command))
    matrices = np.array([p.matrix for p in poses])
    from_matrices = clench.solve_batch(hand, obj, matrices, command)
    assert_same_bits(
        from_matrices,
        [clench.solve(hand, obj, replace(command, hand_pose=Pose.from_matrix(m))) for m in matrices],
    )


def test_objects_preshapes_and_root_links_of_their_own() -> None:
    hand, obj = HANDS["robonaut2"], clench.GraspObject.load("ball")
    poses = some_poses(hand, obj)[:3]
    there = [Pose(obj.pose.position + np.array([0.002 * k, 0.0, 0.0])) for k in range(3)]
    yaw = next(j.name for j in hand.joints if j.role is clench.JointRole.POSTURE and j.lower < 0.0 < j.upper)
    turns = [0.05, 0.0, 0.05]
    root = hand.links[hand.palm].name
    command = clench.GraspCommand(hand_pose=Pose.identity(), planes=2, root_link=root, preshape="open")
    batch = clench.solve_batch(hand, obj, poses, command, object_poses=there, preshapes={yaw: turns})
    alone = [
        clench.solve(hand, obj, replace(command, hand_pose=p, object_pose=o, preshape={yaw: t}))
        for p, o, t in zip(poses, there, turns, strict=True)
    ]
    assert_same_bits(batch, alone)
    for i, solution in enumerate(alone):
        assert batch.solution(i).joint_angles == solution.joint_angles


@pytest.mark.parametrize(
    "asked",
    [
        {"order": clench.ClosingOrder.TOGETHER},
        {"rounds": 2},
        {"open_variants": (0.0, 0.1)},
        {"criteria": {"clearance": 1.0}, "full_width": False},
        {"check_candidates": True},
        {"orders": ("proximal-first", "together")},
    ],
    ids=lambda asked: next(iter(asked)),
)
def test_every_command_has_the_bits_of_single_solves(asked: dict[str, object]) -> None:
    hand, obj = HANDS["patent15"], clench.GraspObject.load("ball")
    poses = some_poses(hand, obj, 1)[::2]
    command = clench.GraspCommand(hand_pose=poses[0], planes=1, **{"preshape": "open", **asked})  # type: ignore[arg-type]
    batch = clench.solve_batch(hand, obj, poses, command)
    assert_same_bits(batch, [clench.solve(hand, obj, replace(command, hand_pose=pose)) for pose in poses])


def test_fingers_that_meet_are_closed_anew() -> None:
    """Fingers of a hand around something thin run into each other; the thumb, asked for last, gives way."""
    hand, obj = HANDS["patent15"], clench.GraspObject.load("cylinder:r=0.004,h=0.2")
    poses = some_poses(hand, obj, 6)
    command = clench.GraspCommand(hand_pose=poses[0], planes=2, preshape="open")
    alone = [clench.solve(hand, obj, replace(command, hand_pose=pose)) for pose in poses]
    assert any(f.get("closed_again") for s in alone for f in (s.choice or {})["fingers"].values())
    assert_same_bits(clench.solve_batch(hand, obj, poses, command), alone)


def test_no_pose_at_all() -> None:
    hand, obj = HANDS["patent15"], clench.GraspObject.load("ball")
    batch = clench.solve_batch(hand, obj, [])
    assert len(batch) == len(batch.contacts) == 0
    assert batch.joint_angles.shape == (0, len(hand.joints))
    assert list(clench.solve_stream(hand, obj, iter([]))) == []


GOOD = np.array([[1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]])
MIRROR = np.diag([1.0, 1.0, -1.0, 1.0])


@pytest.mark.parametrize(
    ("poses", "more", "sentence"),
    [
        (np.zeros((2, 3)), {}, r"hand_poses: expected poses, an array \(N, 7\) .*, got shape \(2, 3\)\."),
        (Pose.identity(), {}, r"hand_poses: expected poses, .*, got one pose\."),
        ("abc", {}, r"hand_poses: expected poses, "),
        (GOOD * np.nan, {}, r"hand_poses\[0\]: expected finite numbers\."),
        (np.zeros((1, 7)), {}, r"hand_poses\[0\]: expected a unit quaternion \[w, x, y, z\] first, got norm 0\."),
        (MIRROR[None], {}, r"hand_poses\[0\]: expected a rotation .* determinant -1\)\."),
        (2.0 * np.eye(4)[None], {}, r"hand_poses\[0\]: expected a rotation"),
        ((np.eye(4) + np.eye(4, k=-3))[None], {}, r"hand_poses\[0\]: expected the last row \[0, 0, 0, 1\]"),
        (GOOD, {"object_poses": [Pose.identity()] * 2}, r"object_poses: expected 1 poses, one per hand pose, got 2\."),
        (GOOD, {"preshapes": {"x": [0.0, 1.0]}}, r"preshapes\.x: expected 1 finite angles in rad, one per pose, got"),
        (GOOD, {"preshapes": {"x": [0.0]}}, r"Joint 'x' is not in hand 'patent15'"),
        (GOOD, {"threads": 0}, r"threads: expected a whole number of at least 1, got 0\."),
        (GOOD, {"chunk": 2.5}, r"chunk: expected a whole number of at least 1, got 2\.5\."),
    ],
)  # fmt: skip
def test_bad_input_gets_one_sentence(poses: object, more: dict[str, object], sentence: str) -> None:
    with pytest.raises(ClenchError, match=f"^{sentence}"):
        clench.solve_batch(HANDS["patent15"], clench.GraspObject.load("ball"), poses, **more)  # type: ignore[arg-type]


def test_a_stream_with_too_few_objects() -> None:
    hand, obj = HANDS["patent15"], clench.GraspObject.load("ball")
    stream = clench.solve_stream(hand, obj, [Pose([1.0, 0.0, 0.0])] * 3, object_poses=[obj.pose] * 2)
    with pytest.raises(CommandError, match="as many poses as hand_poses"):
        next(stream)


def test_a_saved_batch_is_read_with_numpy(tmp_path) -> None:
    hand, obj = HANDS["patent15"], clench.GraspObject.load("ball")
    batch = clench.solve_batch(hand, obj, some_poses(hand, obj, 1))
    batch.save(tmp_path / "grasps.npz")
    with np.load(tmp_path / "grasps.npz", allow_pickle=False) as data:
        assert str(data["schema"]) == "clench.batch/1"
        np.testing.assert_array_equal(data["joint_angles"], batch.joint_angles)
        assert data["status"].tolist() == batch.status.tolist()
        assert data["joint_names"].tolist() == list(hand.joint_names)
        np.testing.assert_array_equal(data["contact_position"], batch.contacts.position)
    with pytest.raises(CommandError, match="expected a pose from 0 to"):
        batch.solution(99)


def test_padded_contacts() -> None:
    hand, obj = HANDS["patent15"], clench.GraspObject.load("ball")
    batch = clench.solve_batch(hand, obj, some_poses(hand, obj, 2))
    padded = batch.contacts.padded(batch.contacts.position, np.nan)
    assert padded.shape[0] == len(batch)
    for i, rows in enumerate(padded):
        part = batch.contacts.position[slice(*batch.contacts.first[i : i + 2])]
        np.testing.assert_array_equal(rows[: len(part)], part)
        assert np.isnan(rows[len(part) :]).all()


@pytest.mark.parametrize(("patience", "wanted", "seen"), [(60.0, True, False), (0.0, True, True), (0.0, False, False)])
def test_a_bar_appears_after_a_while(
    patience: float, wanted: bool, seen: bool, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("TTY_INTERACTIVE", "1")
    monkeypatch.setenv("TTY_COMPATIBLE", "1")
    monkeypatch.setattr(batch_progress, "PATIENCE", patience)
    with batch_progress.shown(10, wanted) as advance:
        time.sleep(0.01)
        advance(5)
    assert ("5/10" in capsys.readouterr().err) == seen


def test_every_shipped_form_of_hand_is_packed_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Postures that repeat are planned once, however the poses are mixed."""
    made = []
    monkeypatch.setattr(posture_choice, "BatchSolver", lambda *a: made.append(a) or BatchSolver(*a))
    hand, obj = HANDS["robonaut2"], clench.GraspObject.load("ball")
    yaw = next(j.name for j in hand.joints if j.role is clench.JointRole.POSTURE and j.lower < 0.0 < j.upper)
    far = [Pose([k, 5.0, 0.0]) for k in range(6)]
    command = clench.GraspCommand(hand_pose=far[0], planes=1, full_width=False, preshape="open")
    clench.solve_batch(hand, obj, far, command, preshapes={yaw: [0.0, 0.01] * 3})
    assert len(made) == 2


def test_vectors_are_turned_with_the_same_bits_alone_and_together() -> None:
    from clench.solver.batch.batch_solver import rotations, turned

    rng = np.random.default_rng(0)
    rows, vectors = rng.normal(size=(200, 7)), rng.normal(size=(200, 3))
    rows[:, :4] /= np.linalg.norm(rows[:, :4], axis=1)[:, None]
    together = turned(rotations(rows), vectors)
    np.testing.assert_allclose(together, np.einsum("cij,cj->ci", rotations(rows), vectors), rtol=0.0, atol=1e-14)
    alone = [turned(rotations(rows[k : k + 1]), vectors[k : k + 1])[0] for k in range(200)]
    np.testing.assert_array_equal(together, alone)


@pytest.mark.parametrize("asked", [{"preshape": "open"}, {}, {"preshape": "open", "order": "together"}])
def test_a_solution_of_a_batch_needs_no_other_solve(monkeypatch, asked):
    hand, obj = clench.Hand.load("robonaut2"), clench.GraspObject.load("mug")
    poses = clench.approach_poses(hand, obj, 5, 0)
    batch = clench.solve_batch(hand, obj, poses, clench.GraspCommand(hand_pose=poses[0], **asked))
    expected = [plain(clench.solve(hand, obj, clench.GraspCommand(hand_pose=pose, **asked))) for pose in poses]
    assert all(("preshapes" in document["choice"]) == (not asked) for document in expected)
    some = batch[[3, 1]]
    copied = pickle.loads(pickle.dumps(batch))
    monkeypatch.setattr("clench.solver.solve.solve", lambda *args: pytest.fail("solved again"))
    assert [plain(batch.solution(i)) for i in range(5)] == expected
    assert plain(batch.solution(-1)) == expected[-1]
    assert [plain(some.solution(i)) for i in range(2)] == [expected[3], expected[1]]
    # A copy has no answers of the kernels.
    again, solved = batch.solution(1), []
    monkeypatch.setattr("clench.solver.solve.solve", lambda *args: solved.append(args[2]) or again)
    copied.solution(1)
    assert [command.hand_pose for command in solved] == [poses[1]]


def test_the_reason_for_a_posture_is_found_when_it_is_read(monkeypatch):
    hand, obj = clench.Hand.load("robonaut2"), clench.GraspObject.load("mug")
    poses = clench.approach_poses(hand, obj, 2, 0)
    batch = clench.solve_batch(hand, obj, poses, clench.GraspCommand(hand_pose=poses[0]))
    compared = []
    choose = PostureSolver.choose_one
    monkeypatch.setattr(PostureSolver, "choose_one", lambda self: compared.append(self) or choose(self))
    solution = batch.solution(1)
    assert solution.joint_angles
    assert compared == []
    assert solution.choice["preshapes"]["chosen"] == batch.preshape[1]
    assert len(compared) == 1


def test_a_batch_keeps_answers_up_to_a_limit(monkeypatch):
    monkeypatch.setattr("clench.solver.batch.kept_answers.MOST_KEPT", 60_000)
    monkeypatch.setattr("clench.solver.batch.grasp_batch.MOST_KEPT", 60_000)
    hand, obj = clench.Hand.load("robonaut2"), clench.GraspObject.load("ball")
    poses = clench.approach_poses(hand, obj, 12, 0)
    asked = clench.GraspCommand(hand_pose=poses[0], preshape="open")
    batch = clench.solve_batch(hand, obj, poses, asked, chunk=2)
    expected = [plain(clench.solve(hand, obj, batch.command(i))) for i in (0, 11)]
    assert [plain(batch.solution(i)) for i in (0, 11)] == expected
    monkeypatch.setattr("clench.solver.solve.solve", lambda *args: "solved")
    assert plain(batch.solution(0)) == expected[0]
    assert batch.solution(11) == "solved"


def plain(solution):
    """Return a solution's document without the times."""
    return {**solution.to_dict(), "timing": {}}


def arrays_of(batch):
    """Return all arrays of a batch by name, and all names of its columns."""
    own = {name: getattr(batch, name) for name in (*PER_POSE, "status", "finger_status", "preshape")}
    names = {name: getattr(batch, name) for name in ("joint_names", "finger_names", "link_names", "body_names")}
    return own | {f.name: getattr(batch.contacts, f.name) for f in fields(batch.contacts)} | names


def assert_same_batch(a, b):
    ours, theirs = arrays_of(a), arrays_of(b)
    for name, values in ours.items():
        assert np.array_equal(values, theirs[name]), name
        if isinstance(values, np.ndarray):
            assert values.dtype == theirs[name].dtype


def test_a_batch_is_filtered_by_masks_rows_and_slices():
    hand, obj = clench.Hand.load("robonaut2"), clench.GraspObject.load("mug")
    batch = clench.solve_batch(hand, obj, clench.approach_poses(hand, obj, 12, 0))
    mask = batch.status == "grasp"
    assert 1 < mask.sum() < len(batch)
    grasps = batch[mask]
    assert set(grasps.status) == {"grasp"}
    assert_same_batch(grasps, batch[np.flatnonzero(mask)])
    assert_same_batch(batch[3:9:2], batch[[3, 5, 7]])
    assert_same_batch(batch[-2:], batch[[-2, -1]])
    assert_same_batch(batch[::-1][::-1], batch)
    k = int(np.flatnonzero(mask)[1])
    first, last = batch.contacts.first[k : k + 2]
    np.testing.assert_array_equal(grasps[[1]].contacts.position, batch.contacts.position[first:last])
    assert plain(grasps.solution(1)) == plain(batch.solution(k))
    assert len(batch[[]]) == len(batch[np.zeros(12, dtype=bool)]) == len(batch[[]].contacts) == 0
    for wrong in (3, [12], [-13], [0.5], np.ones(11, dtype=bool), "grasp", [[1]], None):
        with pytest.raises(CommandError, match=r"^batch: expected a mask of 12 values, numbers of poses up to 11"):
            batch[wrong]


@pytest.mark.parametrize("asked", [{}, {"preshape": "open"}, {"preshape": {"index_yaw": 0.05}, "order": "together"}])
def test_a_saved_batch_is_loaded_with_its_bits(tmp_path, asked):
    hand, obj = clench.Hand.load("robonaut2"), clench.GraspObject.load("sphere:r=0.03", scale=1.1)
    poses = clench.approach_poses(hand, obj, 6, 1)
    batch = clench.solve_batch(hand, obj, poses, clench.GraspCommand(poses[0], **asked))
    batch.save(tmp_path / "b.npz")
    loaded = GraspBatch.load(tmp_path / "b.npz")
    assert_same_batch(loaded, batch)
    assert plain(loaded.solution(2)) == plain(batch.solution(2))
    loaded[[2, 4]].save(tmp_path / "some.npz")
    assert_same_batch(GraspBatch.load(tmp_path / "some.npz"), batch[[2, 4]])


def test_a_saved_batch_with_given_postures_is_loaded(tmp_path):
    hand, obj = clench.Hand.load("robonaut2"), clench.GraspObject.load("ball")
    poses, angles = clench.approach_poses(hand, obj, 4, 1), {"index_yaw": [0.0, 0.05, 0.0, -0.05]}
    batch = clench.solve_batch(hand, obj, poses, preshapes=angles)
    batch.save(tmp_path / "b.npz")
    loaded = GraspBatch.load(tmp_path / "b.npz")
    assert_same_batch(loaded, batch)
    assert plain(loaded.solution(3)) == plain(batch.solution(3))


def test_a_batch_is_loaded_for_what_was_solved_alone(tmp_path):
    hand, ball = clench.Hand.load("robonaut2"), clench.GraspObject.load("ball")
    scene = ball.with_body(clench.table(-0.04))
    path = tmp_path / "b.npz"
    clench.solve_batch(hand, scene, clench.approach_poses(hand, scene, 2, 1)).save(path)
    with pytest.raises(ClenchError, match=r"another geometry of object 'ball': give obj=, the object with 'table'"):
        GraspBatch.load(path)
    assert len(GraspBatch.load(path, obj=scene)) == 2
    with pytest.raises(ClenchError, match="another geometry of hand 'patent15': give hand="):
        GraspBatch.load(path, clench.Hand.load("patent15"), scene)
    found = dict(np.load(path))
    np.savez(path, **found | {"contact_link": found["contact_link"] + 1000})
    with pytest.raises(ClenchError, match="its arrays do not fit each other"):
        GraspBatch.load(path, obj=scene)


def test_internals_are_not_shown():
    hand, ball = clench.Hand.load("robonaut2"), clench.GraspObject.load("ball")
    batch = clench.solve_batch(hand, ball, clench.approach_poses(hand, ball, 1, 1))
    for shown in (dir(batch), dir(batch.solution(0))):
        assert not {"with_late", "with_known", "keeping", "question", "joined", "_make_field"} & set(shown)
        assert "joint_angles" in shown
    assert {"load", "save", "status", "contacts", "counts"} <= set(dir(batch))
