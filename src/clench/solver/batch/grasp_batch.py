"""The answers of many solves as arrays."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clench.core.caching.deferring import LateFields
from clench.core.exceptions import CommandError
from clench.core.files.json_files import write_atomically
from clench.core.pose import FloatArray
from clench.core.pose_arrays import pose_of_row
from clench.core.showing.short_repr import described, short_repr
from clench.solver.solution import FingerStatus, GraspSolution, SolutionStatus

from .kept_answers import MOST_KEPT, KeptAnswers
from .saved_question import question_arrays

if TYPE_CHECKING:
    from clench.models.command import GraspCommand
    from clench.models.hand.hand import Hand
    from clench.models.objects.grasp_object import GraspObject
    from clench.solver.preshapes.postures import PostureOption

Whole = NDArray[np.int64]

#: Meanings of a batch's codes, in order.
STATUSES: Final = tuple(SolutionStatus)
FINGER_STATUSES: Final = tuple(FingerStatus)
SCHEMA: Final = "clench.batch/1"
#: Columns with one row per pose.
PER_POSE: Final = (
    *("hand_poses", "object_poses", "status_codes", "certified", "joint_angles", "finger_codes", "planes"),
    "preshape_codes",
)


@dataclass(frozen=True, eq=False)
class BatchContacts:
    """The contacts of a batch, one pose after another, C in all.

    The contacts of pose i are the rows from `first[i]` up to `first[i + 1]`.

    Args:
        first: shape (N + 1,). finger, link, body, joint: indices into the batch's names, shape (C,): the touching
            finger and link, the touched body, and the joint that was stopped. plane: of the finger, -1 between planes.
        passed: a later motion opened it by more than 1 µm, shape (C,).
        position: [m], normal: unit, out of the object; in the world, shape (C, 3).
        gap: distance left at the final posture [m], shape (C,).
    """

    first: Whole
    finger: Whole
    link: Whole
    body: Whole
    joint: Whole
    plane: Whole
    passed: NDArray[np.bool_]
    position: FloatArray
    normal: FloatArray
    gap: FloatArray

    __repr__ = short_repr

    def __len__(self) -> int:
        return len(self.finger)

    def padded(self, values: NDArray[Any], fill: float = 0) -> NDArray[Any]:
        """Return a column by pose with as many places as the fullest pose has contacts, shape (N, most, ...).

        Args:
            values: a column of this table, shape (C, ...). fill: value where no contact exists.
        """
        counts = np.diff(self.first)
        filled = np.full((len(counts), int(counts.max(initial=0)), *values.shape[1:]), fill, dtype=values.dtype)
        filled[np.arange(filled.shape[1]) < counts[:, None]] = values
        return filled

    @classmethod
    def joined(cls, parts: Sequence[BatchContacts]) -> BatchContacts:
        """Return the contacts of several batches as one table."""
        counts = np.concatenate([np.diff(part.first) for part in parts])
        names = [f.name for f in fields(cls) if f.name != "first"]
        columns = {name: np.concatenate([getattr(part, name) for part in parts]) for name in names}
        return cls(first=np.concatenate([[0], np.cumsum(counts)]), **columns)


@dataclass(frozen=True, eq=False)
class Question:
    """The inputs of a batch, so that one of its poses can be solved by itself.

    Args:
        preshapes: angles by joint name [rad], shape (N,) each. options: postures that were compared at every pose.
    """

    hand: Hand
    obj: GraspObject
    command: GraspCommand
    preshapes: dict[str, FloatArray]
    options: tuple[PostureOption, ...] = ()

    __repr__ = short_repr


@dataclass(frozen=True, eq=False)
class GraspBatch(LateFields):
    """The answers of `clench.solve_batch` for N poses, as arrays; F fingers, J joints.

    Args:
        question: the request. joint_names, finger_names, link_names, body_names: names of the columns.
        hand_poses, object_poses: as asked, rows [w, x, y, z, X, Y, Z], shape (N, 7).
        status_codes: indices into `STATUSES`, shape (N,); `status` has their names.
        certified: whether the certificate of docs/method.md section 5 holds, shape (N,).
        joint_angles: of every joint [rad], shape (N, J).
        finger_codes: indices into `FINGER_STATUSES`, shape (N, F); `finger_status` has their names.
        planes: index of the chosen plane of each finger, -1 for the full width, shape (N, F).
        contacts: see `BatchContacts`.
        preshape_codes: index of the preshape that clench chose, shape (N,); `preshape` has their names.
    """

    _internal: ClassVar[frozenset[str]] = LateFields._internal | {"question", "keeping", "joined"}

    question: Question
    joint_names: tuple[str, ...]
    finger_names: tuple[str, ...]
    link_names: tuple[str, ...]
    body_names: tuple[str, ...]
    hand_poses: FloatArray
    object_poses: FloatArray
    status_codes: NDArray[np.int8]
    certified: NDArray[np.bool_]
    joint_angles: FloatArray
    finger_codes: NDArray[np.int8]
    planes: NDArray[np.int16]
    contacts: BatchContacts
    preshape_codes: NDArray[np.int16]

    def __repr__(self) -> str:
        asked = self.question
        return described(self, hand=asked.hand.name, object=asked.obj.name, poses=len(self), status=self.counts())

    def __len__(self) -> int:
        return len(self.status_codes)

    @property
    def status(self) -> NDArray[np.str_]:
        """Status of every pose by name, shape (N,)."""
        return np.array([s.value for s in STATUSES])[self.status_codes]

    @property
    def finger_status(self) -> NDArray[np.str_]:
        """Status of every finger by name, shape (N, F)."""
        return np.array([s.value for s in FINGER_STATUSES])[self.finger_codes]

    @property
    def preshape(self) -> NDArray[np.str_]:
        """Name of the preshape that clench chose at every pose, shape (N,); empty where the command left no choice."""
        names = [option.name for option in self.question.options]
        return np.array(names or [""])[self.preshape_codes]

    def counts(self) -> dict[str, int]:
        """Return how many poses have each status, by name."""
        return {s.value: int((self.status_codes == k).sum()) for k, s in enumerate(STATUSES)}

    def command(self, i: int) -> GraspCommand:
        """Return the command of one pose.

        Raises:
            CommandError: there is no such pose.
        """
        if not -len(self) <= i < len(self):
            raise CommandError(f"batch: expected a pose from 0 to {len(self) - 1}, got {i}.")
        asked = self.question
        return replace(
            asked.command,
            hand_pose=pose_of_row(self.hand_poses[i]),
            object_pose=pose_of_row(self.object_poses[i]),
            preshape=self._preshape(i),
        )

    def _preshape(self, i: int) -> Mapping[str, float] | str:
        """Return the preshape of one pose, as a command says it."""
        asked = self.question
        given = {name: float(angles[i]) for name, angles in asked.preshapes.items()}
        if asked.options:
            return {**asked.options[int(self.preshape_codes[i])].angles, **given}
        return {**asked.command.angles, **given} if given else asked.command.preshape

    def solution(self, i: int) -> GraspSolution:
        """Return the whole answer for one pose, as `clench.solve` gives it for the command of the pose; see `command`.

        If clench chose the posture, `choice["preshapes"]` has the reason, as of `clench.solve`. The postures are
        compared again at this pose when the reason is first read.

        A batch keeps what the kernels found at about two thousand poses. Other poses, and the poses of a batch from a
        file, are solved again.
        """
        from clench.solver.preshapes.posture_choice import with_reason
        from clench.solver.solve import solve

        asked, kept = self.question, self._kept_answers
        found = kept.solution(i) if kept is not None and -len(self) <= i < len(self) else None
        if found is None:
            found = solve(asked.hand, asked.obj, self.command(i))
        return with_reason(found, asked.hand, asked.obj, asked.command, asked.options) if asked.options else found

    def keeping(self, kept: KeptAnswers | None) -> GraspBatch:
        """Return the same batch with answers from which `solution` reads; copies and files do not have them."""
        return self.with_known(_answers=kept)

    @property
    def _kept_answers(self) -> KeptAnswers | None:
        found: KeptAnswers | None = self.__dict__.get("_answers")
        return found

    def save(self, path: str | Path) -> None:
        """Write all arrays and the request to a NumPy file (.npz), atomically; the names are columns of text.

        See `load`.

        Raises:
            FileError: the file cannot be written.
        """
        skipped = {"question", "contacts"}
        arrays = {f.name: np.asarray(getattr(self, f.name)) for f in fields(self) if f.name not in skipped}
        arrays |= {f"contact_{f.name}": getattr(self.contacts, f.name) for f in fields(self.contacts)}
        arrays |= question_arrays(self.question, self.preshape_codes)
        arrays |= {"schema": np.array(SCHEMA), "status": self.status}
        arrays |= {"finger_status": self.finger_status, "preshape": self.preshape}
        content = io.BytesIO()
        np.savez(content, **arrays)  # type: ignore[arg-type]
        write_atomically(path, content.getvalue())

    @classmethod
    def load(cls, path: str | Path, hand: Hand | None = None, obj: GraspObject | None = None) -> GraspBatch:
        """Read a file that `save` wrote; every array has the same bits.

        Args:
            path: the file. hand, obj: that were solved; None: loaded by the names in the file. An object with obstacles
                has to be given.

        Raises:
            FileError: no batch, or one of another hand or object. ClenchError: a model cannot be loaded.
        """
        from .batch_loading import load_batch

        return load_batch(path, hand, obj)

    @classmethod
    def joined(cls, parts: Sequence[GraspBatch]) -> GraspBatch:
        """Return several batches of the same question as one, in order."""
        columns: dict[str, Any] = {n: np.concatenate([getattr(part, n) for part in parts]) for n in PER_POSE}
        preshapes = [part.question.preshapes for part in parts]
        merged = {name: np.concatenate([each[name] for each in preshapes]) for name in preshapes[0]}
        kept = KeptAnswers.joined([part._kept_answers or KeptAnswers.none(len(part)) for part in parts])
        return replace(
            parts[0],
            question=replace(parts[0].question, preshapes=merged),
            contacts=BatchContacts.joined([part.contacts for part in parts]),
            **columns,
        ).keeping(kept)

    def __getitem__(self, rows: slice | ArrayLike) -> GraspBatch:
        """Return the poses of a mask of shape (N,), of some numbers, or of a slice, in their order.

        Raises:
            CommandError: no such poses. For a single pose, see `solution`.
        """
        order = self._rows(rows)
        counts = np.diff(self.contacts.first)[order]
        first = np.concatenate([[0], np.cumsum(counts)])
        of_contacts = np.repeat(self.contacts.first[order] - first[:-1], counts) + np.arange(int(first[-1]))
        names = [f.name for f in fields(self.contacts) if f.name != "first"]
        asked = self.question
        taken: dict[str, Any] = {n: getattr(self, n)[order] for n in PER_POSE}
        return replace(
            self,
            question=replace(asked, preshapes={name: a[order] for name, a in asked.preshapes.items()}),
            contacts=BatchContacts(first=first, **{n: getattr(self.contacts, n)[of_contacts] for n in names}),
            **taken,
        ).keeping(None if self._kept_answers is None else self._kept_answers.taken(order))

    def _rows(self, rows: slice | ArrayLike) -> Whole:
        """Return the numbers of poses, from 0; see `__getitem__`."""
        every = np.arange(len(self))
        if isinstance(rows, slice):
            return every[rows]
        chosen = np.asarray(rows)
        fits = chosen.dtype.kind in "iu" and bool(((chosen >= -len(self)) & (chosen < len(self))).all())
        fits = fits or chosen.shape == (0,) or (chosen.dtype == bool and chosen.shape == (len(self),))
        if chosen.ndim != 1 or not fits:
            raise CommandError(
                f"batch: expected a mask of {len(self)} values, numbers of poses up to {len(self) - 1}, or a slice, in "
                "square brackets; batch.solution(i) is a single pose."
            )
        found: Whole = every[chosen] if len(chosen) else every[:0]
        return found


def append_part(solved: list[GraspBatch], part: GraspBatch) -> None:
    """Append a part of a batch; what its kernels found is dropped where all parts would keep too much."""
    kept = [each._kept_answers for each in (*solved, part)]
    too_much = sum(each.size for each in kept if each is not None) > MOST_KEPT
    solved.append(part.keeping(None) if too_much else part)
