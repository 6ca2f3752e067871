"""Hands that nobody here wrote load without a hand file, and are understood as an engineer would."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from test_kinematics import assert_same_kinematics

from clench.core.exceptions import HandError
from clench.models.hand.hand import Hand
from clench.models.hand.reading import link_geometry, mesh_files
from clench.models.shapes import CollisionSource

pytestmark = pytest.mark.shared

RIGHT_SHADOW = "hands/shadow_hand_mjcf/right_hand.xml"
ORCA = "hands/orca_v1_mjcf/orcahand_right.mjcf"
LEAP = "hands/leap_hand_urdf/leap_hand_right.urdf"
BARRETT = "hands/barrett_hand_urdf/bhand_model.urdf"
DCLAW = "hands/dclaw_urdf/dclaw_gripper.urdf"
ALLEGRO_URDF = "hands/allegro_urdf/allegro_hand_right.urdf"
ROBONAUT = "hands_reference/robonaut2_left_urdf/r2_left_hand.urdf"

# model: fingers in order (thumb marked *), closing joints a finger, palm, palm normal, degrees of freedom below it
EXPECTED = {
    RIGHT_SHADOW: ("ff mf rf lf th*", [3, 3, 3, 3, 2], "rh_palm", [0, -1, 0], 18),
    "hands/shadow_hand_mjcf/left_hand.xml": ("ff mf rf lf th*", [3, 3, 3, 3, 2], "lh_palm", [0, -1, 0], 18),
    "hands/wonik_allegro_mjcf/right_hand.xml": ("ff mf rf th*", [3, 3, 3, 2], "palm", [1, 0, 0], 16),
    "hands/wonik_allegro_mjcf/left_hand.xml": ("rf mf ff th*", [3, 3, 3, 2], "palm", [1, 0, 0], 16),
    ALLEGRO_URDF: ("index middle ring thumb*", [3, 3, 3, 2], "base_link", [1, 0, 0], 16),
    LEAP: ("index middle ring thumb*", [3, 3, 3, 2], "palm_lower", [0, 0, -1], 16),
    BARRETT: ("finger_1 finger_2 finger_3*", [2, 2, 2], "base_link", [0, 0, 1], 8),
    DCLAW: ("f1 f2 f3", [2, 2, 2], "base_link", [1, 0, 0], 9),
    ORCA: ("thumb* index middle ring pinky", [2] * 5, "right_palm", [0, 1, 0], 16),
    ROBONAUT: ("thumb* index middle ring little", [2, 3, 3, 3, 3], "r2/left_wrist_yaw", [0, 0, 1], 18),
    "graspit/hands/DLR/DLR.urdf": ("c0* c1 c2 c3", [3, 3, 3, 3], "palm", [-1, 0, 0], 12),
    "graspit/hands/Robonaut_13DOF/Robonaut_13DOF.urdf": ("c0* c1 c2 c3 c4", [2, 3, 3, 3, 3], "palm", [0, 0, 1], 13),
}
_LOADED: dict[str, Hand] = {}


def load(shared_data: Path, model: str) -> Hand:
    if model not in _LOADED:
        _LOADED[model] = Hand.load(shared_data / model)
    return _LOADED[model]


def closing(hand: Hand, finger: int) -> list[int]:
    return [j for j in hand.fingers[finger].joints if hand.joints[j].role == "closing"]


@pytest.mark.parametrize("model", EXPECTED)
def test_fingers_roles_and_palm(shared_data: Path, model: str) -> None:
    names, counts, palm, normal, freedom = EXPECTED[model]
    hand = load(shared_data, model)
    assert " ".join(f.name + "*" * f.is_thumb for f in hand.fingers) == names
    assert [len(closing(hand, i)) for i in range(len(hand.fingers))] == counts
    assert hand.links[hand.palm].name == palm
    assert hand.palm_normal @ np.array(normal) > np.cos(np.deg2rad(10.0))
    upstream = sum(j.role == "upstream" for j in hand.joints)
    assert len(hand.joints) - len(hand.couplings) - upstream == freedom


@pytest.mark.parametrize("model", EXPECTED)
def test_kinematics_equal_mujoco(shared_data: Path, model: str) -> None:
    assert_same_kinematics(load(shared_data, model), np.random.default_rng(1))


@pytest.mark.parametrize("model", [m for m in EXPECTED if m.endswith(".urdf")])
def test_kinematics_with_mimic_equal_yourdfpy(shared_data: Path, model: str) -> None:
    import yourdfpy

    hand = load(shared_data, model)
    robot = yourdfpy.URDF.load(
        str(shared_data / model), load_meshes=False, load_collision_meshes=False, build_collision_scene_graph=False
    )
    rng = np.random.default_rng(2)
    q = np.array([rng.uniform(j.lower, j.upper) for j in hand.joints])
    for c in hand.couplings:
        q[c.follower] = c.ratio * q[c.leader] + c.offset
    actuated = [q[hand.joint_index(name)] for name in robot.actuated_joint_names]
    robot.update_cfg(np.array(actuated))
    palm = hand.links[hand.palm].name
    for link, T in zip(hand.links, hand.link_poses(q), strict=True):
        assert np.abs(robot.get_transform(link.name, palm) - T).max() < 1e-12, link.name


@pytest.mark.parametrize("model", EXPECTED)
def test_tips_close_towards_the_palms_side(shared_data: Path, model: str) -> None:
    """Half closed, every finger's tip has moved to the palm's side, or towards the others where fingers oppose."""
    hand = load(shared_data, model)
    q = hand.open_angles()
    start = hand.link_poses(q)
    for j, joint in enumerate(hand.joints):
        if joint.role == "closing":
            q[j] += 0.5 * joint.direction
    end = hand.link_poses(hand.coupled(q))
    middle = np.mean([end[f.tip_link][:3, 3] for f in hand.fingers], axis=0)
    for finger in hand.fingers:
        a, b = (poses[finger.tip_link][:3, 3] for poses in (start, end))
        nearer = np.linalg.norm(b - middle) < np.linalg.norm(a - middle)
        assert (b - a) @ hand.palm_normal > 0 or nearer, finger.name


@pytest.mark.parametrize("model", EXPECTED)
def test_open_values_are_inside_the_limits_and_nearly_straight(shared_data: Path, model: str) -> None:
    hand = load(shared_data, model)
    assert all(j.lower <= j.open_value <= j.upper for j in hand.joints)
    orca_thumb = {"right_thumb_pip": -0.58496, "right_thumb_dip": -0.50477}
    for joint in hand.joints:
        if joint.role == "closing":
            assert joint.open_value == pytest.approx(orca_thumb.get(joint.name, 0.0), abs=1e-9), joint.name
            assert joint.direction_reason
            assert joint.open_reason


def test_shadow_couples_the_two_distal_joints(shared_data: Path) -> None:
    hand = load(shared_data, RIGHT_SHADOW)
    pairs = {(hand.joints[c.leader].name, hand.joints[c.follower].name, c.ratio, c.offset) for c in hand.couplings}
    assert pairs == {(f"rh_{f}J2", f"rh_{f}J1", 1.0, 0.0) for f in ("FF", "MF", "RF", "LF")}
    assert [hand.joints[j].name for j in closing(hand, 4)] == ["rh_THJ2", "rh_THJ1"]
    assert [j.name for j in hand.joints if j.role == "upstream"] == ["rh_WRJ2", "rh_WRJ1"]
    assert hand.joints[hand.joint_index("rh_THJ5")].effort == 3.0


def test_barrett_closes_to_its_lower_limits(shared_data: Path) -> None:
    hand = load(shared_data, BARRETT)
    assert {j.direction for j in hand.joints if j.role == "closing"} == {-1}
    assert [j.name for j in hand.joints if j.role == "posture"] == ["finger_1_prox_joint", "finger_2_prox_joint"]


def test_placeholder_limits_are_said(shared_data: Path) -> None:
    assert any("placeholders" in w for w in load(shared_data, ROBONAUT).warnings)


def test_closed_linkage_is_refused(shared_data: Path) -> None:
    with pytest.raises(HandError, match="'right_follower' and 'right_coupler' close a kinematic loop"):
        Hand.load(shared_data / "hands/robotiq_2f85_mjcf/2f85.xml")


@pytest.mark.parametrize("model", [RIGHT_SHADOW, LEAP, ORCA])
def test_meshes_lie_where_mujoco_puts_them(shared_data: Path, model: str) -> None:
    """A mesh in its link's frame lies where MuJoCo draws it, its re-centring undone."""
    import mujoco

    hand = load(shared_data, model)
    compiled = mujoco.MjSpec.from_string(hand.spec_xml, assets=dict(hand.assets)).compile()
    data = mujoco.MjData(compiled)
    mujoco.mj_kinematics(compiled, data)
    checked = 0
    for link in hand.links:
        body = compiled.body(link.name)
        for shape in link.shapes[CollisionSource.VISUAL]:
            if shape.mesh is None:
                continue
            T = np.eye(4)
            T[:3, :3], T[:3, 3] = data.xmat[body.id].reshape(3, 3), data.xpos[body.id]
            ours = shape.pose.apply(shape.mesh.vertices) @ T[:3, :3].T + T[:3, 3]
            boxes = []
            for g in range(body.geomadr[0], body.geomadr[0] + body.geomnum[0]):
                number = compiled.geom_dataid[g]
                if compiled.geom_type[g] == mujoco.mjtGeom.mjGEOM_MESH:
                    start = compiled.mesh_vertadr[number]
                    vertices = compiled.mesh_vert[start : start + compiled.mesh_vertnum[number]]
                    placed = vertices @ data.geom_xmat[g].reshape(3, 3).T + data.geom_xpos[g]
                    boxes.append(np.array([placed.min(axis=0), placed.max(axis=0)]))
            mine = np.array([ours.min(axis=0), ours.max(axis=0)])
            assert min(np.abs(mine - box).max() for box in boxes) < 1e-9
            checked += 1
    assert checked >= 10


def test_a_quarter_million_triangles_are_read_once_and_their_hulls_are_those_of_the_engine(
    shared_data: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    read: list[Path] = []
    read_file = mesh_files.read_file
    monkeypatch.setattr(mesh_files, "read_file", lambda path, most: read.append(path) or read_file(path, most))
    monkeypatch.setattr(link_geometry, "_computed_hull", lambda raw: pytest.fail("the engine has made this hull"))
    hand = Hand.load(shared_data / LEAP)
    drawn = [s.mesh for link in hand.links for s in link.shapes[CollisionSource.VISUAL] if s.mesh is not None]
    assert sum(len(mesh.triangles) for mesh in drawn) > 250_000
    assert len(read) == len(set(read)) == 10
