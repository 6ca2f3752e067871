"""The built-in hands as MuJoCo reads them: freedom, axes, overlaps, opposition, and the published kinematics."""

from importlib import resources
from pathlib import Path

import numpy as np
import pytest

BUILTIN = Path(str(resources.files("clench.models.hand") / "builtin"))
FINGERS = ("thumb", "index", "middle", "ring", "little")
REFERENCE = Path(__file__).parents[3].parent / "shared/data/hands_reference/robonaut2_left_urdf/r2_left_hand.urdf"


def compiled(name, ball=None):
    import mujoco

    spec = mujoco.MjSpec.from_file(str(BUILTIN / f"{name}.xml"))
    if ball is not None:
        spec.worldbody.add_geom(
            name="ball", type=mujoco.mjtGeom.mjGEOM_SPHERE, pos=ball[:3], size=[ball[3], 0, 0], contype=0, conaffinity=0
        )
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


def followers(model):
    return {int(model.eq_obj1id[i]): (int(model.eq_obj2id[i]), model.eq_data[i, :2]) for i in range(model.neq)}


def couple(model, q):
    for follower, (leader, (offset, ratio)) in followers(model).items():
        q[follower] = np.clip(offset + ratio * q[leader], *model.jnt_range[follower])


@pytest.mark.parametrize(("name", "freedom", "joints"), [("robonaut2", 12, 18), ("patent15", 15, 15)])
def test_degrees_of_freedom_and_actuators(name, freedom, joints):
    model, _ = compiled(name)
    assert model.njnt == joints
    assert model.njnt - model.neq == freedom == model.nu
    driven = {int(j) for j in model.actuator_trnid[:, 0]}
    assert driven.isdisjoint(followers(model))
    assert len(driven) == freedom
    assert (model.actuator_forcerange[:, 1] > 0).all()
    assert (model.actuator_forcerange[:, 0] == -model.actuator_forcerange[:, 1]).all()
    np.testing.assert_allclose(model.actuator_ctrlrange, model.jnt_range[model.actuator_trnid[:, 0]], rtol=1e-12)


def test_robonaut_has_the_published_arrangement():
    model, _ = compiled("robonaut2")
    leaders = [model.joint(j).name for j in range(model.njnt) if j not in followers(model)]
    count = {finger: sum(name.startswith(finger + "_") for name in leaders) for finger in FINGERS}
    assert count == {"thumb": 4, "index": 3, "middle": 3, "ring": 1, "little": 1}


@pytest.mark.parametrize("name", ["robonaut2", "patent15"])
def test_last_axes_are_exactly_parallel_and_close_from_straight(name):
    model, _ = compiled(name)
    for finger in FINGERS:
        joints = [j for j in range(model.njnt) if model.joint(j).name.startswith(finger + "_")]
        last = joints[-2:] if finger == "thumb" and name == "robonaut2" else joints[-3:]
        assert all(model.jnt_range[j, 0] == 0 < model.jnt_range[j, 1] for j in last)
        assert all((model.jnt_axis[j] == model.jnt_axis[last[0]]).all() for j in last)
        for j in last[1:]:
            assert (model.body_quat[model.jnt_bodyid[j]] == [1, 0, 0, 0]).all()


@pytest.mark.parametrize("name", ["robonaut2", "patent15"])
def test_open_hand_overlaps_only_between_adjacent_links(name):
    model, data = compiled(name)
    for contact in data.contact:
        first, second = (int(model.geom_bodyid[g]) for g in (contact.geom1, contact.geom2))
        adjacent = second in (first, int(model.body_parentid[first])) or first == int(model.body_parentid[second])
        assert adjacent, (model.geom(contact.geom1).name, model.geom(contact.geom2).name, contact.dist)


