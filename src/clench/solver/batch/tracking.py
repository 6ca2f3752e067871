"""Follow a moving object or wrist: one command, packed once, answered cycle after cycle."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Final

import numpy as np

from clench.core.argument_types import check_type
from clench.core.exceptions import CommandError
from clench.core.pose import Pose
from clench.core.showing.short_repr import described
from clench.models.command import GraspCommand, as_command
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import GraspObject
from clench.solver.preshapes.posture_choice import first_choice

from .batch_solver import BatchSolver
from .grasp_batch import GraspBatch

#: A finger leaves its plane only if another plane's weighted sum is better by this [-].
MARGIN: Final = 0.05


class Tracker:
    """Answer one command for poses that change from cycle to cycle.

    Every answer is computed anew and guarantees the same as `clench.solve`. Without the full width, the tracker keeps
    one thing from the last cycle: the plane of each finger. A finger keeps its plane unless another plane's weighted
    sum is better by `margin`, or the finger touches only on another plane. With the full width there is one candidate
    per finger and nothing to choose. The answer then has the bits of `clench.solve`.

    Args:
        hand, obj: as for `clench.solve`.
        command: the request at the first pose, or the first pose; one open posture per finger and one order. If it
            leaves the posture to clench, the tracker keeps the best posture of the first pose.
        margin: see above [-]; 0 chooses as `clench.solve` does.

    Raises:
        CommandError: a command with several postures or another order, and see `clench.solve`.
    """

    def __init__(self, hand: Hand, obj: GraspObject, command: GraspCommand | Pose, *, margin: float = MARGIN) -> None:
        if isinstance(margin, bool) or not isinstance(margin, int | float) or not 0.0 <= margin < math.inf:
            raise CommandError(f"margin: expected a finite number of at least 0, got {margin!r}.")
        check_type(hand, Hand, "hand")
        check_type(obj, GraspObject, "obj")
        command = as_command(command)
        self._solver = BatchSolver(hand, obj, first_choice(hand, obj, command))
        candidates = self._solver.candidates
        if candidates is None or not candidates.by_kernel:
            raise CommandError(
                "Tracker: expected a command with one closing order and one open posture per finger, and without "
                "check_candidates; without full_width also criteria that are range_of_motion, touching_links and "
                "limit_distance alone. Use clench.solve for this one."
            )
        self._margin = margin
        self._hand_pose = command.hand_pose
        self._object_pose = obj.pose if command.object_pose is None else command.object_pose

    def __repr__(self) -> str:
        return described(self, hand_pose=self._hand_pose, object_pose=self._object_pose, margin=self._margin)

    def update(self, *, hand_pose: Pose | None = None, object_pose: Pose | None = None) -> GraspBatch:
        """Return the answer for new poses, as a batch of one; a pose that is not given is the one before.

        Args:
            hand_pose: as the command means it. object_pose: `T_world_object`.

        Raises:
            CommandError: the argument is no pose.
        """
        for pose, key in ((hand_pose, "hand_pose"), (object_pose, "object_pose")):
            if pose is not None:
                check_type(pose, Pose, key)
        self._hand_pose = hand_pose or self._hand_pose
        self._object_pose = object_pose or self._object_pose
        answer = self._solver.solve_one(self._hand_pose, self._object_pose)
        self._stay(answer)
        return answer

    def _stay(self, answer: GraspBatch) -> None:
        """Keep the planes that the fingers are on; see the class."""
        candidates = self._solver.candidates
        assert candidates is not None
        plan = candidates.plan
        if any(plan.is_full_width) or not self._margin:
            return
        from clench.kernels.closing.choosing import SAME_TOTAL

        finger_postures = np.arange(len(plan.fingers))
        planes = answer.planes[0, : len(finger_postures)]
        here = (plan.candidates.finger_posture == finger_postures[:, None]) & (plan.candidates.low == planes[:, None])
        problem = candidates.problem.staying(here.argmax(axis=1), self._margin / SAME_TOTAL)
        self._solver.candidates = replace(candidates, problem=problem)
