"""Couplings of every kind become leader, follower, ratio and offset."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clench.core.exceptions import HandError
from clench.models.hand.hand import Hand
from clench.models.hand.understanding.coupling import Relation, flatten
from models.hand.hand_models import finger, hand, three_fingers, urdf_hand, written


def coupling(loaded: Hand, follower: str) -> tuple[str, float, float]:
    index = loaded.joint_index(follower)
    found = next(c for c in loaded.couplings if c.follower == index)
    return loaded.joints[found.leader].name, found.ratio, found.offset


def test_urdf_mimic(tmp_path) -> None:
    loaded = Hand.load(written(tmp_path, urdf_hand(), "two.urdf"))
    assert coupling(loaded, "a2") == ("a1", pytest.approx(0.8), pytest.approx(0.1))
    assert len(loaded.couplings) == 1


def test_joint_equality_accounts_for_references(tmp_path) -> None:
    text = hand(
        finger("a", attributes='ref="0.25"'),
        finger("b", (0.03, 0, 0.05)),
        extra='<equality><joint joint1="a_j1" joint2="a_j0" polycoef="0.1 0.5 0 0 0"/></equality>',
    )
    loaded = Hand.load(written(tmp_path, text))
    leader, ratio, offset = coupling(loaded, "a_j1")
    assert (leader, ratio) == ("a_j0", 0.5)
    import mujoco

    model = mujoco.MjSpec.from_string(loaded.spec_xml).compile()
    data = mujoco.MjData(model)
    data.qpos[:2] = 0.9, ratio * 0.9 + offset
    mujoco.mj_forward(model, data)
    assert abs(data.efc_pos[0]) < 1e-12


def test_tendon_with_one_actuator_couples_by_moment_arms(tmp_path) -> None:
    terms = '<joint joint="index_j0" coef="1"/><joint joint="index_j1" coef="0.5"/>'
    tendon = f'<tendon><fixed name="t">{terms}</fixed></tendon>'
    driven = Hand.load(written(tmp_path, three_fingers(tendon + '<actuator><position tendon="t"/></actuator>')))
    assert coupling(driven, "index_j1") == ("index_j0", 0.5, 0.0)
    assert "'t'" in driven.couplings[0].reason
    assert "assumed" in driven.couplings[0].reason
    passive = Hand.load(written(tmp_path, three_fingers(tendon)))
    assert passive.couplings == ()


def test_tendon_joints_with_their_own_actuators_stay_free(tmp_path) -> None:
    extra = (
        '<tendon><fixed name="t"><joint joint="index_j0" coef="1"/><joint joint="index_j1" coef="1"/></fixed></tendon>'
        '<actuator><position tendon="t"/><position joint="index_j1"/></actuator>'
    )
    assert Hand.load(written(tmp_path, three_fingers(extra))).couplings == ()


def test_tendon_equality(tmp_path) -> None:
    extra = (
        '<tendon><fixed name="one"><joint joint="index_j0" coef="0.02"/></fixed>'
        '<fixed name="two"><joint joint="index_j1" coef="0.01"/></fixed></tendon>'
        '<equality><tendon tendon1="two" tendon2="one" polycoef="0.001 1 0 0 0"/></equality>'
    )
    loaded = Hand.load(written(tmp_path, three_fingers(extra)))
    assert coupling(loaded, "index_j1") == ("index_j0", pytest.approx(2.0), pytest.approx(0.1))


def test_chains_are_flattened_to_their_leader(tmp_path) -> None:
    text = hand(
        finger("a", lengths=(0.04, 0.03, 0.02)),
        finger("b", (0.03, 0, 0.05)),
        extra=(
            '<equality><joint joint1="a_j2" joint2="a_j1" polycoef="0.2 0.5 0 0 0"/>'
            '<joint joint1="a_j1" joint2="a_j0" polycoef="0.1 2 0 0 0"/></equality>'
        ),
    )
    loaded = Hand.load(written(tmp_path, text))
    assert coupling(loaded, "a_j1") == ("a_j0", 2.0, pytest.approx(0.1))
    assert coupling(loaded, "a_j2") == ("a_j0", 1.0, pytest.approx(0.25))


def test_nonlinear_and_contradictory_couplings_are_refused(tmp_path) -> None:
    bent = '<equality><joint joint1="index_j1" joint2="index_j0" polycoef="0 1 0.3 0 0"/></equality>'
    with pytest.raises(HandError, match="joint equality of 'index_j1' is not linear"):
        Hand.load(written(tmp_path, three_fingers(bent)))
    twice = (
        '<equality><joint joint1="index_j1" joint2="index_j0" polycoef="0 1 0 0 0"/>'
        '<joint joint1="index_j1" joint2="index_j0" polycoef="0 2 0 0 0"/></equality>'
    )
    with pytest.raises(HandError, match="'index_j1' is coupled in two ways that contradict"):
        Hand.load(written(tmp_path, three_fingers(twice)))


def test_an_equality_with_no_leader_holds_the_joint(tmp_path) -> None:
    held = '<equality><joint joint1="index_j0" polycoef="0.3 0 0 0 0"/></equality>'
    loaded = Hand.load(written(tmp_path, three_fingers(held)))
    joint = loaded.joints[loaded.joint_index("index_j0")]
    assert joint.lower == joint.upper == joint.open_value == pytest.approx(0.3)
    assert joint.role == "posture"


def test_inactive_equalities_are_ignored(tmp_path) -> None:
    off = '<equality><joint active="false" joint1="index_j1" joint2="index_j0" polycoef="0 1 0 0 0"/></equality>'
    assert Hand.load(written(tmp_path, three_fingers(off))).couplings == ()


@given(
    ratios=st.lists(st.floats(0.1, 3.0) | st.floats(-3.0, -0.1), min_size=1, max_size=6),
    order=st.randoms(use_true_random=False),
    q=st.floats(-2.0, 2.0),
)
def test_flattening_equals_walking_the_chain(ratios: list[float], order, q: float) -> None:
    relations = [Relation(i, i + 1, r, 0.1 * i, "chain") for i, r in enumerate(ratios)]
    angles = [q]
    for r in relations:
        angles.append(r.ratio * angles[-1] + r.offset)
    order.shuffle(relations)
    found = flatten(relations, [f"j{i}" for i in range(len(angles))], "hand")
    assert {c.leader for c in found} == {0}
    for c in found:
        assert c.ratio * q + c.offset == pytest.approx(angles[c.follower], rel=1e-9, abs=1e-9)


def test_open_postures_obey_couplings(tmp_path) -> None:
    loaded = Hand.load(written(tmp_path, urdf_hand(), "two.urdf"))
    q = loaded.open_angles()
    np.testing.assert_allclose(q, [j.open_value for j in loaded.joints], atol=1e-15)
    assert q[loaded.joint_index("a2")] == pytest.approx(0.8 * q[loaded.joint_index("a1")] + 0.1)


def test_a_leader_is_known_through_its_follower(tmp_path) -> None:
    """The middle joint follows both ends, so that one of them follows the other, with the inverse coupling."""
    relations = [Relation(0, 1, 2.0, 0.3, "first"), Relation(2, 1, 0.5, -0.2, "second")]
    for given_order in (relations, relations[::-1]):
        found = {c.follower: c for c in flatten(given_order, ["a", "b", "c"], "hand")}
        assert {c.leader for c in found.values()} == {0}
        assert (found[1].ratio, found[1].offset) == (2.0, 0.3)
        assert (found[2].ratio, found[2].offset) == (pytest.approx(4.0), pytest.approx(1.0))


@pytest.mark.parametrize(("ratio", "offset"), [(1.0, 0.1), (2.0, 0.0)])
def test_couplings_that_differ_in_ratio_or_offset_contradict_each_other(ratio: float, offset: float) -> None:
    relations = [Relation(0, 1, 1.0, 0.0, "first"), Relation(0, 1, ratio, offset, "second")]
    with pytest.raises(HandError, match=r"'b' is coupled in two ways that contradict each other \(second\)"):
        flatten(relations, ["a", "b"], "hand")


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_offsets_and_ratios_beyond_what_can_be_computed_with_are_refused(sign: float) -> None:
    for ratio, offset in ((1.0, 2e6 * sign), (2e6 * sign, 0.0), (5e-7 * sign, 0.0)):
        with pytest.raises(HandError, match="'b' is coupled by a ratio of"):
            flatten([Relation(0, 1, ratio, offset, "given")], ["a", "b"], "hand")
    for ratio, offset in ((sign, 1e6), (1e6 * sign, 0.0), (1e-6 * sign, 0.0), (0.0, sign)):
        (found,) = flatten([Relation(0, 1, ratio, offset, "given")], ["a", "b"], "hand")
        assert (found.ratio, found.offset) == (ratio, offset)
