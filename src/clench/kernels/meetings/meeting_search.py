"""Find the first meetings of links of simultaneously closing fingers (docs/method.md section 5).

A pair of links advances in steps that cannot pass a meeting. The pair that has advanced least goes next. A plane that
keeps their hulls apart at both ends of a step does so in between, except for the bend of the paths. If hulls of links
are near, each pair of their parts has its own plane; if parts are near, each pair of elements. If no plane keeps links
apart, a step is as long as their gap allows.
"""

from __future__ import annotations

import math

from clench.kernels.closing.layout import CandidateArrays, Floats, Ints
from clench.kernels.geometry.vectors import Vector, dot, plus, scaled
from clench.kernels.hulls.near_hulls import links_parting
from clench.kernels.runtime.compiling import kernel
from clench.kernels.toi.full_width import FullWidthArrays
from clench.kernels.toi.toi_work import SweepWork, bodies_overlap

from .finger_motion import (
    ROUNDING,
    approach_along,
    even_until,
    last_end,
    links_of,
    place_links_at,
    put_axes,
    speeds_of,
)
from .hull_planes import find_plane, plane_between
from .meeting_layout import FingerLinks, LinkPair, MeetingWork
from .near_links import LENGTHS, TOUCH, elements_gap, links_gap, lowest_on, shorter_step, step_by_parts

#: Links whose hulls are nearer than this are measured part by part, and those nearer than that by elements [m].
NEAR, CLOSE = 1e-5, 1e-7
#: Up to which gap elements are measured at first, and how that grows while they are farther apart [m, -].
REACH, WIDER = 1e-4, 4.0
#: Links that touch go on if a plane parts them for more than this multiple of their gap, which has to grow so much each
#: time [-].
PARTING, GROWING = 1.5, 1.01
#: A pair counts as meeting after this many looks, which is safe.
LOOKS = 20_000
#: Result of a look: the pair continues, it is free to the end, it meets.
ON, FREE, MEETS = 0, 1, 2


@kernel
def list_pairs(
    full_width: FullWidthArrays, fingers: FingerLinks, candidates: CandidateArrays, chosen: Ints, workspace: MeetingWork
) -> int:
    """List the pairs of links of all chosen candidates' fingers that may not overlap, and return how many there are."""
    count = 0
    for a in range(chosen.shape[0]):
        for b in range(a + 1, chosen.shape[0]):
            one, other = candidates.finger_posture[chosen[a]], candidates.finger_posture[chosen[b]]
            for m in range(fingers.first[one], fingers.first[one + 1]):
                for r in range(fingers.first[other], fingers.first[other + 1]):
                    if fingers.apart[fingers.link[m], fingers.link[r]] == 0:
                        continue
                    pair, plane, link, met = (
                        workspace.pair[count],
                        workspace.plane[count],
                        fingers.link[m],
                        fingers.link[r],
                    )
                    pair[0], pair[1], pair[2], pair[3], pair[4], pair[5] = a, b, m, r, 1, 0
                    pair[6], pair[7] = -1, -1
                    x, y, z = aside(full_width, one, link, other, met)
                    plane[0], plane[1], plane[2], plane[3] = x, y, z, 0.0
                    workspace.reach[count] = REACH
                    count += 1
    return count


@kernel
def aside(full_width: FullWidthArrays, one: int, m: int, other: int, r: int) -> Vector:
    """Return the direction from the middle of a link to that of a link of another finger, at their open postures."""
    here, there = (
        point_at(full_width.link_pose[one, m], full_width.links.box[m]),
        point_at(full_width.link_pose[other, r], full_width.links.box[r]),
    )
    n = plus(here, scaled(there, -1.0))
    size = math.sqrt(dot(n, n))
    return scaled(n, 1.0 / size) if size > 0.0 else (1.0, 0.0, 0.0)


@kernel
def point_at(T: Floats, p: Floats) -> Vector:
    """Return a point in the frame that a pose leads to."""
    return (
        T[0, 0] * p[0] + T[0, 1] * p[1] + T[0, 2] * p[2] + T[0, 3],
        T[1, 0] * p[0] + T[1, 1] * p[1] + T[1, 2] * p[2] + T[1, 3],
        T[2, 0] * p[0] + T[2, 1] * p[1] + T[2, 2] * p[2] + T[2, 3],
    )


