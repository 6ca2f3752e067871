"""Find which joints move together: mimic joints, joint and tendon equalities, tendons with one actuator."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from clench.core.exceptions import HandError
from clench.models.hand.findings import Finding, FindingCode
from clench.models.hand.hand import Coupling
from clench.models.hand.reading.compiled import CompiledModel
from clench.models.hand.reading.kinematics import Skeleton, fixed_tendon

_NONLINEAR = 1e-12
_CONTRADICTION = 1e-9
#: Ratios [-], their inverses, and offsets [rad] are at most this.
_LARGEST = 1e6


@dataclass(frozen=True)
class Relation:
    """State `q_follower = ratio * q_leader + offset`, with the element that says so; MuJoCo's joint numbers."""

    leader: int
    follower: int
    ratio: float
    offset: float
    reason: str
    breakaway: bool = False


@dataclass(frozen=True)
class FoundCouplings:
    """Couplings that a model states: between joints, to one angle [rad], and findings about them."""

    couplings: tuple[Coupling, ...]
    held: Mapping[int, float]
    findings: tuple[Finding, ...]


def find_couplings(compiled: CompiledModel, skeleton: Skeleton) -> FoundCouplings:
    """Read every coupling of a hand, each follower tied to its last leader.

    Raises:
        HandError: not linear, over more than two joints, or contradictory.
    """
    held: dict[int, float] = {}
    relations = [*_equalities(compiled, skeleton, held)]
    findings: list[Finding] = []
    relations += _driven_tendons(compiled, skeleton, relations)
    index = skeleton.joint_of_model
    for r in relations:
        if (r.leader in index) != (r.follower in index):
            known, other = (r.leader, r.follower) if r.leader in index else (r.follower, r.leader)
            names = compiled.joint_name(known), compiled.joint_name(other)
            findings.append(
                Finding(
                    FindingCode.COUPLING_LEFT_OUT,
                    f"Joint '{names[0]}' is coupled to '{names[1]}', "
                    "which is no part of this hand; the coupling is left out.",
                    "If both belong to the hand, name the palm that carries both (--palm, or palm in the hand file).",
                    joints=names,
                )
            )
    mapped = [
        Relation(index[r.leader], index[r.follower], r.ratio, r.offset, r.reason, r.breakaway)
        for r in relations
        if r.leader in index and r.follower in index
    ]
    return FoundCouplings(
        flatten(mapped, [j.name for j in skeleton.joints], compiled.label),
        {index[j]: q for j, q in held.items()},
        tuple(findings),
    )


def flatten(relations: list[Relation], names: list[str], label: str) -> tuple[Coupling, ...]:
    """Tie every follower to the last leader of its chain.

    Args:
        relations: with joint indices. names: of the joints. label: of the hand, for messages.

    Raises:
        HandError: two relations contradict each other.
    """
    known: dict[int, tuple[int, float, float]] = {}
    reasons: dict[int, Relation] = {}
    followers = {r.follower for r in relations}
    roots = sorted({r.leader for r in relations} - followers) or sorted(followers)[:1]
    pending = list(relations)
    for root in [*roots, *sorted(followers)]:
        if root in known or not any(root in (r.leader, r.follower) for r in pending):
            continue
        known[root] = (root, 1.0, 0.0)
        pending = _spread(known, reasons, pending)
    for r in relations:
        _check_size(r, names, label)
        _check(r, known, names, label)
    return tuple(
        Coupling(leader, joint, ratio, offset, reasons[joint].breakaway, reasons[joint].reason)
        for joint, (leader, ratio, offset) in sorted(known.items())
        if joint != leader
    )


def _spread(
    known: dict[int, tuple[int, float, float]], reasons: dict[int, Relation], pending: list[Relation]
) -> list[Relation]:
    """Carry known joints over the relations that touch them, until nothing is added; return the rest."""
    progress = True
    while progress:
        progress = False
        rest: list[Relation] = []
        for r in pending:
            if r.leader in known and r.follower not in known:
                root, a, b = known[r.leader]
                known[r.follower] = (root, r.ratio * a, r.ratio * b + r.offset)
                reasons[r.follower] = r
            elif r.follower in known and r.leader not in known and abs(r.ratio) > 0.0:
                root, a, b = known[r.follower]
                known[r.leader] = (root, a / r.ratio, (b - r.offset) / r.ratio)
                reasons[r.leader] = r
            elif r.leader not in known:
                rest.append(r)
                continue
            else:
                continue
            progress = True
        pending = rest
    return pending


def _check_size(r: Relation, names: list[str], label: str) -> None:
    """Refuse a ratio or an offset that cannot be computed with."""
    if not (r.ratio == 0.0 or 1.0 / _LARGEST <= abs(r.ratio) <= _LARGEST) or not abs(r.offset) <= _LARGEST:
        raise HandError(
            f"{label}: joint '{names[r.follower]}' is coupled by a ratio of {r.ratio:g} and an offset of {r.offset:g} "
            f"rad; expected a ratio of 0 or of {1.0 / _LARGEST:g} to {_LARGEST:g}, and no larger offset ({r.reason})."
        )


