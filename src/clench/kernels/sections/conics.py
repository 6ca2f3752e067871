"""First contact with an ellipse of the object, whole or cut by two caps (docs/method.md section 3).

The distance to a convex region is convex, so along a motion with acceleration at most M the gap bends down by at
most M: the safe step of `coupled` holds here too. Sides use the support function of the ellipse.
"""

from __future__ import annotations

import math

from clench.core.tolerances import FOOT_FRACTION
from clench.kernels.closing.layout import KIND_SIDE, Floats, Line, Outline, Work
from clench.kernels.runtime.compiling import kernel

from .coupled import STEPS, bounds, cosine_and_sine, evaluate, line_on_point, safe_step
from .coupled_pairs import side_foot
from .turning_pairs import note, other_face

#: Inverses of products below this run over [m^2]: such a point is on the axis.
NOTHING = 1e-290
#: The range of a curve's normals is taken to be wider by this [rad].
RANGE = 1e-9


@kernel
def ellipse_foot(a: float, b: float, t: float, y: float) -> tuple[float, float]:
    """Return the point of an ellipse with semi-axes a >= b nearest to (t, y).

    The foot is `(a² t / (m + a² - b²), b² y / m)` for the root m > 0 of `(a t / (m + a² - b²))² + (b y / m)² = 1`.
    Newton's steps on 1 minus the inverse root of the left side, which is nearly straight, climb to it from below: three
    or four mostly (Moré and Sorensen, 1983, do so for trust regions).
    """
    u, v = abs(t), abs(y)
    c = (a - b) * (a + b)
    if b * v < NOTHING and u * a <= c + NOTHING:
        x = a * a * u / c if c > 0.0 else a
        return math.copysign(x, t), b * math.sqrt(max(1.0 - (x / a) ** 2, 0.0))
    m = max(b * v, a * u - c)
    while True:
        p, q = a * u / (m + c), b * v / m
        size = math.sqrt(p * p + q * q)
        more = m + size * size * (size - 1.0) / (p * p / (m + c) + q * q / m)
        if not more > m:
            return math.copysign(a * p, t), math.copysign(b * q, y)
        m = more


@kernel
def region_gap(e: Floats, px: float, pz: float) -> tuple[float, float, float, float, float]:
    """Return the distance of a point to an ellipse between its caps, the outward normal and the foot (x, z).

    Inside the region the distance is negative, not more than the true depth. Beyond a cap, but inside the whole
    ellipse, it is that to the curve: caps are segments of their own.
    """
    dx, dz = px - e[0], pz - e[1]
    ux, uz, a, b, low, high = e[2], e[3], e[4], e[5], e[6], e[7]
    t, y = dx * ux + dz * uz, -dx * uz + dz * ux
    level = math.hypot(t / a, y / b)
    inside = level <= 1.0 and low <= t <= high
    ft, fy = ellipse_foot(a, b, t, y)
    if ft > high or ft < low:
        ft = high if ft > high else low
        half = b * math.sqrt(max(1.0 - (ft / a) ** 2, 0.0))
        fy = min(max(y, -half), half)
    fx, fz = e[0] + ft * ux - fy * uz, e[1] + ft * uz + fy * ux
    distance = math.hypot(px - fx, pz - fz)
    if inside or distance <= 1e-9 * b:
        mt, my = ft / (a * a), fy / (b * b)
        size = math.hypot(mt, my)
        nx, nz = (mt * ux - my * uz) / size, (mt * uz + my * ux) / size
        return (-distance if inside else distance), nx, nz, fx, fz
    return distance, (px - fx) / distance, (pz - fz) / distance, fx, fz


@kernel
def sweep_vertex_region(
    chain: Floats, count: int, vx: float, vz: float, w: float, e: Floats, touch: float, best: float
) -> float:
    """Return the first `s` before `best` at which a moving vertex comes within `w` of a region."""
    chain[count - 1, 1], chain[count - 1, 2] = vx, vz
    speed, bound = 0.0, 0.0
    for i in range(count):
        size = math.hypot(chain[i, 1], chain[i, 2])
        speed += abs(chain[i, 0]) * size
        bound += chain[i, 0] * chain[i, 0] * size
    settled = 1e-3 * touch
    if bound == 0.0:
        return best
    least = math.sqrt(2.0 * settled / bound)
    s = 0.0
    for step in range(STEPS):
        x, z, fx, fz = 0.0, 0.0, 0.0, 0.0
        for i in range(count):
            c, d = cosine_and_sine(chain[i, 0] * s)
            ex, ez = c * chain[i, 1] - d * chain[i, 2], d * chain[i, 1] + c * chain[i, 2]
            x, z, fx, fz = x + ex, z + ez, fx - chain[i, 0] * ez, fz + chain[i, 0] * ex
        value, nx, nz, _, _ = region_gap(e, x, z)
        value -= w
        if step == 0 and (value > speed * best or value < -touch):
            return best
        slope = nx * fx + nz * fz
        if value <= settled and (value < -touch or slope < -1e-9 * bound):
            return s
        s += max(safe_step(max(value, 0.0), slope, bound), least if value <= settled else 0.0)
        if s >= best:
            return best
    return s