@kernel
def step_by_plane(pair: LinkPair, n: Vector, margin: float, at: float, end: float) -> float:
    """Return how far two links advance from a place of the motion, kept apart by planes across one direction.

    Args:
        pair: the links. n: unit vector from the second link to the first.
        margin: how far planes across it keep them apart there, above 0 [m]. end: of their motion.

    Returns:
        the step; infinite where it leads to the end.
    """
    if approach_along(pair, n, at, end)[0] < margin:
        return math.inf
    until, sweep = even_until(pair, at, end), pair.sweep
    _, speed, bend = approach_along(pair, n, at, until)
    (m, r), width = links_of(pair), until - at
    if speed * width < margin:
        return width
    least = margin / speed
    level = min(0.5 * margin, 0.5 * TOUCH)
    step = min(width, math.sqrt(4.0 * (margin - level) / bend)) if bend > 0.0 else width
    for _ in range(LENGTHS):
        if step <= least:
            break
        place_links_at(pair, at + step, sweep.moving, sweep.resting)
        left = plane_between(pair.full_width.links, m, r, n[0], n[1], n[2], sweep)
        if lowest_on(step, margin, left, bend) > level:
            return step
        step = shorter_step(step, margin - level, left - level, bend)
    return least


@kernel
def put_touch(gap: float, n: Vector, point: Vector, at: float, touch: Floats) -> None:
    """Write how two links touch; see `Meetings`."""
    for c in range(3):
        touch[c], touch[3 + c] = point[c], n[c]
    touch[6], touch[7] = gap, at


@kernel
def look_at(
    full_width: FullWidthArrays,
    fingers: FingerLinks,
    finger_postures: tuple[int, int],
    p: int,
    workspace: MeetingWork,
    sweep: SweepWork,
) -> int:
    """Let a pair of links go on by a step, and return `ON`, `FREE` or `MEETS`."""
    pair, plane, at = workspace.pair[p], workspace.plane[p], workspace.at[p]
    rows = (pair[2], pair[3])
    both = LinkPair(full_width, fingers, finger_postures, rows, workspace, sweep)
    m, r = links_of(both)
    end = last_end(full_width, fingers, finger_postures[0], rows[0], workspace)
    end = max(end, last_end(full_width, fingers, finger_postures[1], rows[1], workspace))
    # Links that are held where they met touch at the end of their motion.
    if at >= (1.0 - ROUNDING) * end:
        return FREE
    place_links_at(both, at, sweep.moving, sweep.resting)
    put_axes(full_width, fingers, finger_postures[0], rows[0], workspace)
    put_axes(full_width, fingers, finger_postures[1], rows[1], workspace)
    margin, nx, ny, nz = find_plane(full_width.links, m, r, plane[0], plane[1], plane[2], sweep)
    plane[0], plane[1], plane[2] = nx, ny, nz
    step, pair[5] = 0.0, pair[5] + 1
    # Elements that cross have no gap. If none do at first, none do before a gap closes.
    if (
        pair[5] == 1
        and margin <= NEAR
        and bodies_overlap(full_width.links, m, full_width.links, r, 0.0, False, -1, sweep)
    ):
        _, n, point = elements_gap(full_width.links, sweep.pair[0], sweep.pair[1], sweep)
        put_touch(0.0, n, point, at, workspace.touch)
        return MEETS
    gap, n = margin, (nx, ny, nz)
    if margin <= NEAR:
        gap, n, _ = links_parting(full_width.links, m, r, n, sweep)
    if gap <= CLOSE or pair[5] == LOOKS:
        reach = workspace.reach[p] if pair[5] < LOOKS else math.inf
        gap = links_gap(full_width.links, m, r, reach, (nx, ny, nz), pair[6:], sweep)
        if gap < reach:
            _, n, point = elements_gap(full_width.links, pair[6], pair[7], sweep)
            # Links that touch before anything moves go on while they part.
            parting = gap > 0.0 and (at == 0.0 or (plane[3] > 0.0 and gap >= GROWING * plane[3]))
            if gap > TOUCH or parting:
                step = step_by_parts(both, gap, n, pair[6:], at, end)
            plane[3] = gap if gap <= TOUCH else 0.0
            if (gap <= TOUCH and (not parting or step * speeds_of(both, at) <= PARTING * gap)) or pair[5] == LOOKS:
                put_touch(gap, n, point, at, workspace.touch)
                return MEETS
        else:
            n, step = (nx, ny, nz), gap / speeds_of(both, at)
        workspace.reach[p] = max(WIDER * gap, REACH)
    elif margin <= NEAR:
        step = step_by_parts(both, gap, n, pair[6:], at, end)
    if margin <= NEAR:
        margin = min(plane_between(full_width.links, m, r, n[0], n[1], n[2], sweep), gap)
    if margin > 0.0:
        step = max(step, step_by_plane(both, n, margin, at, end))
    workspace.at[p] = at + step
    return ON if at + step < (1.0 - ROUNDING) * end else FREE


@kernel
def first_waiting(count: int, workspace: MeetingWork) -> int:
    """Return the pair that has come least far, or -1 where all are free to the end."""
    first, least = -1, math.inf
    for p in range(count):
        if workspace.at[p] < least:
            first, least = p, workspace.at[p]
    return first
