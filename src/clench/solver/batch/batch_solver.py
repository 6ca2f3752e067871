"""Solve one command at arrays of poses: by one call of the kernels."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

import numpy as np

from clench.closing.finger_plan import closing_joints
from clench.closing.kernel_run import Answers, solve_packed
from clench.closing.motion import asked_fingers, palm_pose
from clench.core.caching.deferring import once
from clench.core.pose import FloatArray, Pose
from clench.core.pose_arrays import pose_of_row
from clench.models.command import GraspCommand
from clench.scoring.calibration import calibration_of
from clench.solver.alternatives import candidates_of
from clench.solver.clock import Clock
from clench.solver.pose_solver import PoseSolver, solve_posture
from clench.solver.problem import check_calibration, make_problem
from clench.solver.solution import FingerStatus, GraspSolution

from .devices import CPU, CUDA
from .grasp_batch import FINGER_STATUSES, STATUSES, BatchContacts, GraspBatch, Question
from .kept_answers import KeptAnswers, KeptPart

if TYPE_CHECKING:
    from clench.kernels.closing.solve_layout import Solved
    from clench.models.hand.hand import Finger, Hand
    from clench.models.objects.grasp_object import GraspObject


class BatchSolver:
    """A solver for one command at many poses. It checks and packs the command once.

    The posture is that of the command. If a command names none, the hand is open: `PostureSolver` chooses.

    Args:
        hand, obj, command: as for `clench.solve`; the command's `hand_pose` plays no part.

    Raises:
        ClenchError: see `clench.solve`.
    """

    def __init__(self, hand: Hand, obj: GraspObject, command: GraspCommand) -> None:
        from clench.kernels.runtime.warming import warm_up

        warm_up()
        self._question = Question(hand, obj, command, {})
        self._start = make_problem(hand, obj, command)
        asked = asked_fingers(hand, command)
        self.moving = [finger for finger in asked if closing_joints(hand, finger)]
        self._idle = [finger for finger in asked if finger not in self.moving]
        self._calibration = calibration_of(command.criteria)
        check_calibration(hand, self._calibration)
        #: The candidates that are closed; None for a command with several orders, which is solved pose by pose.
        self.candidates = None if command.orders else candidates_of(self._start, self._calibration)

    @property
    def fingers(self) -> list[Finger]:
        """The requested fingers: closing fingers first, in the command's order."""
        return [*self.moving, *self._idle]

    def solve(
        self, hand_rows: FloatArray, object_rows: FloatArray | None, threads: int, device: str = CPU
    ) -> GraspBatch:
        """Return the answers.

        Args:
            hand_rows: poses as the command means them, (N, 7). object_rows: poses of the object, (N, 7). None: its
                present pose.
            threads: how many are used. threads: number of threads. device: device that closes the fingers, see
                `clench.solve_batch`.
        """
        if object_rows is None:
            object_rows = np.repeat(self._start.T_world_object.wxyz_xyz[None], len(hand_rows), axis=0)
        if self.candidates is None:
            return self._one_by_one(hand_rows, object_rows, threads)
        palms = self._palms(hand_rows)
        answers = self._run(palms, object_rows, threads, device == CUDA)
        columns = self._columns(answers.solved, hand_rows, object_rows)
        batch = GraspBatch(**columns, contacts=_contacts_of(answers.solved, palms))
        # Answers of a device differ from those of a solve in their last bits. Other choices are made pose by pose.
        if device != CPU or not self.candidates.by_kernel:
            return batch
        return batch.keeping(KeptAnswers.of(KeptPart(self._read, answers, palms, object_rows)))

    def solve_one(self, hand_pose: Pose, object_pose: Pose) -> GraspBatch:
        """Return the answer for one pose; its contacts are made when they are first read."""
        hand_rows, object_rows = np.array([hand_pose.wxyz_xyz]), np.array([object_pose.wxyz_xyz])
        # A copy protects late reads from later changes to the answer.
        palms = self._palms(hand_rows).copy()
        solved = self._run(palms, object_rows, 1, False).solved
        columns = self._columns(solved, hand_rows, object_rows)
        contacts = once(partial(_contacts_of, solved, palms))
        return GraspBatch.with_late(lambda _: contacts(), **columns)

    def _run(self, palms: FloatArray, object_rows: FloatArray, threads: int, on_device: bool) -> Answers:
        """Close, choose and judge at all poses."""
        candidates = self.candidates
        assert candidates is not None

        def choose(n: int, answers: Answers) -> tuple[list[int], bool]:
            problem = self._start.at(pose_of_row(palms[n]), pose_of_row(object_rows[n]))
            return PoseSolver(problem, self._calibration, candidates).choose(answers)

        return solve_packed(
            candidates.problem,
            related(palms, object_rows),
            choose=None if candidates.by_kernel else choose,
            threads=threads,
            on_device=on_device,
        )

    def _read(self, answers: Answers, palm: FloatArray, there: FloatArray) -> GraspSolution:
        """Return the solution of answers for one pose of the palm and the object, (7,) each."""
        assert self.candidates is not None
        clock = Clock()
        problem = self._start.at(pose_of_row(palm), pose_of_row(there))
        solver = PoseSolver(problem, self._calibration, self.candidates)
        clock.lap("read")
        return solver.solution(answers, clock.stages())

    def _palms(self, hand_rows: FloatArray) -> FloatArray:
        """Return the poses of the palm, (N, 7)."""
        command, problem = self._question.command, self._start
        if command.root_link is None:
            return hand_rows
        placed = (replace(command, hand_pose=pose_of_row(row)) for row in hand_rows)
        poses = [palm_pose(problem.hand, each, problem.start).wxyz_xyz for each in placed]
        return np.array(poses).reshape(-1, 7)

    def _columns(self, solved: Solved, hand_rows: FloatArray, object_rows: FloatArray) -> dict[str, Any]:
        """Name the columns that the kernels computed, except the contacts."""
        assert self.candidates is not None
        plan = self.candidates.plan
        chosen = np.where(np.array(plan.is_full_width), -1, plan.candidates.low)[solved.chosen]
        idle = np.full((len(hand_rows), len(self._idle)), FINGER_STATUSES.index(FingerStatus.NO_MOTION))
        return {
            **self.names,
            "hand_poses": hand_rows,
            "object_poses": object_rows,
            "status_codes": solved.status.astype(np.int8),
            "certified": solved.certified.astype(np.bool_),
            "joint_angles": solved.angles,
            "finger_codes": np.concatenate([solved.fingers, idle], axis=1).astype(np.int8),
            "planes": np.concatenate([chosen, np.full_like(idle, -1)], axis=1).astype(np.int16),
            "preshape_codes": np.zeros(len(hand_rows), dtype=np.int16),
        }

    @cached_property
    def names(self) -> dict[str, Any]:
        """The fields of a batch that are the same for all poses."""
        problem = self._start
        return {
            "question": self._question,
            "joint_names": problem.hand.joint_names,
            "finger_names": tuple(finger.name for finger in self.fingers),
            "link_names": tuple(link.name for link in problem.hand.links),
            "body_names": problem.packed.body_names,
        }

    def _one_by_one(self, hand_rows: FloatArray, object_rows: FloatArray, threads: int) -> GraspBatch:
        """Solve every pose by itself, and read the solutions."""
        asked = self._question

        def run(rows: tuple[FloatArray, FloatArray]) -> GraspSolution:
            hand_pose, object_pose = map(pose_of_row, rows)
            return solve_posture(
                asked.hand, asked.obj, replace(asked.command, hand_pose=hand_pose, object_pose=object_pose)
            )

        with ThreadPoolExecutor(threads, thread_name_prefix="clench-batch") as pool:
            solutions = list(pool.map(run, zip(hand_rows, object_rows, strict=True)))
        fingers = [[s.fingers[finger.name] for finger in self.fingers] for s in solutions]
        shape = (len(solutions), len(self.fingers))
        planes = [[-1 if f.best is None else _plane(f.best.plane) for f in row] for row in fingers]
        codes = [[FINGER_STATUSES.index(f.status) for f in row] for row in fingers]
        return GraspBatch(
            **self.names,
            hand_poses=hand_rows,
            object_poses=object_rows,
            status_codes=np.array([STATUSES.index(s.status) for s in solutions], dtype=np.int8),
            certified=np.array([s.certified for s in solutions], dtype=np.bool_),
            joint_angles=np.array([list(s.joint_angles.values()) for s in solutions]).reshape(
                len(solutions), len(asked.hand.joints)
            ),
            finger_codes=np.array(codes, dtype=np.int8).reshape(shape),
            planes=np.array(planes, dtype=np.int16).reshape(shape),
            contacts=self._contacts(solutions),
            preshape_codes=np.zeros(len(solutions), dtype=np.int16),
        )

    def _contacts(self, solutions: list[GraspSolution]) -> BatchContacts:
        hand, bodies = self._question.hand, self._start.packed.body_names
        names = [finger.name for finger in self.fingers]
        all_contacts = [c for s in solutions for c in s.contacts]
        return BatchContacts(
            first=np.cumsum([0, *(len(s.contacts) for s in solutions)]),
            finger=_numbers([names.index(c.finger) for c in all_contacts]),
            link=_numbers([hand.link_index(c.link) for c in all_contacts]),
            body=_numbers([bodies.index(c.body) for c in all_contacts]),
            joint=_numbers([-1 if c.stops_joint is None else hand.joint_index(c.stops_joint) for c in all_contacts]),
            plane=_numbers([_plane(c.plane) for c in all_contacts]),
            passed=np.array([c.passed for c in all_contacts], dtype=np.bool_),
            position=np.array([c.position for c in all_contacts]).reshape(-1, 3),
            normal=np.array([c.normal for c in all_contacts]).reshape(-1, 3),
            gap=np.array([c.gap for c in all_contacts], dtype=np.float64),
        )


