"""A lower bound of what a grasp resists, in closed form: affine responses to wrenches (METHOD.md section 6).

Forces `f = s f0 + K w` exert the wrench w when `G f0 = 0` and `G K = 1`. They stay inside every face `a f >= 0` of the
friction polyhedra for all `|w| <= r` when `s a f0 >= r |K^T a|`, and below every cap `c f <= b` when
`s |c f0| + r |K^T c| <= b`. So r is resisted; how near it comes to the largest depends on f0 and K, which a few rounds
of reweighting improve: contacts that bind get more preload and answer less.
"""

from __future__ import annotations

import numpy as np

from .compiling import kernel

#: How often forces are drawn into the cones and to balance in a round.
_TURNS = 6
#: Forces are drawn to this part of the friction cone [-].
_LEANING = 0.4


@kernel
def resisted_ball(
    G: np.ndarray, faces: np.ndarray, reach: np.ndarray, caps: np.ndarray, most: np.ndarray, rounds: int
) -> float:
    """Return the radius of a ball of wrenches that is resisted, 0 when none was found.

    Args:
        G: grasp map, shape (6, n) with n = C * width. faces: inward normals of the cones' faces, shape (C, F, width).
        reach: semi-axes of the cones at unit normal force by component, 1 for the normal, shape (C, width).
        caps: rows c of `|c f| <= most`, shape (M, n). most: finite bounds, shape (M,). rounds: of reweighting.
    """
    count, _, width = faces.shape
    answers, preload = np.ones(count), np.ones(count)
    room = np.empty(count)
    K = np.empty((count * width, 6))
    f0, wanted = np.empty(count * width), np.zeros(count * width)
    wanted[2::width] = 1.0
    best = 0.0
    for _ in range(rounds):
        if not _response(G, reach, answers, K):
            return 0.0
        _internal_forces(G, K, preload, reach, wanted, f0)
        least = np.inf
        for i in range(count):
            room[i] = _room(faces[i], f0[i * width : (i + 1) * width], K[i * width : (i + 1) * width])
            least = min(least, room[i])
        if least > 0.0:
            best = max(best, _capped(least, f0, K, caps, most))
        _reweigh(room, answers, preload)
    return best


@kernel
def _response(G: np.ndarray, reach: np.ndarray, answers: np.ndarray, K: np.ndarray) -> bool:
    """Write `K = H G^T (G H G^T)^-1` with weights H; say whether the wrenches span all directions."""
    count, width = reach.shape
    M = np.zeros((6, 6))
    for i in range(count):
        for k in range(width):
            column, h = i * width + k, answers[i] * reach[i, k] * reach[i, k]
            for r in range(6):
                for c in range(r + 1):
                    M[r, c] += h * G[r, column] * G[c, column]
    L = np.zeros((6, 6))
    for r in range(6):
        for c in range(r + 1):
            left = M[r, c]
            for k in range(c):
                left -= L[r, k] * L[c, k]
            if r == c:
                if left <= 1e-12 * M[r, r]:
                    return False
                L[r, r] = np.sqrt(left)
            else:
                L[r, c] = left / L[c, c]
    for i in range(count):
        for k in range(width):
            column, h = i * width + k, answers[i] * reach[i, k] * reach[i, k]
            for r in range(6):
                left = h * G[r, column]
                for c in range(r):
                    left -= L[r, c] * K[column, c]
                K[column, r] = left / L[r, r]
            for r in range(5, -1, -1):
                left = K[column, r]
                for c in range(r + 1, 6):
                    left -= L[c, r] * K[column, c]
                K[column, r] = left / L[r, r]
    return True


@kernel
def _internal_forces(
    G: np.ndarray, K: np.ndarray, preload: np.ndarray, reach: np.ndarray, wanted: np.ndarray, f0: np.ndarray
) -> None:
    """Write forces that balance each other, by turns drawn into the cones and to balance.

    Args:
        wanted: where they start, and where they last lay well inside the cones, shape (n,); changed.
        f0: written, shape (n,).
    """
    count, width = reach.shape
    for _ in range(_TURNS):
        wrench = np.zeros(6)
        for column in range(len(f0)):
            for r in range(6):
                wrench[r] += G[r, column] * wanted[column]
        for column in range(len(f0)):
            f0[column] = wanted[column]
            for r in range(6):
                f0[column] -= K[column, r] * wrench[r]
        for i in range(count):
            _draw_in(f0[i * width : (i + 1) * width], preload[i], reach[i], wanted[i * width : (i + 1) * width])


@kernel
def _draw_in(force: np.ndarray, preload: float, reach: np.ndarray, wanted: np.ndarray) -> None:
    """Write the force well inside its cone that is near a given one, with at least half of the preload."""
    normal = max(force[2], 0.5 * preload)
    leaning = 0.0
    for k in range(len(force)):
        if k != 2:
            leaning += (force[k] / reach[k]) ** 2
    leaning = np.sqrt(leaning)
    most = _LEANING * normal
    for k in range(len(force)):
        wanted[k] = normal if k == 2 else force[k] * min(1.0, most / max(leaning, 1e-300))


@kernel
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


@kernel
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


@kernel
def _reweigh(room: np.ndarray, answers: np.ndarray, preload: np.ndarray) -> None:
    """Give contacts with little room more preload, and let them answer less."""
    middle = 0.0
    for i in range(len(room)):
        middle += abs(room[i]) / len(room)
    for i in range(len(room)):
        share = max(room[i], 0.05 * middle) / max(middle, 1e-300)
        preload[i] *= share**-0.3
        answers[i] *= share**0.2
