"""How two bodies of a hand move relative to each other while its joints move on lines (docs/method.md section 7).

Joints that move both bodies leave their gap as it is. Only the joints that move one of them count.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clench.kernels.closing.layout import Floats, Ints
from clench.kernels.geometry.bodies import BodyArrays
from clench.kernels.geometry.link_frames import FrameArrays, put_link
from clench.kernels.geometry.link_meshes import DepthWork, LinkMeshArrays, ObjectMesh, make_depth_work
from clench.kernels.geometry.vectors import Vector
from clench.kernels.hulls.body_sweep import sweep_body
from clench.kernels.runtime.compiling import kernel
from clench.kernels.sections.plane_pose import compose, compose_inverse, copy_pose, put_point

from .path_lines import PAIR, PathLines, keep_pair_lines, make_path_lines
from .toi_work import BodyPair, SweepWork, make_sweep_work


class PathProblem(NamedTuple):
    """List what a path is checked against; L links, J joints, P pairs, W way-points.

    Args:
        frames: the hand's kinematics. links: every link as a body, in its own frame.
        meshes: the links that have a shape, as triangles. mesh: number of each link in `meshes`, -1 without, (L,).
        lineage: whether link b (column) is link a (row) or one of its ancestors, (L, L).
        reach: largest distance of a link's points from the axis of a joint, at any posture [m], (L, J).
        pairs: two links that must stay apart; the second one is -1 for the object, (P, 2).
        allowed: how far each pair may overlap [m], (P,).
        object, solid: the object as a body, and as triangles. T_palm_object: its pose, (3, 4).
        path: way-points; every joint moves at constant speed between two of them [rad], (W, J).
    """

    frames: FrameArrays
    links: BodyArrays
    meshes: LinkMeshArrays
    mesh: Ints
    lineage: Ints
    reach: Floats
    pairs: Ints
    allowed: Floats
    object: BodyArrays
    solid: ObjectMesh
    T_palm_object: Floats
    path: Floats


class PathWork(NamedTuple):
    """The scratch space of a check: posture, poses of the links from the root, and buffers for gaps and depths.

    Args:
        normal: of the plane that parted the pair last, in the frame of the second body; 0 without one, (3,).
        turning: the joints that move one of a pair, (J,). arms: largest distances of its points from them [m], (J,).
        lines: ends of the straight lines of the path, and of those that the pair sees, see `path_lines`.
        left: largest relative motion of the pair from each end of a line to the end of the path [m], (W,).
    """

    q: Floats
    poses: Floats
    scratch: Floats
    placed: Floats
    normal: Floats
    turning: Ints
    arms: Floats
    lines: PathLines
    left: Floats
    sweep: SweepWork
    depth: DepthWork


@kernel(allocates=True)
def make_path_work(joints: int, links: int, points: int) -> PathWork:
    """Allocate the scratch space of a check."""
    return PathWork(
        np.empty(joints),
        np.empty((links, 3, 4)),
        np.empty((3, 3, 4)),
        np.empty((1, 3)),
        np.zeros(3),
        np.empty(joints, dtype=np.int64),
        np.empty(joints),
        make_path_lines(joints, links, points),
        np.empty(points),
        make_sweep_work(joints + 1, 0),
        make_depth_work(),
    )


@kernel
def moves_one(problem: PathProblem, m: int, r: int, link: int) -> bool:
    """Say whether the joint of a link moves `m`, and does not move `r` along with it."""
    return bool(problem.frames.joint[link] >= 0 and problem.lineage[m, link] != 0 and problem.lineage[r, link] == 0)


@kernel
def put_left(problem: PathProblem, m: int, r: int, work: PathWork) -> None:
    """Write the lines that a pair sees, and how far its points can move relative to each other until their end."""
    lines, left, count = work.lines, work.left, put_turning(problem, m, r, work)
    keep_pair_lines(problem.path, work.turning, count, lines)
    path, last = lines.path, lines.last[PAIR]
    left[last] = 0.0
    for n in range(last):
        k, motion = last - 1 - n, 0.0
        for i in range(count):
            j = work.turning[i]
            motion += abs(path[k + 1, j] - path[k, j]) * work.arms[i]
        left[k] = left[k + 1] + motion


@kernel
def put_turning(problem: PathProblem, m: int, r: int, work: PathWork) -> int:
    """Write to `work.turning` and `work.arms` the joints that move one of a pair; return how many there are."""
    frames, count = problem.frames, 0
    other = r if r >= 0 else frames.palm[0]
    for i in range(frames.joint.shape[0]):
        j = frames.joint[i]
        if moves_one(problem, m, other, i):
            work.turning[count], work.arms[count] = j, problem.reach[m, j]
            count += 1
        elif moves_one(problem, other, m, i):
            # The object is at rest in the palm's frame, where a joint before the palm moves the link.
            work.turning[count], work.arms[count] = j, problem.reach[r if r >= 0 else m, j]
            count += 1
    return count


@kernel
def place_pair(problem: PathProblem, m: int, r: int, k: int, t: float, work: PathWork) -> None:
    """Write the poses of a pair in the palm's frame to `work.sweep`, on a share `t` of its line `k`."""
    path, frames, palm = work.lines.path, problem.frames, problem.frames.palm[0]
    if t > 0.0:
        for j in range(path.shape[1]):
            work.q[j] = path[k, j] + t * (path[k + 1, j] - path[k, j])
    for i in range(frames.parent.shape[0]):
        needed = problem.lineage[m, i] != 0 or problem.lineage[palm, i] != 0
        if needed or (r >= 0 and problem.lineage[r, i] != 0):
            if t > 0.0:
                put_link(frames, i, work.q, work.scratch[0], work.scratch[1], work.poses)
            else:
                copy_pose(work.lines.stations[work.lines.kept[PAIR, k], i], work.poses[i])
    compose_inverse(work.poses[palm], work.poses[m], work.sweep.moving)
    if r >= 0:
        compose_inverse(work.poses[palm], work.poses[r], work.sweep.resting)
    else:
        copy_pose(problem.T_palm_object, work.sweep.resting)


