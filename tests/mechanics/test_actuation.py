"""Forces that hold loads: balance, cones and limits always; the least torque against brute force."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from clench.core.exceptions import CommandError
from clench.mechanics.forces.actuation import actuation, least_effort
from clench.mechanics.forces.binding import why_not
from clench.mechanics.forces.squeeze import squeeze_forces
from clench.mechanics.grasp.contacts import make_contacts
from clench.mechanics.grasp.held import HeldObject, held_by_contacts
from clench.mechanics.grasp.loads import (
    GRAVITY,
    check_loads,
    gravity_any_direction,
    six_pulls,
    six_pulls_and_twists,
    task_wrench,
    weight,
)
from clench.mechanics.grasp.tendon_tensions import TendonDrive

from .held_cases import around_the_equator, directions, random_held, with_joints


def check_plan(held: HeldObject, plan) -> None:
    assert np.abs(held.grasp_map @ plan.forces.reshape(-1) + plan.load).max() <= 1e-9
    size = max(1.0, np.abs(plan.forces).max(initial=0.0))
    assert held.contacts.cone_slack(plan.forces).min() >= -1e-9 * size
    assert (np.abs(plan.torques) - held.dofs.limits).max(initial=-1.0) <= 1e-9 * size
    assert np.allclose(plan.torques, held.jacobian.T @ plan.forces.reshape(-1), atol=1e-12)


def pinch(friction: float = 0.5, arm: float = 0.05, limit: float = np.inf, model: str = "point") -> HeldObject:
    """Two fingers push along x at the ends of arms: torque is normal force times arm."""
    ends = np.array([[-0.03, 0.0, 0.0], [0.03, 0.0, 0.0]])
    contacts = make_contacts(ends, -ends, friction, model=model)
    jacobian = np.zeros((2 * contacts.width, 2))
    jacobian[2, 0] = jacobian[contacts.width + 2, 1] = arm
    return with_joints(held_by_contacts(contacts, np.zeros(3), 0.03), jacobian, limit)


def least_torque_by_search(held: HeldObject, load: np.ndarray) -> float:
    """Search the internal forces on a grid that gets finer; small cases only."""
    base = -np.linalg.pinv(held.grasp_map) @ load
    _, singular, rows = np.linalg.svd(held.grasp_map)
    null = rows[(singular > 1e-9).sum() :]
    assert len(null) <= 3
    center, width, best = np.zeros(len(null)), 60.0, np.inf
    for _ in range(60):
        axes = [center[k] + width * np.linspace(-1.0, 1.0, 21) for k in range(len(null))]
        grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(null))
        forces = base + grid @ null
        split = forces.reshape(len(grid), len(held.contacts), held.contacts.width)
        leaning = np.linalg.norm(split[..., :2] / held.contacts.reach[:, :2], axis=2)
        inside = (split[..., 2] >= leaning - 1e-12).all(axis=1)
        torques = np.abs(forces @ held.jacobian)
        inside &= (torques <= held.dofs.limits + 1e-12).all(axis=1)
        worst = np.where(inside, torques.max(axis=1), np.inf)
        if worst.min() <= best:
            best, center = worst.min(), grid[worst.argmin()]
            width *= 0.85
        else:
            width *= 0.7
    return float(best)


def test_a_pinch_needs_half_the_weight_over_friction() -> None:
    load = weight(0.2, [0.0, 0.0, -1.0])
    answer = actuation(pinch(0.5, 0.05), load)
    assert answer.worst_torque == pytest.approx(0.2 * GRAVITY / 2.0 / 0.5 * 0.05, rel=1e-7)
    check_plan(pinch(0.5, 0.05), answer.plans[0])


def test_least_torque_equals_brute_force() -> None:
    rng = np.random.default_rng(4)
    compared = 0
    for _ in range(12):
        held = around_the_equator(rng)
        load = np.concatenate([directions(rng, 1)[0], 0.1 * directions(rng, 1)[0]])
        plan = least_effort(held, load)
        searched = least_torque_by_search(held, load)
        if plan is None:
            assert not np.isfinite(searched)
            continue
        check_plan(held, plan)
        if np.isfinite(searched):
            assert plan.worst_torque <= searched + 1e-7
            assert plan.worst_torque == pytest.approx(searched, rel=2e-3)
            compared += 1
    assert compared >= 8


def test_least_torque_lies_between_inner_and_outer_polyhedra() -> None:
    rng = np.random.default_rng(11)
    edges = 48
    for model in ("point", "soft"):
        held = random_held(rng, 6, joints=5, model=model)
        load = np.concatenate([directions(rng, 1)[0], 0.3 * directions(rng, 1)[0]])
        plan = least_effort(held, load)
        assert plan is not None
        bounds = []
        for grown in (1.0, 1.0 / np.cos(np.pi / edges)):
            contacts = replace(held.contacts, friction=held.contacts.friction * grown)
            generators = contacts.cone_edges(edges)
            blocks = held.jacobian.reshape(6, contacts.width, -1)
            torques = np.einsum("cew,cwd->dce", generators, blocks).reshape(5, -1)
            wrenches = replace(held, contacts=contacts).edge_wrenches(edges).reshape(-1, 6).T
            n = wrenches.shape[1]
            answer = linprog(
                np.append(np.zeros(n), 1.0),
                A_eq=np.hstack([wrenches, np.zeros((6, 1))]),
                b_eq=-load,
                A_ub=np.vstack([np.hstack([s * torques, -np.ones((5, 1))]) for s in (1.0, -1.0)]),
                b_ub=np.zeros(10),
            )
            bounds.append(answer.fun)
        assert plan.worst_torque <= bounds[0] + 1e-7
        if model == "point":  # a soft finger's polyhedron, grown or not, has flat sides
            assert bounds[1] - 1e-7 <= plan.worst_torque
            assert bounds[0] <= 1.1 * bounds[1]


@settings(max_examples=40, deadline=None)
@given(
    seed=st.integers(0, 10_000),
    count=st.integers(1, 8),
    limit=st.sampled_from([0.02, 0.2, 2.0, np.inf]),
    mass=st.floats(1e-4, 50.0),
    model=st.sampled_from(["point", "soft"]),
)
def test_every_plan_keeps_balance_cones_and_limits(
    seed: int, count: int, limit: float, mass: float, model: str
) -> None:
    held = random_held(np.random.default_rng(seed), count, limit=limit, model=model)
    load = weight(mass, [0.3, -0.2, -1.0])
    answer = actuation(held, np.vstack([load, six_pulls(mass)]))
    for plan in answer.plans:
        if plan is not None:
            check_plan(held, plan)
    assert (answer.worst_torque is None) == (answer.reason != "") == any(p is None for p in answer.plans)
    squeezed = squeeze_forces(held, load, six_pulls_and_twists(mass))
    assert (squeezed.plan is None) == (squeezed.reason != "")
    if squeezed.plan is not None:
        check_plan(held, squeezed.plan)


def test_gravity_in_any_direction_is_covered() -> None:
    loads = gravity_any_direction(0.3)
    # Every direction reaches at least the weight: the weight's ball lies inside the icosahedron.
    reach = (loads[:, :3] @ directions(np.random.default_rng(0), 500).T).max(axis=0)
    assert reach.min() >= 0.3 * GRAVITY - 1e-12
    assert np.linalg.norm(loads[:, :3], axis=1) == pytest.approx(0.3 * GRAVITY * 1.2584, rel=1e-4)
    held = random_held(np.random.default_rng(3), 7)
    most = actuation(held, loads).worst_torque
    assert most is not None
    for d in directions(np.random.default_rng(1), 10):
        single = actuation(held, weight(0.3, d)).worst_torque
        assert single is not None
        assert single <= most + 1e-7


def test_what_binds_is_named() -> None:
    load = weight(0.2, [0.0, 0.0, -1.0])[0]
    needed = 0.2 * GRAVITY / 2.0 / 0.5 * 0.05
    assert "Torque limits bind: 'joint_0' (0.05 Nm), 'joint_1' (0.05 Nm); 1.96 times" in why_not(
        pinch(limit=0.05), load
    )
    assert needed / 0.05 == pytest.approx(1.96, abs=0.01)
    n = directions(np.random.default_rng(2), 8)
    n[:, 2] = -np.abs(n[:, 2]) - 1.0
    above = random_held(np.random.default_rng(0), 8)
    above = replace(above, contacts=make_contacts(-n, n, 0.3))
    assert "Friction binds" in why_not(above, load) or "No friction would do" in why_not(above, load)
    turning = task_wrench([0.0, 0.0, 0.0], [0.01, 0.0, 0.0], 0.03)[0]
    assert why_not(pinch(), turning).startswith("No friction would do")
    nothing = held_by_contacts(make_contacts(np.empty((0, 3)), np.empty((0, 3))), np.zeros(3), 1.0)
    assert why_not(nothing, load) == "Nothing touches the object."


def test_friction_that_would_do_is_found() -> None:
    """A cylinder between two fingers below its middle: they must lean up by more than the friction allows."""
    down = np.array([0.0, 0.0, 0.5])
    ends = np.array([[-0.03, 0.0, 0.0], [0.03, 0.0, 0.0]])
    inward = -ends / 0.03 - down  # pushes downwards, too
    held = held_by_contacts(make_contacts(ends, inward, 0.3), np.zeros(3), 0.03)
    sentence = why_not(held, weight(0.1, [0.0, 0.0, -1.0])[0])
    assert sentence.startswith("Friction binds: 1.67 times as much would do (at least 0.5")


def test_little_more_friction_than_needed_always_holds() -> None:
    """The solver's long steps go in circles for some of these, which is no proof that nothing holds."""
    ends = np.array([[-0.03, 0.0, 0.0], [0.03, 0.0, 0.0]])
    load = weight(0.1, [0.0, 0.0, -1.0])[0]
    for friction in np.linspace(0.5015, 0.56, 300)[78:90]:
        contacts = make_contacts(ends, -ends / 0.03 - [0.0, 0.0, 0.5], friction)
        assert least_effort(held_by_contacts(contacts, np.zeros(3), 0.03), load) is not None


