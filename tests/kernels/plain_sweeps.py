"""Call the kernels of sweeps with numbers and arrays, of which they take bundles."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from clench.kernels.geometry import box_walk
from clench.kernels.grid import grid_travel
from clench.kernels.hulls import body_sweep, hull_meeting, hull_sweep, hull_window, listed_sweep, near_elements
from clench.kernels.toi import toi_bounds, toi_pairs
from clench.kernels.toi.core_motion import CorePair, MovingCore
from clench.kernels.toi.toi_work import BodyPair
from kernels.kernel_entries import entry

_CALLED: dict[Any, Any] = {}


def _call(kernel: Any, *arguments: Any) -> Any:
    """Call a kernel from Python, through an entry that is made once."""
    if kernel not in _CALLED:
        _CALLED[kernel] = entry(kernel)
    return _CALLED[kernel](*arguments)


def sweep_pair(core, ka, fixed, kb, w, chain, count, touch, begin, best, placed):
    """Sweep a core towards another one."""
    pair = CorePair(MovingCore(core, ka, chain, count, placed), fixed, kb, float(w), float(touch))
    return _call(toi_pairs.sweep_pair, pair, float(begin), float(best))


def walk_core(core, ka, fixed, kb, w, chain, count, near, begin, best, placed):
    """Walk a core towards another one."""
    pair = CorePair(MovingCore(core, ka, chain, count, placed), fixed, kb, float(w), 0.0)
    return _call(toi_bounds.walk_core, pair, near, begin, best)


def stays_above(core, placed, corners, chain, count, nx, ny, nz, offset, begin, best):
    """Look whether a core stays above a plane."""
    return _call(
        toi_bounds.stays_above, MovingCore(core, corners, chain, count, placed), nx, ny, nz, offset, begin, best
    )


def walk_to_box(core, ka, box, w, chain, count, near, begin, best, placed):
    """Walk a core towards a box."""
    return _call(box_walk.walk_to_box, MovingCore(core, ka, chain, count, placed), box, w, near, begin, best)


def walk_rectangle(core, fixed, kb, box, w, chain, count, near, begin, best, placed):
    """Walk a rectangle towards a core."""
    pair = CorePair(MovingCore(core, 4, chain, count, placed), fixed, kb, w, 0.0)
    return _call(box_walk.walk_rectangle, pair, box, near, begin, best)


def _of_bodies(kernel: Any) -> Callable[..., Any]:
    def call(moving, m, resting, r, chain, count, touch, best, work):
        return _call(kernel, BodyPair(moving, m, resting, r, chain, count, touch), best, work)

    return call


sweep_body = _of_bodies(body_sweep.sweep_body)
clear_by_grid = _of_bodies(grid_travel.clear_by_grid)
clear_travel = _of_bodies(hull_sweep.clear_travel)
touching_elements = _of_bodies(hull_meeting.put_touching)
_list_near = _of_bodies(near_elements.list_near)


def list_near(moving, m, resting, r, chain, count, touch, end, work):
    """List the elements that a body comes near to, from no plane on."""
    _call(hull_window.forget_planes, work.hull)
    return _list_near(moving, m, resting, r, chain, count, touch, end, work)


def list_pairs(moving, m, resting, r, chain, count, touch, end, listed, work):
    """List the pairs of elements that may meet."""
    pair = BodyPair(moving, m, resting, r, chain, count, touch)
    found = _call(listed_sweep.list_pairs, pair, end, listed, work)
    return work.stack[::-1][: max(found, 0), :2], found


def sweep_listed(moving, m, resting, r, chain, count, touch, best, listed, work):
    """Sweep listed elements."""
    return _call(listed_sweep.sweep_listed, BodyPair(moving, m, resting, r, chain, count, touch), best, listed, work)


def shorten(moving, resting, chain, motion, n, start, top, end, work):
    """Shorten a window that begins at 0, in which a plane does not keep a hull off."""
    pair = BodyPair(moving, 0, resting, 0, chain, len(chain), 0.0)
    return _call(hull_sweep.shorten, pair, motion, n, start, top, 0.0, end, work)
