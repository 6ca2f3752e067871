"""Bound the wrenches that a grasp resists from below, in closed form: affine responses to wrenches (docs/method.md
section 6).

Forces `f = s f0 + K w` exert the wrench w when `G f0 = 0` and `G K = 1`. They stay inside every face `a f >= 0` of the
friction polyhedra for all `|w| <= r` when `s a f0 >= r |K^T a|`, and below every cap `c f <= b` when `s |c f0| + r |K^T
c| <= b`. Thus r is resisted. Its distance from the largest radius depends on f0 and K, which a few rounds of
reweighting improve: contacts that bind get more preload and answer less.
"""

from __future__ import annotations

import numpy as np

from clench.kernels.runtime.compiling import entry_kernel

#: Newton steps that balance internal forces, in the first round and in later ones.
_FIRST_STEPS = 12
_STEPS = 3
#: How strongly a contact's room changes its answer and its share of the internal forces [-].
_ANSWER = 0.6
_PRELOAD = 0.5


@entry_kernel(allocates=True)
def resisted_ball(
    G: np.ndarray,
    edges: np.ndarray,
    faces: np.ndarray,
    reach: np.ndarray,
    caps: np.ndarray,
    most: np.ndarray,
    rounds: int,
) -> float:
    """Return the radius of a ball of wrenches that is resisted, 0 when none was found.

    Args:
        G: grasp map, shape (6, n) with n = C * width.
        edges, faces: of the friction polyhedra: at unit normal force, and inward normals, shapes (C, N or F, width).
        reach: semi-axes of the cones at unit normal force by component, 1 for the normal, shape (C, width).
        caps: rows c of `|c f| <= most`, shape (M, n). most: finite bounds, shape (M,). rounds: of reweighting.
    """
    count, each, width = edges.shape
    wrenches = np.zeros((count * each, 6))
    for i in range(count):
        for e in range(each):
            for k in range(width):
                for r in range(6):
                    wrenches[i * each + e, r] += G[r, i * width + k] * edges[i, e, k]
    answers, room, y = np.ones(count), np.empty(count), np.zeros(6)
    share, weights = np.ones(count * each), np.empty(count * each)
    K, f0 = np.empty((count * width, 6)), np.empty(count * width)
    best = 0.0
    for k in range(rounds):
        if not _response(G, reach, answers, K):
            return 0.0
        _balance(wrenches, share, y, weights, _FIRST_STEPS if k == 0 else _STEPS)
        _internal_forces(G, K, edges, weights, f0)
        least = np.inf
        for i in range(count):
            room[i] = _room(faces[i], f0[i * width : (i + 1) * width], K[i * width : (i + 1) * width])
            least = min(least, room[i])
        if least > 0.0:
            best = max(best, _capped(least, f0, K, caps, most))
        _reweigh(room, answers, share, each)
    return best


@entry_kernel(allocates=True)
def _response(G: np.ndarray, reach: np.ndarray, answers: np.ndarray, K: np.ndarray) -> bool:
    """Write `K = H G^T (G H G^T)^-1` with weights H; say whether the wrenches span all directions."""
    count, width = reach.shape
    M, L = np.zeros((6, 6)), np.zeros((6, 6))
    for i in range(count):
        for k in range(width):
            column, h = i * width + k, answers[i] * reach[i, k] * reach[i, k]
            for r in range(6):
                for c in range(r + 1):
                    M[r, c] += h * G[r, column] * G[c, column]
    if not _factor(M, L):
        return False
    for i in range(count):
        for k in range(width):
            column, h = i * width + k, answers[i] * reach[i, k] * reach[i, k]
            for r in range(6):
                K[column, r] = h * G[r, column]
            _solve(L, K[column])
    return True


