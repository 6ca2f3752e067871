"""Forward kinematics of loaded hands equals MuJoCo's, for any tree of hinges."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clench.models.hand.forward import poses_at
from clench.models.hand.hand import Hand, JointRole
from models.hand.hand_models import finger, hand, three_fingers, urdf_hand, written


def assert_same_kinematics(loaded: Hand, rng: np.random.Generator, tolerance: float = 1e-12) -> None:
    """Compare link poses with MuJoCo's at random postures of all joints that the hand knows."""
    import mujoco

    model = mujoco.MjSpec.from_string(loaded.spec_xml, assets=dict(loaded.assets)).compile()
    data = mujoco.MjData(model)
    for _ in range(5):
        q = np.array([rng.uniform(j.lower, j.upper) for j in loaded.joints])
        data.qpos[:] = model.qpos0
        for joint, angle in zip(loaded.joints, q, strict=True):
            data.qpos[model.joint(joint.name).qposadr[0]] = angle
        mujoco.mj_kinematics(model, data)
        poses = loaded.link_poses(q)
        palm = model.body(loaded.links[loaded.palm].name).id
        R, p = data.xmat[palm].reshape(3, 3), data.xpos[palm]
        for link, T in zip(loaded.links, poses, strict=True):
            if "__" in link.name:
                continue
            body = model.body(link.name).id
            assert np.abs(T[:3, :3] - R.T @ data.xmat[body].reshape(3, 3)).max() < tolerance, link.name
            assert np.abs(T[:3, 3] - R.T @ (data.xpos[body] - p)).max() < tolerance, link.name


def numbers(rng: np.random.Generator, n: int, scale: float) -> str:
    return " ".join(repr(float(x)) for x in rng.normal(scale=scale, size=n))


def random_finger(rng: np.random.Generator, name: str) -> str:
    """Return a chain with random frames, anchors, references and one to three hinges a body."""
    text, bodies = "", int(rng.integers(1, 4))
    for k in range(bodies):
        text += f'<body name="{name}{k}" pos="{numbers(rng, 3, 0.05)}" quat="{numbers(rng, 4, 1.0)}">'
        for j in range(int(rng.integers(1, 4))):
            text += (
                f'<joint name="{name}{k}_{j}" axis="{numbers(rng, 3, 1.0)}" pos="{numbers(rng, 3, 0.02)}" '
                f'range="-1.5 1.5" ref="{float(rng.uniform(-0.5, 0.5))!r}"/>'
            )
        text += '<geom type="sphere" size="0.01"/>'
    return text + "</body>" * bodies


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_random_trees_move_as_in_mujoco(seed: int, tmp_path_factory: pytest.TempPathFactory) -> None:
    rng = np.random.default_rng(seed)
    text = hand(random_finger(rng, "a"), random_finger(rng, "b"))
    loaded = Hand.load(written(tmp_path_factory.mktemp("tree"), text))
    assert_same_kinematics(loaded, rng)


def test_a_body_with_two_joints_becomes_two_links(tmp_path) -> None:
    two = (
        '<body name="k" pos="0.02 0 0.05"><joint name="yaw" axis="0 1 0" range="-0.3 0.3"/>'
        '<joint name="pitch" axis="1 0 0" range="0 1.5"/>'
        '<geom type="capsule" size="0.008" fromto="0 0 0 0 0 0.04"/></body>'
    )
    loaded = Hand.load(written(tmp_path, hand(two, finger("other", (-0.02, 0, 0.05)))))
    yaw, pitch = loaded.link_index("k__yaw"), loaded.link_index("k")
    assert loaded.links[pitch].parent == yaw
    assert [loaded.joints[loaded.links[i].joint].name for i in (yaw, pitch)] == ["yaw", "pitch"]
    assert not any(loaded.links[yaw].shapes.values())
    assert all(link.joint == -1 or loaded.joints[link.joint] for link in loaded.links)
    assert loaded.joints[loaded.joint_index("yaw")].role is JointRole.POSTURE


def test_links_come_after_their_parents_and_hold_one_joint_each(tmp_path) -> None:
    loaded = Hand.load(written(tmp_path, three_fingers()))
    assert all(link.parent < i for i, link in enumerate(loaded.links))
    used = [link.joint for link in loaded.links if link.joint >= 0]
    assert sorted(used) == list(range(len(loaded.joints)))


def test_limits_velocity_and_effort_are_read_from_urdf(tmp_path) -> None:
    loaded = Hand.load(written(tmp_path, urdf_hand(), "two.urdf"))
    joint = loaded.joints[loaded.joint_index("b1")]
    assert (joint.lower, joint.upper, joint.velocity, joint.effort) == (-0.2, 1.5, 3.5, 2.5)
    assert_same_kinematics(loaded, np.random.default_rng(0))


@pytest.mark.parametrize(
    ("actuator", "effort"),
    [
        ('<position joint="index_j0" kp="2" forcerange="-3 3"/>', 3.0),
        ('<position joint="index_j0" kp="2" forcerange="-3 3" gear="2"/>', 6.0),
        ('<motor joint="index_j0" ctrlrange="-0.7 0.7"/>', 0.7),
        ('<position joint="index_j0" kp="2"/>', None),
    ],
)
def test_effort_comes_from_the_actuator(tmp_path, actuator: str, effort: float | None) -> None:
    loaded = Hand.load(written(tmp_path, three_fingers(f"<actuator>{actuator}</actuator>")))
    assert loaded.joints[loaded.joint_index("index_j0")].effort == effort


def test_missing_and_placeholder_limits_are_said(tmp_path) -> None:
    text = hand(
        finger("index", (0.02, 0, 0.05), limits=["-4 4", "0 1.6"]),
        finger("middle", (-0.02, 0, 0.05), attributes='limited="false"'),
    )
    loaded = Hand.load(written(tmp_path, text))
    assert any("index_j0" in w and "whole turn" in w for w in loaded.warnings)
    assert any("middle_j0" in w and "no limits" in w for w in loaded.warnings)
    assert not any("index_j1" in w for w in loaded.warnings)
    assert loaded.joints[loaded.joint_index("middle_j0")].upper == pytest.approx(np.pi)


def test_radians_read_as_degrees_are_noticed(tmp_path) -> None:
    text = three_fingers().replace('angle="radian"', 'angle="degree"')
    assert any("radians read as degrees" in w for w in Hand.load(written(tmp_path, text)).warnings)
    assert not any("degrees" in w for w in Hand.load(written(tmp_path, three_fingers())).warnings)


def test_a_prismatic_joint_before_the_palm_is_held(tmp_path) -> None:
    before = '<body name="rail"><joint name="slide" type="slide" range="0 1"/><geom size="0.02"/>'
    loaded = Hand.load(
        written(tmp_path, hand(finger("a"), finger("b", (0.03, 0, 0.05)), before=before, after="</body>"))
    )
    assert "slide" not in loaded.joint_names
    assert any("'slide'" in f.text and "held" in f.text for f in loaded.findings)


def test_some_links_are_where_they_are_among_all():
    loaded, rng = Hand.load("robonaut2"), np.random.default_rng(0)
    postures = rng.uniform(-1.0, 1.0, (5, len(loaded.joints)))
    links = [loaded.fingers[1].links[-1], 0, loaded.fingers[0].links[0]]
    np.testing.assert_array_equal(poses_at(loaded, postures, links), poses_at(loaded, postures)[:, links])
