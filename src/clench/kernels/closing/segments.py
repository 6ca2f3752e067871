"""Find the next motion while a finger closes: the path segments of every order (docs/method.md section 4)."""

from __future__ import annotations

import math

from clench.kernels.runtime.compiling import kernel

from .layout import ChainArrays, Floats, Ints

#: The degree of freedom of a motion in which all move at once.
ALL = -1


@kernel
def next_bound(chain: ChainArrays, j: int, travel: float) -> float:
    """Return the travel at which a joint next starts or stops, or its degree of freedom is at its limit."""
    g = chain.joint_dof[j]
    if travel < chain.start[j]:
        return min(float(chain.start[j]), float(chain.dof_length[g]))
    if travel < chain.stop[j]:
        return min(float(chain.stop[j]), float(chain.dof_length[g]))
    return float(chain.dof_length[g])


@kernel
def next_segment(
    chain: ChainArrays,
    joints: tuple[int, int],
    dof: int,
    travel: Floats,
    locked: Ints,
    until: Floats,
    along: float,
    rates: Floats,
) -> float:
    """Write the present speed of every joint; return how long it lasts, 0 when nothing moves any more.

    Args:
        joints: range of the finger's. dof: the moving one, or `ALL`. travel: of every degree of freedom [rad], (G,).
        locked: joints that stand still, (J,). until: see `CandidateArrays`, (J,). along: the motion so far.
    """
    end = math.inf
    for j in range(joints[0], joints[1]):
        rates[j] = 0.0
        g = chain.joint_dof[j]
        s = travel[g]
        if (dof != ALL and g != dof) or locked[j] or s >= chain.dof_length[g]:
            continue
        speed = chain.speed[g] if dof == ALL else 1.0
        end = min(end, (next_bound(chain, j, s) - s) / speed)
        if until[j] < math.inf:
            end = min(end, until[j] - along)
        if chain.start[j] <= s < chain.stop[j]:
            rates[j] = chain.rate[j] * speed
    return 0.0 if end == math.inf else end


@kernel
def first_member(chain: ChainArrays, begin: int, joint: int) -> int:
    """Return the finger's first joint that moves with a joint; such joints need not stand side by side."""
    first = begin
    while chain.joint_dof[first] != chain.joint_dof[joint]:
        first += 1
    return first


@kernel
def move_dofs(
    chain: ChainArrays, joints: tuple[int, int], dof: int, travel: Floats, locked: Ints, moved: float
) -> None:
    """Move every degree of freedom that has an unlocked joint; bounds that are reached are reached exactly."""
    for first in range(joints[0], joints[1]):
        g = chain.joint_dof[first]
        if (dof != ALL and g != dof) or first_member(chain, joints[0], first) != first:
            continue
        moves, bound = False, math.inf
        for j in range(first, joints[1]):
            if chain.joint_dof[j] == g and not locked[j]:
                moves, bound = True, min(bound, next_bound(chain, j, travel[g]))
        if moves and travel[g] < chain.dof_length[g]:
            speed = chain.speed[g] if dof == ALL else 1.0
            travel[g] = bound if moved >= (bound - travel[g]) / speed else travel[g] + speed * moved


@kernel
def lock_joints(chain: ChainArrays, joints: tuple[int, int], last: int, locked: Ints) -> None:
    """Lock the joints up to `last`, and with each its degree of freedom, unless later joints of this break away."""
    for j in range(joints[0], last + 1):
        locked[j] = 1
        if not chain.breaks[chain.joint_dof[j]]:
            for k in range(joints[0], joints[1]):
                if chain.joint_dof[k] == chain.joint_dof[j]:
                    locked[k] = 1


@kernel
def lock_held(chain: ChainArrays, joints: tuple[int, int], until: Floats, along: float, locked: Ints) -> None:
    """Lock the joints that are stopped from outside from here on."""
    for j in range(joints[0], joints[1]):
        if until[j] <= along and not locked[j]:
            lock_joints(chain, joints, j, locked)
