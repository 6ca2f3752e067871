"""Find the palm of a hand in a tree of bodies: alone, at the end of an arm, or inside a whole robot."""

from __future__ import annotations

from typing import Any

import numpy as np

from clench.core.exceptions import HandError, UnknownNameError
from clench.models.hand.reading.compiled import CompiledModel

#: A branch that forks again within so many joints is a metacarpal of the same hand, not an arm.
_METACARPAL_JOINTS = 2


def find_palm(compiled: CompiledModel, name: str | None) -> int:
    """Return the body of the palm: the one named, or the last common ancestor of the fingers.

    Raises:
        UnknownNameError: no such link. HandError: no moving joint, or several hands to choose from.
    """
    m = compiled.model
    moving = _moving_bodies(m)
    if name is not None:
        return _named(compiled, name, moving)
    if not moving:
        raise HandError(f"{compiled.label}: has no closing joint: no revolute joint at all.")
    leaves = [b for b in moving if not any(_is_ancestor(m, b, c) for c in moving if c != b)]
    if len(leaves) == 1:
        first = next(b for b in _path(m, leaves[0]) if b in moving)
        return int(m.body_parentid[first])
    candidates = _candidates(m, moving, leaves)
    if len(candidates) == 1:
        return candidates[0]
    listed = ", ".join(f"'{compiled.body_name(b)}'" for b in candidates)
    raise HandError(
        f'{compiled.label}: several links carry two or more chains of joints ({listed}); name the palm (palm = "…").'
    )


def hand_bodies(model: Any, palm: int) -> list[int]:
    """Return the bodies of a hand, parents first: the chain from the root to the palm, and all below the palm.

    The world is one of them only when it is the palm.
    """
    chain = set(_path(model, palm)) or {palm}
    return [b for b in range(model.nbody) if b in chain or _is_ancestor(model, palm, b)]


def _moving_bodies(model: Any) -> list[int]:
    """Return the bodies that a joint moves relative to their parent; a free joint makes no finger."""
    import mujoco

    free = mujoco.mjtJoint.mjJNT_FREE
    bodies = {int(b) for b, kind in zip(model.jnt_bodyid, model.jnt_type, strict=True) if kind != free}
    return sorted(bodies)


def _named(compiled: CompiledModel, name: str, moving: list[int]) -> int:
    m = compiled.model
    names = [compiled.body_name(b) for b in range(m.nbody)]
    if name not in names:
        raise UnknownNameError("link", name, compiled.label, names[1:])
    palm = names.index(name)
    if not any(b != palm and _is_ancestor(m, palm, b) for b in moving):
        raise HandError(f"{compiled.label}: has no closing joint: no joint moves anything below the palm '{name}'.")
    return palm


def _candidates(model: Any, moving: list[int], leaves: list[int]) -> list[int]:
    """Return the bodies that carry at least two chains, metacarpals counted to their palm; most chains first."""
    forks: dict[int, list[int]] = {}
    for i, a in enumerate(leaves):
        for b in leaves[i + 1 :]:
            fork = _common_ancestor(model, a, b)
            forks[fork] = sorted({*forks.get(fork, []), a, b})
    for fork in sorted(forks, key=lambda b: -len(_path(model, b))):
        parent = next((b for b in reversed(_path(model, fork)[:-1]) if b in forks), 0 if 0 in forks else None)
        if parent is None or parent == fork:
            continue
        between = [b for b in _path(model, fork) if b in moving and _is_ancestor(model, parent, b) and b != parent]
        joints = int(np.sum([model.body_jntnum[b] for b in between]))
        if joints <= _METACARPAL_JOINTS:
            forks[parent] = sorted({*forks[parent], *forks.pop(fork)})
    return sorted((b for b in forks if _own_chains(model, b, forks) >= 2), key=lambda b: -len(forks[b]))


def _own_chains(model: Any, fork: int, forks: dict[int, list[int]]) -> int:
    """Return how many chains start at a fork and do not pass another one below it."""
    below = [b for b in forks if b != fork and _is_ancestor(model, fork, b)]
    return sum(1 for leaf in forks[fork] if not any(_is_ancestor(model, b, leaf) for b in below))


def _path(model: Any, body: int) -> list[int]:
    """Return the bodies from the root to a body, without the world."""
    path: list[int] = []
    while body > 0:
        path.append(body)
        body = int(model.body_parentid[body])
    return path[::-1]


def _is_ancestor(model: Any, ancestor: int, body: int) -> bool:
    """Return whether a body is another one or lies below it."""
    while body > ancestor:
        body = int(model.body_parentid[body])
    return body == ancestor


def _common_ancestor(model: Any, a: int, b: int) -> int:
    while a != b:
        if a > b:
            a = int(model.body_parentid[a])
        else:
            b = int(model.body_parentid[b])
    return a