@kernel
def put_row(
    problem: PathProblem, link: int, rate: float, count: int, pivot: Vector, work: PathWork
) -> tuple[int, Vector]:
    """Add the joint of a link to `work.sweep.spatial`, in the root's frame; return the number of rows and its pivot."""
    frames, T, row = problem.frames, work.poses[link], work.sweep.spatial[count]
    j = frames.joint[link]
    put_point(T, frames.anchor[j], work.placed[0])
    at = (work.placed[0, 0], work.placed[0, 1], work.placed[0, 2])
    row[0] = rate
    axis = turned(T, (frames.axis[j, 0], frames.axis[j, 1], frames.axis[j, 2]))
    for k in range(3):
        row[1 + k] = axis[k]
        if count > 0:
            work.sweep.spatial[count - 1, 4 + k] = at[k] - pivot[k]
    return count + 1, at


@kernel
def put_chain(
    problem: PathProblem, m: int, other: int, k: int, share: float, work: PathWork
) -> tuple[int, Vector, Vector]:
    """Write how link `m` moves as seen from link `other` on a share of a segment, see `spatial_motion`.

    Seen from a link, the joints that move the link turn the other way, the one next to the link first.

    Returns:
        the number of rows, 0 where neither moves, and the first and the last pivot in the root's frame [m].
    """
    joint, path, links = problem.frames.joint, work.lines.path, problem.frames.joint.shape[0]
    count, first, last = 0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    for n in range(2 * links):
        back = n < links
        i = links - 1 - n if back else n - links
        moves = moves_one(problem, other, m, i) if back else moves_one(problem, m, other, i)
        rate = share * (path[k + 1, joint[i]] - path[k, joint[i]]) if moves else 0.0
        if rate != 0.0:
            count, last = put_row(problem, i, -rate if back else rate, count, last, work)
            if count == 1:
                first = last
    if count == 1:
        # One joint alone has another layout; a second row that rests keeps the one of several.
        for c in range(3):
            work.sweep.spatial[0, 4 + c] = 0.0
            work.sweep.spatial[1, 1 + c] = work.sweep.spatial[0, 1 + c]
        work.sweep.spatial[1, 0] = 0.0
        count = 2
    return count, first, last


@kernel
def free_share(problem: PathProblem, m: int, r: int, k: int, t: float, touch: float, work: PathWork) -> float:
    """Return the share of the rest of a segment that a pair goes until it touches, 1 for all; `OVERLAP` as a sweep.

    The poses of the pair are those of `place_pair`.

    Args:
        m, r: the pair. k, t: its place on the path. touch: gaps up to this touch [m].
    """
    palm, sweep = problem.frames.palm[0], work.sweep
    count, first, last = put_chain(problem, m, r if r >= 0 else palm, k, 1.0 - t, work)
    if count == 0:
        return 1.0
    copy_pose(work.poses[m], sweep.moving)
    if r >= 0:
        copy_pose(work.poses[r], sweep.resting)
    else:
        compose(work.poses[palm], problem.T_palm_object, sweep.resting)
    for c in range(3):
        sweep.moving[c, 3] -= last[c]
        sweep.resting[c, 3] -= first[c]
    target, b = target_of(problem, r)
    return float(sweep_body(BodyPair(problem.links, m, target, b, sweep.spatial, count, touch), 1.0, sweep))


@kernel
def target_of(problem: PathProblem, r: int) -> tuple[BodyArrays, int]:
    """Return the bodies that the second one of a pair is among, and its number there."""
    if r >= 0:
        return problem.links, r
    return problem.object, 0


@kernel
def turned(T: Floats, p: Vector) -> Vector:
    """Return a vector in the frame that a pose leads to."""
    return (
        T[0, 0] * p[0] + T[0, 1] * p[1] + T[0, 2] * p[2],
        T[1, 0] * p[0] + T[1, 1] * p[1] + T[1, 2] * p[2],
        T[2, 0] * p[0] + T[2, 1] * p[1] + T[2, 2] * p[2],
    )


@kernel
def turned_back(T: Floats, p: Vector) -> Vector:
    """Return a vector in the frame that a pose comes from."""
    return (
        T[0, 0] * p[0] + T[1, 0] * p[1] + T[2, 0] * p[2],
        T[0, 1] * p[0] + T[1, 1] * p[1] + T[2, 1] * p[2],
        T[0, 2] * p[0] + T[1, 2] * p[1] + T[2, 2] * p[2],
    )