@kernel
def support(e: Floats, nx: float, nz: float) -> tuple[float, float, float]:
    """Return the support of a whole ellipse about its centre, its derivative by the normal's angle, and -t there."""
    p, q = nx * e[2] + nz * e[3], -nx * e[3] + nz * e[2]
    a2, b2 = e[4] * e[4], e[5] * e[5]
    value = math.sqrt(a2 * p * p + b2 * q * q)
    return value, (b2 - a2) * p * q / value, a2 * p / value


@kernel
def turn_into(angle: float, low: float, high: float) -> float:
    """Return how far an angle grows until it is in a range, modulo a full turn; 0 where it is in there already."""
    beyond = (angle - low) % (2.0 * math.pi)
    return 0.0 if beyond <= high - low else 2.0 * math.pi - beyond


@kernel
def curve_range(e: Floats) -> tuple[float, float]:
    """Return the range of angles of the normals of a region's curve between two caps, on the side of positive ones."""
    a, b = e[4], e[5]
    first = math.atan2(math.sqrt(max(1.0 - (e[7] / a) ** 2, 0.0)) / b, e[7] / (a * a)) - RANGE
    return first, math.atan2(math.sqrt(max(1.0 - (e[6] / a) ** 2, 0.0)) / b, e[6] / (a * a)) + RANGE


@kernel
def turn_to_curve(e: Floats, first: float, last: float, nx: float, nz: float, sense: float) -> float:
    """Return how far a side with normal n turns until the curved part of a region has a tangent along it.

    Between two caps the normals of the curve are in two ranges, narrow ones if the ellipse is long. Elsewhere a side
    meets the corners, and the support of the whole ellipse would belong to points that do not exist.

    Args:
        first, last: see `curve_range`. sense: of the turn, 1 from x to z.
    """
    angle = sense * math.atan2(nx * e[3] - nz * e[2], -nx * e[2] - nz * e[3])
    # Either range is the other one's mirror image.
    turn = min(turn_into(angle, first, last), turn_into(angle, -last, -first))
    return turn + 0.5 * RANGE if turn > 0.0 else 0.0


@kernel
def sweep_side_region(
    chain: Floats, terms: Floats, count: int, line: Line, w: float, e: Floats, touch: float, best: float
) -> float:
    """Return the first `s` before `best` at which a moving side meets the curved part of a region."""
    nx, nz, g, ta, tb = line
    n, constant = line_on_point(chain, count, nx, nz, g, e[0], e[1], w, terms)
    _, bound = bounds(terms, n)
    rate = chain[count - 1, 0]
    bound += rate * rate * e[4] * e[4] / e[5]
    settled, least = 1e-3 * touch, math.sqrt(2e-3 * touch / bound)
    slack = FOOT_FRACTION * (tb - ta)
    s, sign, first, last = 0.0, 0.0, 0.0, 0.0
    capped = e[6] > -e[4] or e[7] < e[4]
    if capped:
        first, last = curve_range(e)
    for _ in range(STEPS):
        c, d = cosine_and_sine(rate * s)
        mx, mz = c * nx - d * nz, d * nx + c * nz
        turn = turn_to_curve(e, first, last, mx, mz, math.copysign(1.0, rate)) if capped else 0.0
        if turn > 0.0:
            if turn >= abs(rate) * (best - s):
                return best
            s, sign = s + turn / abs(rate), 0.0
            continue
        value, slope, _ = evaluate(terms, n, constant, s)
        size, change, t = support(e, mx, mz)
        value -= size
        slope -= rate * change
        if sign == 0.0:
            sign = 1.0 if value >= -touch else -1.0
        value *= sign
        slope *= sign
        if value <= settled and (value < -touch or slope < -1e-9 * bound):
            if sign > 0.0 and e[6] - slack <= -t <= e[7] + slack:
                y = -(e[5] * e[5]) * (-mx * e[3] + mz * e[2]) / size
                qx, qz = e[0] - t * e[2] - y * e[3], e[1] - t * e[3] + y * e[2]
                if ta - slack <= side_foot(chain, count, nx, nz, qx, qz, s) <= tb + slack:
                    return s
            sign = -sign
            value, slope = -value, -slope
        s += max(safe_step(max(value, 0.0), slope, bound), least if value <= settled else 0.0)
        if s >= best:
            return best
    return s


@kernel
def sweep_region(outline: Outline, i: int, e: Floats, touch: float, count: int, best: float, work: Work) -> float:
    """Return the first contact of a moving outline with a region before `best`; all relative to the first pivot."""
    chain, terms, vertex, side, pair = work.chain, work.terms, work.vertex, work.side, work.best
    w = outline.radius
    for v in range(outline.v0, outline.v1):
        found = sweep_vertex_region(chain, count, vertex[v, 0], vertex[v, 1], w, e, touch, best)
        if found < best:
            best = found
            note(pair, outline.tip, outline.number, v, i, 0, 2)
    for k in range(outline.s0, outline.s1):
        line = (side[k, 0], side[k, 1], side[k, 2], side[k, 3], side[k, 4])
        found = sweep_side_region(chain, terms, count, line, w, e, touch, best)
        if found < best:
            best = found
            note(pair, KIND_SIDE, outline.number, k, i, 0, 2)
        if outline.both:
            found = sweep_side_region(chain, terms, count, other_face(line), w, e, touch, best)
            if found < best:
                best = found
                note(pair, KIND_SIDE, outline.number, k, i, 2, 2)
    return best