@pytest.mark.parametrize(
    ("name", "ball", "opposing"),
    [
        ("robonaut2", (0.085, 0.005, 0.036, 0.035), ("index", "middle")),
        ("patent15", (0.055, 0, 0.05, 0.035), FINGERS[1:]),
    ],
)
def test_closing_wraps_a_ball_with_the_thumb_opposed(name, ball, opposing):
    """Step every closing joint until its finger is about to enter the ball: all reach it, the thumb from across."""
    import mujoco

    model, data = compiled(name, ball)
    sphere = model.geom("ball").id

    def nearest(finger):
        mujoco.mj_kinematics(model, data)
        ends = np.zeros(6)
        best, point = np.inf, None
        for g in range(model.ngeom):
            if model.body(model.geom_bodyid[g]).name.startswith(finger + "_"):
                distance = mujoco.mj_geomDistance(model, data, g, sphere, 1.0, ends)
                if distance < best:
                    best, point = distance, ends[3:].copy()
        return best, (point - ball[:3]) / np.linalg.norm(point - ball[:3])

    directions = {}
    for finger in FINGERS:
        assert nearest(finger)[0] > 0.002
        for j in range(model.njnt):
            if not model.joint(j).name.startswith(finger + "_") or model.jnt_range[j, 0] < 0 or j in followers(model):
                continue
            while data.qpos[j] < model.jnt_range[j, 1]:
                before = data.qpos.copy()
                data.qpos[j] = min(data.qpos[j] + 0.02, model.jnt_range[j, 1])
                couple(model, data.qpos)
                if nearest(finger)[0] < 0:
                    data.qpos[:] = before
                    break
        gap, directions[finger] = nearest(finger)
        assert gap < 0.002, finger
    facing = np.mean([directions[finger] for finger in opposing], axis=0)
    assert directions["thumb"] @ facing / np.linalg.norm(facing) < -0.3


@pytest.mark.parametrize("name", ["robonaut2", "patent15"])
def test_actuators_reach_and_hold_a_fist_without_blowing_up(name):
    import mujoco

    model, data = compiled(name)
    model.opt.gravity[:] = 0
    closing = model.jnt_range[model.actuator_trnid[:, 0], 0] == 0
    data.ctrl[closing] = 0.6
    for _ in range(1500):
        mujoco.mj_step(model, data)
    reached = data.qpos[model.actuator_trnid[:, 0]]
    np.testing.assert_allclose(reached, data.ctrl, atol=0.02)
    expected = data.qpos.copy()
    couple(model, expected)
    np.testing.assert_allclose(data.qpos, expected, atol=0.02)


@pytest.mark.shared
@pytest.mark.skipif(not REFERENCE.exists(), reason="needs ../shared/data/hands_reference")
def test_robonaut_agrees_with_the_public_kinematics():
    """Compare anchors and axes with the public description, at angles shifted by our zeros of the thumb."""
    import xml.etree.ElementTree as ElementTree

    import mujoco

    tree = ElementTree.parse(REFERENCE)
    for node in tree.iter("link"):
        for tag in ("visual", "collision"):
            for part in node.findall(tag):
                node.remove(part)
    root = tree.getroot()
    extension = ElementTree.SubElement(root, "mujoco")
    ElementTree.SubElement(extension, "compiler", balanceinertia="true", fusestatic="false", boundmass="1e-3")
    theirs = mujoco.MjModel.from_xml_string(ElementTree.tostring(root, encoding="unicode"))
    ours, data = compiled("robonaut2")
    their_data = mujoco.MjData(theirs)

    thumb = {
        "thumb_roll": ("thumb/roll", -1, -1.308997),
        "thumb_proximal": ("thumb/proximal", 1, -0.122173),
        "thumb_medial": ("thumb/medial", 1, 0.0),
        "thumb_distal": ("thumb/distal", 1, 0.0),
    }
    names = {
        f"{f}_{j}": (f"{f}/{j}", 1, 0.0) for f in ("index", "middle") for j in ("yaw", "proximal", "medial", "distal")
    }
    for finger in ("ring", "little"):
        for ours_name, suffix in (("proximal", ""), ("medial", "Medial"), ("distal", "Distal")):
            names[f"{finger}_{ours_name}"] = (f"ringlittle/{finger}{suffix}", 1, 0.0)
    rng = np.random.default_rng(3)
    for name, (their_name, sign, offset) in (names | thumb).items():
        angle = rng.uniform(*ours.joint(name).range)
        data.qpos[ours.joint(name).qposadr] = angle
        their_data.qpos[theirs.joint(f"r2/left_arm/hand/{their_name}").qposadr] = sign * angle + offset
    mujoco.mj_forward(ours, data)
    mujoco.mj_forward(theirs, their_data)
    for name, (their_name, sign, _) in (names | thumb).items():
        i, k = ours.joint(name).id, theirs.joint(f"r2/left_arm/hand/{their_name}").id
        np.testing.assert_allclose(data.xanchor[i], their_data.xanchor[k], atol=2e-5, err_msg=name)
        np.testing.assert_allclose(data.xaxis[i], sign * their_data.xaxis[k], atol=2e-5, err_msg=name)