@entry_kernel(allocates=True)
def _balance(wrenches: np.ndarray, share: np.ndarray, y: np.ndarray, weights: np.ndarray, steps: int) -> None:
    """Write weights `share exp(y w)`, summing to 1, whose wrenches balance: Newton steps on the logarithm of their sum.

    They exist when 0 lies inside the hull of the wrenches, and then all are above 0: forces well inside their cones.

    Args:
        wrenches: of all edges, shape (N, 6). share: what each would have, shape (N,).
        y: where the steps start, shape (6,); changed. weights: written, shape (N,). steps: of Newton's method.
    """
    H, L, g, d = np.empty((6, 6)), np.zeros((6, 6)), np.empty(6), np.empty(6)
    for step in range(steps + 1):
        top, total = -np.inf, 0.0
        for e in range(len(wrenches)):
            along = 0.0
            for r in range(6):
                along += y[r] * wrenches[e, r]
            weights[e] = along
            top = max(top, along)
        for e in range(len(wrenches)):
            weights[e] = share[e] * np.exp(weights[e] - top)
            total += weights[e]
        g[:] = 0.0
        H[:] = 0.0
        for e in range(len(wrenches)):
            weights[e] /= total
            for r in range(6):
                weighted = weights[e] * wrenches[e, r]
                g[r] += weighted
                for c in range(r + 1):
                    H[r, c] += weighted * wrenches[e, c]
        for r in range(6):
            for c in range(r + 1):
                H[r, c] -= g[r] * g[c]
        if step == steps or not _factor(H, L):
            return
        d[:] = g
        _solve(L, d)
        decrement = 0.0
        for r in range(6):
            decrement += g[r] * d[r]
        if decrement < 1e-24:
            return
        damping = 1.0 / (1.0 + np.sqrt(decrement))
        for r in range(6):
            y[r] -= damping * d[r]


@entry_kernel
def _factor(M: np.ndarray, L: np.ndarray) -> bool:
    """Write the Cholesky factor of a matrix of which the lower half counts; say whether it is well conditioned."""
    for r in range(6):
        for c in range(r + 1):
            left = M[r, c]
            for k in range(c):
                left -= L[r, k] * L[c, k]
            if r == c:
                if not left > 1e-13 * M[r, r]:
                    return False
                L[r, r] = np.sqrt(left)
            else:
                L[r, c] = left / L[c, c]
    return True


@entry_kernel
def _solve(L: np.ndarray, x: np.ndarray) -> None:
    """Solve `L L^T x = b` in place."""
    for r in range(6):
        for c in range(r):
            x[r] -= L[r, c] * x[c]
        x[r] /= L[r, r]
    for r in range(5, -1, -1):
        for c in range(r + 1, 6):
            x[r] -= L[c, r] * x[c]
        x[r] /= L[r, r]


@entry_kernel(allocates=True)
def _internal_forces(G: np.ndarray, K: np.ndarray, edges: np.ndarray, weights: np.ndarray, f0: np.ndarray) -> None:
    """Write the forces of weighted edges, balanced to rounding, shape (n,)."""
    count, each, width = edges.shape
    f0[:] = 0.0
    for i in range(count):
        for e in range(each):
            for k in range(width):
                f0[i * width + k] += weights[i * each + e] * edges[i, e, k]
    wrench = np.zeros(6)
    for column in range(len(f0)):
        for r in range(6):
            wrench[r] += G[r, column] * f0[column]
    for column in range(len(f0)):
        for r in range(6):
            f0[column] -= K[column, r] * wrench[r]


@entry_kernel
def _room(faces: np.ndarray, force: np.ndarray, K: np.ndarray) -> float:
    """Return the radius of the wrenches that one contact's response keeps inside its cone."""
    width = len(force)
    room = np.inf
    for face in range(len(faces)):
        slack, change = 0.0, 0.0
        for k in range(width):
            slack += faces[face, k] * force[k]
        for r in range(6):
            part = 0.0
            for k in range(width):
                part += faces[face, k] * K[k, r]
            change += part * part
        room = min(room, slack / np.sqrt(max(change, 1e-300)))
    return room


@entry_kernel
def _capped(least: float, f0: np.ndarray, K: np.ndarray, caps: np.ndarray, most: np.ndarray) -> float:
    """Return the largest r with `r = s least` that every cap allows."""
    radius = np.inf
    for m in range(len(most)):
        steady, change = 0.0, 0.0
        for n in range(len(f0)):
            steady += caps[m, n] * f0[n]
        for r in range(6):
            part = 0.0
            for n in range(len(f0)):
                part += caps[m, n] * K[n, r]
            change += part * part
        use = abs(steady) / least + np.sqrt(change)
        if use > 0.0:
            radius = min(radius, most[m] / use)
    return radius


@entry_kernel
def _reweigh(room: np.ndarray, answers: np.ndarray, share: np.ndarray, each: int) -> None:
    """Give contacts with little room a larger share of the internal forces, and let them answer less."""
    middle = 0.0
    for i in range(len(room)):
        middle += abs(room[i]) / len(room)
    for i in range(len(room)):
        part = max(room[i], 0.05 * middle) / max(middle, 1e-300)
        answers[i] *= part**_ANSWER
        for e in range(i * each, (i + 1) * each):
            share[e] *= part**-_PRELOAD