@pytest.mark.parametrize("friction", [1e-6, 1e-3, 0.3])
def test_friction_is_what_lacks_however_little_there_is(friction: float) -> None:
    """Two fingers that push a little downwards hold with friction 0.5 and a little more, from whatever they have."""
    ends = np.array([[-0.03, 0.0, 0.0], [0.03, 0.0, 0.0]])
    held = held_by_contacts(make_contacts(ends, -ends / 0.03 - [0.0, 0.0, 0.5], friction), np.zeros(3), 0.03)
    sentence = why_not(held, weight(0.1, [0.0, 0.0, -1.0])[0])
    assert sentence.startswith("Friction binds:")
    assert "at least 0.5" in sentence


def test_squeeze_has_the_margin_that_limits_allow() -> None:
    held, load = pinch(0.5, 0.05, limit=0.2), weight(0.2, [0.0, 0.0, -1.0])
    pulls = six_pulls(0.2 * GRAVITY)
    answer = squeeze_forces(held, load, pulls, enough=100.0)
    assert answer.plan is not None
    check_plan(held, answer.plan)
    # Normal force N = 0.2 / 0.05 = 4 N at most. A pull s W along x takes s W / 2 from one finger and adds it to the
    # other, whose torque binds: N + s W / 2 <= 4; a pull down must be held by friction: (1 + s) W / 2 <= 0.5 N; a pull
    # along x leaves N - s W / 2, which must hold W / 2.
    W = 0.2 * GRAVITY
    best = max(min((4.0 - N) * 2.0 / W, N / W - 1.0, (N - W) * 2.0 / W) for N in np.linspace(0.0, 4.0, 40_001))
    assert answer.margin == pytest.approx(best, rel=1e-3)
    gentle = squeeze_forces(held, load, pulls, enough=0.1)
    assert gentle.margin == pytest.approx(0.1, rel=1e-4)
    assert gentle.plan.worst_torque < answer.plan.worst_torque


