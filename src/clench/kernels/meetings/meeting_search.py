"""Find the first meetings of links of simultaneously closing fingers (docs/method.md section 5).

A pair of links advances in steps that cannot pass a meeting. The pair that has advanced least goes next. A plane that
keeps their hulls apart at both ends of a step does so in between, except for the bend of the paths. If hulls are near,
the closest elements give the plane. If no plane keeps links apart, a step is as long as their gap allows.
"""

from __future__ import annotations

import math

from clench.kernels.closing.layout import Floats, Ints, ItemArrays
from clench.kernels.geometry.vectors import Vector, dot, plus, scaled
from clench.kernels.runtime.compiling import kernel
from clench.kernels.toi.full_width import ExactArrays
from clench.kernels.toi.toi_work import SweepWork

from .finger_motion import ROUNDING, approach_along, last_end, next_change, place_link, put_axes, speed_of
from .hull_planes import find_plane, plane_between
from .meeting_layout import FingerLinks, MeetingWork
from .near_links import LENGTHS, TOUCH, elements_gap, links_gap, lowest_on, shorter_step, step_by_elements

#: Hulls nearer than this are measured by their elements [m].
NEAR = 1e-5
#: Up to which gap elements are measured at first, and how that grows while they are farther apart [m, -].
REACH, WIDER = 1e-4, 4.0
#: A pair counts as meeting after this many looks, which is safe.
LOOKS = 20_000
#: Result of a look: the pair continues, it is free to the end, it meets.
ON, FREE, MEETS = 0, 1, 2


@kernel
def list_pairs(exact: ExactArrays, fingers: FingerLinks, items: ItemArrays, chosen: Ints, room: MeetingWork) -> int:
    """List the pairs of links of all chosen items' fingers that may not overlap, and return how many there are."""
    count = 0
    for a in range(chosen.shape[0]):
        for b in range(a + 1, chosen.shape[0]):
            one, other = items.entry[chosen[a]], items.entry[chosen[b]]
            for m in range(fingers.first[one], fingers.first[one + 1]):
                for r in range(fingers.first[other], fingers.first[other + 1]):
                    if fingers.apart[fingers.link[m], fingers.link[r]] == 0:
                        continue
                    pair, plane, link, met = room.pair[count], room.plane[count], fingers.link[m], fingers.link[r]
                    pair[0], pair[1], pair[2], pair[3], pair[4], pair[5] = a, b, m, r, 1, 0
                    pair[6], pair[7] = -1, -1
                    x, y, z = aside(exact, one, link, other, met)
                    plane[0], plane[1], plane[2] = x, y, z
                    room.reach[count] = REACH
                    count += 1
    return count


