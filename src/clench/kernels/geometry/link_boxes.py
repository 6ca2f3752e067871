"""Boxes around bodies: what no face of either keeps apart may touch."""

from __future__ import annotations

from clench.kernels.closing.layout import Floats, Ints
from clench.kernels.runtime.compiling import entry_kernel, kernel


@kernel
def face_keeps_apart(box: Floats, poses: Floats, m: int, r: int) -> bool:
    """Say whether a face of the box around body `m` keeps it apart from the one around body `r`; see `mark_meeting`."""
    A, B = poses[m], poses[r]
    for k in range(3):
        away, reach = 0.0, box[m, 3 + k]
        for i in range(3):
            there, here = B[i, 3], A[i, 3]
            for j in range(3):
                there += B[i, j] * box[r, j]
                here += A[i, j] * box[m, j]
            away += A[i, k] * (there - here)
        for j in range(3):
            reach += abs(A[0, k] * B[0, j] + A[1, k] * B[1, j] + A[2, k] * B[2, j]) * box[r, 3 + j]
        # Bodies without elements have boxes of no size, and numbers that are none.
        if not abs(away) <= reach:
            return True
    return False


@kernel
def boxes_meet(box: Floats, poses: Floats, m: int, r: int) -> bool:
    """Say whether no face of either box keeps two bodies apart."""
    return not face_keeps_apart(box, poses, m, r) and not face_keeps_apart(box, poses, r, m)


@entry_kernel
def mark_meeting(box: Floats, poses: Floats, meet: Ints) -> None:
    """Write which bodies have boxes that no face of either keeps apart, (B, B).

    Args:
        box: middle and half size in the body's frame [m], (B, 6). poses: of the bodies, (B, 3, 4).
    """
    for m in range(meet.shape[0]):
        for r in range(meet.shape[0]):
            meet[m, r] = 1 if boxes_meet(box, poses, m, r) else 0
