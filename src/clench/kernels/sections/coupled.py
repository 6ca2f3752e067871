"""First contact when several joints turn at once (docs/method.md section 4).

Along one path segment every joint turns at its own constant rate, so a point of a link moves as `p(s) = P + Σ R(Ω_i s)
e_i`, and every gap of section 3 is a sum `C + Σ A_i cos(ω_i s) + B_i sin(ω_i s)`. The second derivative of such a sum
is bounded by `M = Σ ω_i² hypot(A_i, B_i)`. A step to the zero of the parabola `f + f' d - M d²/2` can therefore never
pass a root, and near a root it is a Newton step from the safe side.
"""

from __future__ import annotations

import math

from clench.kernels.closing.layout import Floats
from clench.kernels.runtime.compiling import entry_kernel

STEPS = 2000


@entry_kernel
def cosine_and_sine(angle: float) -> tuple[float, float]:
    """Return the cosine and the sine of an angle [rad], at once at the start, after which most pairs are done with."""
    if angle == 0.0:
        return 1.0, 0.0
    return math.cos(angle), math.sin(angle)


@entry_kernel
def evaluate(terms: Floats, count: int, constant: float, s: float) -> tuple[float, float, float]:
    """Return a trigonometric sum, its slope and its curvature at `s`.

    Args:
        terms: rows (ω, A, B), shape (>= count, 3).
    """
    value, slope, curvature = constant, 0.0, 0.0
    for i in range(count):
        rate, a, b = terms[i, 0], terms[i, 1], terms[i, 2]
        c, d = cosine_and_sine(rate * s)
        term = a * c + b * d
        value += term
        slope += rate * (b * c - a * d)
        curvature -= rate * rate * term
    return value, slope, curvature


@entry_kernel
def at_start(terms: Floats, count: int, constant: float) -> float:
    """Return a trigonometric sum at 0."""
    value = constant
    for i in range(count):
        value += terms[i, 1]
    return value


@entry_kernel
def bounds(terms: Floats, count: int) -> tuple[float, float]:
    """Return bounds on the absolute slope and curvature of a trigonometric sum."""
    first, second = 0.0, 0.0
    for i in range(count):
        size = math.sqrt(terms[i, 1] ** 2 + terms[i, 2] ** 2)
        first += abs(terms[i, 0]) * size
        second += terms[i, 0] * terms[i, 0] * size
    return first, second


@entry_kernel
def safe_step(value: float, slope: float, bound: float) -> float:
    """Return the first zero of `value + slope d - bound d²/2` for value >= 0, bound > 0."""
    root = math.sqrt(slope * slope + 2.0 * bound * value)
    if slope < 0.0:
        return 2.0 * value / (root - slope)
    return (root + slope) / bound


@entry_kernel
def next_root(
    terms: Floats, count: int, constant: float, s: float, sign: float, bound: float, touch: float, end: float
) -> float:
    """Return the next `s` at which `sign * f` comes down to zero and would go on below, or `end`.

    Args:
        terms, count, constant: the sum `f`, see `evaluate`.
        s: start, where `sign * f` is >= -touch.
        bound: bound on the curvature of `f`.
        touch: gaps up to this count as touching [m]; a root is settled to a thousandth of it.
        end: nothing from here on is of interest.
    """
    if bound == 0.0:
        return end  # a point on the axis of the only turn: its gap never changes
    settled = 1e-3 * touch
    least = math.sqrt(2.0 * settled / bound)
    for _ in range(STEPS):
        value, slope, curvature = evaluate(terms, count, constant, s)
        value *= sign
        slope *= sign
        curvature *= sign
        if value > settled:
            s += safe_step(value, slope, bound)
        else:
            still = 1e-9 * bound
            if value < -touch or slope < -still or (slope <= still and curvature < -still):
                return s
            s += max(safe_step(max(value, 0.0), slope, bound), least)
        if not s < end:
            return end
    return s


@entry_kernel
def point_on_line(chain: Floats, count: int, nx: float, nz: float, offset: float, terms: Floats) -> tuple[int, float]:
    """Write the gap of a moving point over a fixed line `n·x = offset`; return its term count and constant.

    Args:
        chain: rows (Ω, e_x, e_z), shape (>= count, 3), relative to the first pivot.
    """
    for i in range(count):
        terms[i, 0] = chain[i, 0]
        terms[i, 1] = nx * chain[i, 1] + nz * chain[i, 2]
        terms[i, 2] = nz * chain[i, 1] - nx * chain[i, 2]
    return count, -offset


@entry_kernel
def line_on_point(
    chain: Floats, count: int, nx: float, nz: float, g: float, qx: float, qz: float, w: float, terms: Floats
) -> tuple[int, float]:
    """Write the gap of a fixed point `q` over a moving line `n·x = g`, given relative to the last pivot at the start.

    Args:
        chain: rows as in `point_on_line`; the last row gives only its rate.
    """
    last = chain[count - 1, 0]
    terms[0, 0] = last
    terms[0, 1] = nx * qx + nz * qz
    terms[0, 2] = nx * qz - nz * qx
    for i in range(count - 1):
        terms[i + 1, 0] = chain[i, 0] - last
        terms[i + 1, 1] = -(nx * chain[i, 1] + nz * chain[i, 2])
        terms[i + 1, 2] = -(nz * chain[i, 1] - nx * chain[i, 2])
    return count, -g - w


@entry_kernel
def point_on_point(chain: Floats, count: int, qx: float, qz: float, w: float, terms: Floats) -> tuple[int, float]:
    """Write `(|p(s) - q|² - w²) / 2w`, a gap to first order, for a moving point `p` and w > 0."""
    scale = 1.0 / (2.0 * w)
    constant = qx * qx + qz * qz - w * w
    n = 0
    for i in range(count):
        ex, ez = chain[i, 1], chain[i, 2]
        constant += ex * ex + ez * ez
        terms[n, 0] = chain[i, 0]
        terms[n, 1] = -2.0 * scale * (qx * ex + qz * ez)
        terms[n, 2] = -2.0 * scale * (qz * ex - qx * ez)
        n += 1
        for j in range(i):
            dx, dz = chain[j, 1], chain[j, 2]
            terms[n, 0] = chain[i, 0] - chain[j, 0]
            terms[n, 1] = 2.0 * scale * (dx * ex + dz * ez)
            terms[n, 2] = 2.0 * scale * (dz * ex - dx * ez)
            n += 1
    return n, scale * constant


@entry_kernel
def place(chain: Floats, count: int, s: float) -> tuple[float, float]:
    """Return where the chain's last point is at `s`, relative to the first pivot."""
    x, z = 0.0, 0.0
    for i in range(count):
        c, d = math.cos(chain[i, 0] * s), math.sin(chain[i, 0] * s)
        x += c * chain[i, 1] - d * chain[i, 2]
        z += d * chain[i, 1] + c * chain[i, 2]
    return x, z