@kernel
def aside(exact: ExactArrays, one: int, m: int, other: int, r: int) -> Vector:
    """Return the direction from the middle of a link of one entry to that of another at their open postures."""
    here, there = (
        point_at(exact.link_pose[one, m], exact.links.box[m]),
        point_at(exact.link_pose[other, r], exact.links.box[r]),
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
def place_pair(
    exact: ExactArrays,
    fingers: FingerLinks,
    one: int,
    other: int,
    m: int,
    r: int,
    at: float,
    room: MeetingWork,
    sweep: SweepWork,
) -> None:
    """Write the poses of two links, of two entries, at a place of the motion to `sweep`, and their joints' turns."""
    place_link(exact, fingers, one, m, at, room, sweep.moving)
    place_link(exact, fingers, other, r, at, room, sweep.resting)


@kernel
def step_by_plane(
    exact: ExactArrays,
    fingers: FingerLinks,
    entries: tuple[int, int],
    rows: tuple[int, int],
    n: Vector,
    margin: float,
    at: float,
    end: float,
    room: MeetingWork,
    sweep: SweepWork,
) -> float:
    """Return how far two links advance from a place of the motion, kept apart by planes across one direction.

    Args:
        entries, rows: of the links, which stand in `sweep`. n: unit vector from the second link to the first.
        margin: how far planes across it keep them apart there, above 0 [m]. end: of their motion.

    Returns:
        the step; infinite where it leads to the end.
    """
    if approach_along(exact, fingers, entries, rows, n, at, end, room)[0] < margin:
        return math.inf
    until = next_change(exact, fingers, entries[0], rows[0], at, end, room)
    until = next_change(exact, fingers, entries[1], rows[1], at, until, room)
    _, speed, bend = approach_along(exact, fingers, entries, rows, n, at, until, room)
    m, r, width = fingers.link[rows[0]], fingers.link[rows[1]], until - at
    if speed * width < margin:
        return width
    least = margin / speed
    level = min(0.5 * margin, 0.5 * TOUCH)
    step = min(width, math.sqrt(4.0 * (margin - level) / bend)) if bend > 0.0 else width
    for _ in range(LENGTHS):
        if step <= least:
            break
        place_pair(exact, fingers, entries[0], entries[1], rows[0], rows[1], at + step, room, sweep)
        left = plane_between(exact.links, m, r, n[0], n[1], n[2], sweep)
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
    exact: ExactArrays,
    fingers: FingerLinks,
    entries: tuple[int, int],
    p: int,
    room: MeetingWork,
    sweep: SweepWork,
) -> int:
    """Let a pair of links go on by a step, and return `ON`, `FREE` or `MEETS`."""
    pair, plane, at = room.pair[p], room.plane[p], room.at[p]
    rows = (pair[2], pair[3])
    m, r = fingers.link[rows[0]], fingers.link[rows[1]]
    end = last_end(exact, fingers, entries[0], rows[0], room)
    end = max(end, last_end(exact, fingers, entries[1], rows[1], room))
    # Links that are held where they met touch at the end of their motion.
    if at >= (1.0 - ROUNDING) * end:
        return FREE
    place_pair(exact, fingers, entries[0], entries[1], rows[0], rows[1], at, room, sweep)
    put_axes(exact, fingers, entries[0], rows[0], room)
    put_axes(exact, fingers, entries[1], rows[1], room)
    margin, nx, ny, nz = find_plane(exact.links, m, r, plane[0], plane[1], plane[2], sweep)
    plane[0], plane[1], plane[2] = nx, ny, nz
    step, pair[5] = 0.0, pair[5] + 1
    if margin <= NEAR or pair[5] == LOOKS:
        reach = room.reach[p] if pair[5] < LOOKS else math.inf
        gap = links_gap(exact.links, m, r, reach, (nx, ny, nz), pair[6:], sweep)
        if gap < reach:
            _, n, point = elements_gap(exact.links, pair[6], pair[7], sweep)
            if gap <= TOUCH or pair[5] == LOOKS:
                put_touch(gap, n, point, at, room.touch)
                return MEETS
            step = step_by_elements(exact, fingers, entries, rows, gap, n, pair[6:], at, end, room, sweep)
            nx, ny, nz = n
            margin = min(plane_between(exact.links, m, r, nx, ny, nz, sweep), gap)
        else:
            speed = speed_of(exact, fingers, entries[0], rows[0], at, room)
            step = gap / (speed + speed_of(exact, fingers, entries[1], rows[1], at, room))
        room.reach[p] = max(WIDER * gap, REACH)
    if margin > 0.0:
        step = max(step, step_by_plane(exact, fingers, entries, rows, (nx, ny, nz), margin, at, end, room, sweep))
    room.at[p] = at + step
    return ON if at + step < (1.0 - ROUNDING) * end else FREE


@kernel
def first_waiting(count: int, room: MeetingWork) -> int:
    """Return the pair that has come least far, or -1 where all are free to the end."""
    first, least = -1, math.inf
    for p in range(count):
        if room.at[p] < least:
            first, least = p, room.at[p]
    return first