def _check(r: Relation, known: Mapping[int, tuple[int, float, float]], names: list[str], label: str) -> None:
    root_l, a_l, b_l = known[r.leader]
    root_f, a_f, b_f = known[r.follower]
    same = root_l == root_f and abs(r.ratio * a_l - a_f) < _CONTRADICTION
    if not same or abs(r.ratio * b_l + r.offset - b_f) > _CONTRADICTION:
        raise HandError(
            f"{label}: joint '{names[r.follower]}' is coupled in two ways that contradict each other ({r.reason})."
        )


def _equalities(compiled: CompiledModel, skeleton: Skeleton, held: dict[int, float]) -> list[Relation]:
    import mujoco

    m = compiled.model
    found: list[Relation] = []
    for e in range(m.neq):
        if not m.eq_active0[e]:
            continue
        first, second = int(m.eq_obj1id[e]), int(m.eq_obj2id[e])
        coefficients = np.array(m.eq_data[e][:5])
        if m.eq_type[e] == mujoco.mjtEq.mjEQ_JOINT:
            reason = f"joint equality of '{compiled.joint_name(first)}'"
            terms = {first: 1.0}, {} if second < 0 else {second: 1.0}
        elif m.eq_type[e] == mujoco.mjtEq.mjEQ_TENDON:
            reason = f"tendon equality of '{m.tendon(first).name}'"
            terms = _tendon_terms(m, first), _tendon_terms(m, second)
        else:
            continue
        involved = {*terms[0], *terms[1]}
        if not involved & set(skeleton.joint_of_model):
            continue
        relation = _linear(compiled, reason, terms, coefficients, held)
        if relation is not None:
            found.append(relation)
    return found


def _tendon_terms(model: object, tendon: int) -> dict[int, float]:
    return {} if tendon < 0 else dict(fixed_tendon(model, tendon))


def _linear(
    compiled: CompiledModel,
    reason: str,
    terms: tuple[dict[int, float], dict[int, float]],
    coefficients: np.ndarray,
    held: dict[int, float],
) -> Relation | None:
    """Turn `L1 - L1_0 = a0 + a1 (L2 - L2_0)` into a relation of two joints, or a held joint."""
    m = compiled.model
    if np.abs(coefficients[2:]).max() > _NONLINEAR and terms[1]:
        raise HandError(
            f"{compiled.label}: the {reason} is not linear (polycoef {coefficients.tolist()}); "
            "clench couples joints by ratio and offset."
        )
    weights = dict(terms[0])
    for j, c in terms[1].items():
        weights[j] = weights.get(j, 0.0) - float(coefficients[1]) * c
    weights = {j: c for j, c in weights.items() if abs(c) > 0.0}
    constant = float(coefficients[0]) + sum(c * float(m.qpos0[m.jnt_qposadr[j]]) for j, c in weights.items())
    if len(weights) == 1:
        (joint, weight) = next(iter(weights.items()))
        held[joint] = constant / weight
        return None
    if len(weights) != 2:
        joints = ", ".join(f"'{compiled.joint_name(j)}'" for j in weights)
        raise HandError(f"{compiled.label}: the {reason} ties {len(weights)} joints ({joints}); clench couples two.")
    follower = next(iter(terms[0]))
    leader = next(j for j in weights if j != follower)
    if len(terms[0]) == 2:
        leader, follower = sorted(weights)
    ratio = -weights[leader] / weights[follower]
    return Relation(leader, follower, ratio, constant / weights[follower], reason)


def _driven_tendons(compiled: CompiledModel, skeleton: Skeleton, relations: list[Relation]) -> list[Relation]:
    """Couple the joints of a fixed tendon that has an actuator while the joints have none."""
    import mujoco

    m = compiled.model
    joint_kind, tendon_kind = mujoco.mjtTrn.mjTRN_JOINT, mujoco.mjtTrn.mjTRN_TENDON
    driven = {int(m.actuator_trnid[a, 0]) for a in range(m.nu) if m.actuator_trntype[a] == joint_kind}
    tied = {r.follower for r in relations}
    found: list[Relation] = []
    for a in range(m.nu):
        if m.actuator_trntype[a] != tendon_kind:
            continue
        tendon = int(m.actuator_trnid[a, 0])
        terms = [(j, c) for j, c in fixed_tendon(m, tendon) if j in skeleton.joint_of_model and j not in driven | tied]
        terms = sorted((j, c) for j, c in terms if abs(c) > 0.0)
        name = str(m.tendon(tendon).name) or f"tendon {tendon}"
        for j, c in terms[1:]:
            reason = f"tendon '{name}' with one actuator; shares in proportion to its moment arms are assumed"
            found.append(Relation(terms[0][0], j, c / terms[0][1], 0.0, reason))
            tied.add(j)
    return found