def test_squeeze_survives_every_disturbance_up_to_its_margin() -> None:
    rng = np.random.default_rng(11)
    checked = 0
    for model in ("point", "soft"):
        held = random_held(rng, 6, limit=0.5, model=model)
        load, disturbances = weight(0.1, [0.0, 0.0, -1.0]), six_pulls_and_twists(0.98)
        answer = squeeze_forces(held, load, disturbances)
        assert answer.plan is not None
        for d in disturbances:
            plan = least_effort(held, load[0] + answer.margin * d)
            assert plan is not None  # what the squeeze survives without reaction, chosen forces hold, too
            checked += 1
    assert checked == 24


def test_disturbances_that_contacts_cannot_resist_are_told() -> None:
    answer = squeeze_forces(pinch(), weight(0.1, [0.0, 0.0, -1.0]), six_pulls_and_twists(1.0))
    assert answer.plan is not None
    assert answer.unresisted == (6, 9)  # turning about the line of the fingers
    soft = squeeze_forces(pinch(model="soft"), weight(0.1, [0.0, 0.0, -1.0]), six_pulls_and_twists(1.0))
    assert soft.unresisted == ()


def test_no_squeeze_says_why() -> None:
    answer = squeeze_forces(pinch(limit=0.05), weight(0.2, [0.0, 0.0, -1.0]), six_pulls(1.0))
    assert answer.plan is None
    assert answer.margin == 0.0
    assert "Torque limits bind: 'joint_0'" in answer.reason


