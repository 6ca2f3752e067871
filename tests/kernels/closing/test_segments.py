"""What moves next, against where every joint is at any time: a closed form, whatever the degrees of freedom, limits
and holds.
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clench.kernels.closing import segments
from clench.kernels.closing.layout import ChainArrays
from clench.kernels.closing.segments import ALL
from kernels.kernel_entries import entry

next_segment, move_dofs, lock_joints, lock_held = (
    entry(getattr(segments, name)) for name in ("next_segment", "move_dofs", "lock_joints", "lock_held")
)


def random_chain(rng):
    """Return joints of degrees of freedom that need not stand side by side, with starts and stops on the way of
    their degree of freedom.
    """
    joints = int(rng.integers(1, 7))
    dof = np.unique(rng.integers(0, joints, joints), return_inverse=True)[1]
    dofs = int(dof.max()) + 1
    length = rng.uniform(0.5, 2.0, dofs)
    start = np.where(rng.random(joints) < 0.3, rng.uniform(0.0, 1.5, joints), 0.0)
    stop = start + np.where(rng.random(joints) < 0.5, rng.uniform(0.1, 1.0, joints), 9.0)
    speed = np.where(rng.random(dofs) < 0.5, 1.0, rng.uniform(0.2, 3.0, dofs))
    breaks = (rng.random(dofs) < 0.5).astype(np.int64)
    numbers = (rng.uniform(-1.5, 1.5, joints), start, stop, length, speed)
    return ChainArrays(np.zeros(joints, np.int64), dof, np.zeros((joints, 2)), *numbers, breaks)


def run(chain, dof, until, times):
    """Move on from segment to segment, each cut at the times that are looked at; return the turns there."""
    joints, rates = (0, len(chain.rate)), np.full(len(chain.rate), np.nan)
    travel, locked = np.zeros(len(chain.speed)), np.zeros(len(chain.rate), np.int64)
    turns, along, seen, pieces = np.zeros(len(chain.rate)), 0.0, [], 0
    for end_of_look in [*times, np.inf]:
        while True:
            lock_held(chain, joints, until, along, locked)
            end = next_segment(chain, joints, dof, travel, locked, until, along, rates)
            moved = min(end, end_of_look - along)
            if moved <= 0.0:
                break
            pieces += 1
            assert pieces < 200
            turns += rates * moved
            move_dofs(chain, joints, dof, travel, locked, moved)
            along = end_of_look if moved < end else along + moved
        if end == 0.0:
            along = max(along, min(end_of_look, 1e9))
        seen.append(turns.copy())
    return seen, travel


def expected(chain, dof, until, time):
    """Each joint moves while its degree of freedom is between its start and stop, until it is held, alone or with
    its degree of freedom.
    """
    held = until.copy()
    for g in range(len(chain.speed)):
        if not chain.breaks[g]:
            held[chain.joint_dof == g] = until[chain.joint_dof == g].min()
    speed = chain.speed if dof == ALL else np.where(np.arange(len(chain.speed)) == dof, 1.0, 0.0)
    way = np.minimum(time, held) * speed[chain.joint_dof]
    last = np.minimum(chain.stop, chain.dof_length[chain.joint_dof])
    return chain.rate * np.maximum(np.minimum(way, last) - chain.start, 0.0)


@settings(deadline=None, max_examples=300)
@given(st.integers(0, 10**6))
def test_joints_are_where_the_closed_form_says(seed):
    rng = np.random.default_rng(seed)
    chain = random_chain(rng)
    joints = len(chain.rate)
    dof = ALL if rng.random() < 0.6 else int(rng.integers(0, len(chain.speed)))
    until = np.full(joints, np.inf)
    for _ in range(int(rng.integers(0, 3)) if dof == ALL else 0):
        last = int(rng.integers(0, joints))
        until[: last + 1] = np.minimum(until[: last + 1], rng.uniform(0.0, 2.0))
    times = np.sort(rng.uniform(0.0, 3.0, 3))
    seen, travel = run(chain, dof, until, times)
    for turns, time in zip(seen, [*times, 1e6], strict=True):
        np.testing.assert_allclose(turns, expected(chain, dof, until, time), atol=1e-12)
    free = np.isinf(until).all()
    moving = np.arange(len(travel)) == dof if dof != ALL else np.ones(len(travel), bool)
    if free:
        # Limits are reached exactly; degrees of freedom that were not asked to move did not.
        assert (travel == np.where(moving, chain.dof_length, 0.0)).all()


@pytest.mark.parametrize("breaks", [0, 1])
def test_joints_up_to_one_are_held_and_their_degrees_of_freedom_unless_these_break(breaks):
    chain = random_chain(np.random.default_rng(0))
    chain = chain._replace(joint_dof=np.array([0, 1, 0, 2]), breaks=np.array([breaks, 0, 0]))
    locked = np.zeros(4, np.int64)
    lock_joints(chain, (0, 4), 1, locked)
    assert locked.tolist() == [1, 1, 1 - breaks, 0]


def test_only_a_fingers_own_joints_are_touched():
    chain = ChainArrays(
        *(np.zeros(4, np.int64), np.array([0, 1, 2, 1]), np.zeros((4, 2)), np.ones(4), np.zeros(4)),
        *(np.full(4, 9.0), np.ones(3), np.ones(3), np.zeros(3, np.int64)),
    )
    rates, travel, locked = np.full(4, np.nan), np.zeros(3), np.zeros(4, np.int64)
    assert next_segment(chain, (1, 3), ALL, travel, locked, np.full(4, np.inf), 0.0, rates) == 1.0
    assert rates[1:3].tolist() == [1.0, 1.0]
    assert np.isnan(rates[[0, 3]]).all()
    move_dofs(chain, (1, 3), ALL, travel, locked, 0.25)
    assert travel.tolist() == [0.0, 0.25, 0.25]
    lock_joints(chain, (1, 3), 2, locked)
    assert locked.tolist() == [0, 1, 1, 0]
    move_dofs(chain, (1, 3), ALL, travel, locked, 0.25)
    assert travel.tolist() == [0.0, 0.25, 0.25]