def related(palms: FloatArray, object_rows: FloatArray) -> FloatArray:
    """Return `T_palm_object` of poses of both, (N, 7) each, as (N, 3, 4)."""
    from clench.kernels.geometry.link_frames import relate_poses

    T_palm_object = np.empty((len(palms), 3, 4))
    relate_poses(palms, object_rows, T_palm_object)
    return T_palm_object


def _contacts_of(solved: Solved, palms: FloatArray) -> BatchContacts:
    """Return the contacts that the kernels found in the world.

    Args:
        solved: for N poses. palms: poses of the palm, (N, 7).
    """
    from clench.core.tolerances import PASSED_GAP
    from clench.kernels.closing.contact_reading import (
        PALM_CONTACT_BODY,
        PALM_CONTACT_GAP,
        PALM_CONTACT_JOINT,
        PALM_CONTACT_LINK,
        PALM_CONTACT_NORMAL,
        PALM_CONTACT_PLANE,
    )

    slots = np.arange(solved.number.shape[2])
    # As in a solution, contacts with the hand's own links are left out.
    found = (slots < solved.contacts[:, :, None]) & (solved.number[..., PALM_CONTACT_BODY] >= 0)
    pose, finger, slot = np.nonzero(found)
    number, value = solved.number[pose, finger, slot], solved.value[pose, finger, slot]
    R = rotations(palms[pose])
    return BatchContacts(
        first=np.concatenate([[0], np.cumsum(found.sum(axis=(1, 2)))]),
        finger=finger,
        link=number[:, PALM_CONTACT_LINK],
        body=number[:, PALM_CONTACT_BODY],
        joint=number[:, PALM_CONTACT_JOINT],
        plane=number[:, PALM_CONTACT_PLANE],
        passed=value[:, PALM_CONTACT_GAP] > PASSED_GAP,
        position=turned(R, value[:, :3]) + palms[pose, 4:],
        normal=turned(R, value[:, PALM_CONTACT_NORMAL : PALM_CONTACT_NORMAL + 3]),
        gap=value[:, PALM_CONTACT_GAP],
    )


def rotations(rows: FloatArray) -> FloatArray:
    """Return the rotation matrices of poses (N, 7), shape (N, 3, 3)."""
    w, x, y, z = rows[:, :4].T
    entries = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(entries), -1, 0)


def turned(R: FloatArray, vectors: FloatArray) -> FloatArray:
    """Return vectors (N, 3) turned by matrices (N, 3, 3), each with the same bits however many there are."""
    x, y, z = (vectors[:, None, k] for k in range(3))
    return R[:, :, 0] * x + R[:, :, 1] * y + R[:, :, 2] * z


def _plane(plane: int | None) -> int:
    return -1 if plane is None else plane


def _numbers(values: list[int]) -> np.ndarray:
    return np.array(values, dtype=np.int64)