def test_no_load_needs_no_force() -> None:
    answer = actuation(pinch(), weight(0.0, [0.0, 0.0, -1.0]))
    assert answer.worst_torque == pytest.approx(0.0, abs=1e-9)


def test_malformed_loads_are_refused_in_one_sentence() -> None:
    for mass in (-0.1, np.nan, np.inf):
        with pytest.raises(CommandError, match=r"mass: expected a finite number of at least 0 kg, got"):
            gravity_any_direction(mass)
    with pytest.raises(CommandError, match=r"gravity: expected a direction"):
        weight(0.1, [0.0, 0.0, 0.0])
    with pytest.raises(CommandError, match=r"loads: the set is empty"):
        actuation(pinch(), np.empty((0, 6)))
    with pytest.raises(CommandError, match=r"loads: expected rows of six numbers .* got shape \(1, 3\)"):
        check_loads([[1.0, 2.0, 3.0]])
    with pytest.raises(CommandError, match=r"loads: expected finite numbers"):
        check_loads([[np.nan] * 6])
    with pytest.raises(CommandError, match=r"pull: expected a force above 0 N, got 0"):
        six_pulls(0.0)
    with pytest.raises(CommandError, match=r"task wrench: expected three finite numbers as torque"):
        task_wrench([0.0, 0.0, 1.0], [0.0, np.inf, 0.0], 1.0)
    for margin in (0.0, -1.0, np.nan):
        with pytest.raises(CommandError, match=r"margin: expected a finite number above 0"):
            squeeze_forces(pinch(), weight(0.1, [0, 0, -1]), six_pulls(1.0), enough=margin)


def test_an_effort_that_the_hand_does_not_have_is_refused() -> None:
    load = weight(0.1, [0.0, 0.0, -1.0])
    with pytest.raises(CommandError, match=r"effort: the hand has no tendons"):
        actuation(pinch(), load, "tension")
    with pytest.raises(CommandError, match=r"effort: expected one of torque, tension, got 'energy'"):
        actuation(pinch(), load, "energy")


def test_least_tension_of_a_pinch_in_closed_form() -> None:
    """Each finger needs 1.96 N of normal force at an arm of 5 cm; its flexor pulls at 1 cm, against a taut extensor."""
    arms = np.array([[0.01, -0.008, 0.0, 0.0], [0.0, 0.0, 0.01, -0.008]])
    drive = TendonDrive(("joint_0", "joint_1"), (0, 1), arms, np.full(4, 2.0), np.full(4, 50.0))
    load = weight(0.2, [0.0, 0.0, -1.0])
    answer = actuation(replace(pinch(), drive=drive), load, "tension")
    torque = 0.2 * GRAVITY / 2.0 / 0.5 * 0.05
    assert answer.worst_tension == pytest.approx((torque + 0.008 * 2.0) / 0.01, rel=1e-6)
    assert answer.plans[0].tensions[[1, 3]] == pytest.approx([2.0, 2.0], abs=1e-6)
    weak = replace(pinch(), drive=replace(drive, t_max=np.full(4, 10.0)))
    assert actuation(weak, load, "tension").reason == (
        "Tendons bind: no tensions within their limits give the torques of 'joint_0', 'joint_1'."
    )
