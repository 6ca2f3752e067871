"""What looks wrong with a hand is found, with code, names and numbers, and the hand loads all the same."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from clench.core.exceptions import FileError
from clench.models.hand.findings import Finding, FindingCode, Severity, in_hand_file
from clench.models.hand.hand import Hand
from models.hand.hand_models import finger, hand, three_fingers, urdf_hand, written

URDF_LIMIT = '<limit lower="-0.2" upper="1.5" effort="2.5" velocity="3.5"/>'


def found(loaded: Hand, code: FindingCode) -> Finding:
    """Return the only finding of a code."""
    (finding,) = [f for f in loaded.findings if f.code is code]
    assert finding.text.endswith(".")
    assert finding.advice
    return finding


def urdf(folder: Path, limit: str, axis: str = "1 0 0") -> Path:
    text = urdf_hand(mimic="").replace(URDF_LIMIT, limit, 1).replace('<axis xyz="1 0 0"/>', f'<axis xyz="{axis}"/>', 1)
    return written(folder, text, "two.urdf")


def mjcf(folder: Path, limit: str) -> Path:
    return written(folder, three_fingers().replace('range="0 1.6"', f'range="{limit}"', 1))


def driven(text: str) -> str:
    """Return MJCF whose joints have effort limits."""
    return text.replace("<joint ", '<joint actuatorfrcrange="-1 1" ')


def test_a_hand_without_faults_has_no_findings(tmp_path) -> None:
    assert Hand.load(written(tmp_path, driven(three_fingers()))).findings == ()


def test_joints_without_effort_limits_are_said_and_can_be_given(tmp_path) -> None:
    path = written(tmp_path, driven(three_fingers()).replace('<joint actuatorfrcrange="-1 1" ', "<joint ", 1))
    finding = found(Hand.load(path), FindingCode.EFFORT_MISSING)
    assert (finding.joints, finding.severity) == (("index_j0",), Severity.NOTE)
    assert in_hand_file("joints", "index_j0", "effort = ") in finding.advice
    given = written(tmp_path, "[joints.index_j0]\neffort = 0.5\n", "given.toml")
    assert Hand.load(path, hand_file=given).findings == ()
    pulled = "[tendons]\njoints = ['index_j0']\nmoment_arms = [[0.01, -0.01]]\n"
    endless = written(tmp_path, pulled, "endless.toml")
    assert found(Hand.load(path, hand_file=endless), FindingCode.EFFORT_MISSING).joints == ("index_j0",)
    ending = written(tmp_path, f"{pulled}t_max = 90.0\n", "ending.toml")
    assert Hand.load(path, hand_file=ending).findings == ()


def test_a_given_effort_replaces_a_placeholder(tmp_path) -> None:
    path = written(tmp_path, driven(three_fingers()).replace("-1 1", "-1e9 1e9", 1))
    assert found(Hand.load(path), FindingCode.EFFORT_PLACEHOLDER).joints == ("index_j0",)
    given = written(tmp_path, "[joints.index_j0]\neffort = 0.5\n", "given.toml")
    assert Hand.load(path, hand_file=given).findings == ()


@pytest.mark.parametrize("name", ["robonaut2", "patent15"])
def test_builtin_hands_have_no_findings(name: str) -> None:
    assert Hand.load(name).findings == ()


@pytest.mark.parametrize("form", ["urdf", "mjcf"])
def test_reversed_limits_are_swapped_and_said(tmp_path, form: str) -> None:
    low, high = (1.5, -0.2) if form == "urdf" else (1.6, 0.0)
    path = urdf(tmp_path, f'<limit lower="{low}" upper="{high}"/>') if form == "urdf" else mjcf(tmp_path, "1.6 0")
    loaded = Hand.load(path)
    finding = found(loaded, FindingCode.LIMITS_REVERSED)
    joint = loaded.joints[loaded.joint_index(finding.joints[0])]
    assert (joint.lower, joint.upper) == (high, low)
    assert finding.numbers == {"lower_rad": low, "upper_rad": high}
    assert finding.joints == (("a1",) if form == "urdf" else ("index_j0",))
    assert not any(f.code is FindingCode.LIMITS_MISSING for f in loaded.findings)


def test_reversed_limits_in_degrees(tmp_path) -> None:
    text = three_fingers().replace('angle="radian"', 'angle="degree"').replace("0 1.6", "0 90")
    loaded = Hand.load(written(tmp_path, text.replace('range="0 90"', 'range="90 0"', 1)))
    assert found(loaded, FindingCode.LIMITS_REVERSED).numbers["lower_rad"] == pytest.approx(np.pi / 2, abs=1e-12)
    assert [j.upper for j in loaded.joints] == pytest.approx([np.pi / 2] * 6, abs=1e-12)


@pytest.mark.parametrize(
    ("form", "angle"), [("urdf", 0.0), ("urdf", 0.3), ("mjcf", 0.3)], ids=["urdf at 0", "urdf", "mjcf"]
)
def test_limits_of_no_width_hold_the_joint(tmp_path, capfd, form: str, angle: float) -> None:
    limit = f'<limit lower="{angle}" upper="{angle}"/>'
    loaded = Hand.load(urdf(tmp_path, limit) if form == "urdf" else mjcf(tmp_path, f"{angle} {angle}"))
    finding = found(loaded, FindingCode.LIMITS_ZERO_WIDTH)
    joint = loaded.joints[loaded.joint_index(finding.joints[0])]
    assert joint.lower == joint.upper == joint.open_value == finding.numbers["angle_rad"] == angle
    assert "no motion" in joint.role_reason or joint.role == "closing"
    assert capfd.readouterr().out == ""


@pytest.mark.parametrize("limit", ["", '<limit effort="1" velocity="1"/>'], ids=["no element", "no angles"])
def test_missing_limits(tmp_path, limit: str) -> None:
    loaded = Hand.load(urdf(tmp_path, limit))
    assert found(loaded, FindingCode.LIMITS_MISSING).joints == ("a1",)
    joint = loaded.joints[loaded.joint_index("a1")]
    assert (joint.lower, joint.upper) == (-np.pi, np.pi)
    assert "under [joints.a1]: limits = [lower, upper]" in found(loaded, FindingCode.LIMITS_MISSING).advice


def test_limits_from_the_hand_file_settle_the_finding(tmp_path) -> None:
    path = urdf(tmp_path, "")
    hand_file = tmp_path / "my.toml"
    hand_file.write_text("[joints.a1]\nlimits = [-0.1, 1.2]\n")
    loaded = Hand.load(path, hand_file=hand_file)
    joint = loaded.joints[loaded.joint_index("a1")]
    assert (joint.lower, joint.upper) == (-0.1, 1.2)
    assert not any(f.code is FindingCode.LIMITS_MISSING for f in loaded.findings)


@pytest.mark.parametrize("value", ["[1.0, 0.0]", "[1.0]", "1.0", '["a", "b"]', "[0.0, inf]"])
def test_bad_limits_in_the_hand_file(tmp_path, value: str) -> None:
    hand_file = tmp_path / "my.toml"
    hand_file.write_text(f"[joints.a1]\nlimits = {value}\n")
    with pytest.raises(FileError, match=r"joints\.a1\.limits: expected two angles, the lower one first"):
        Hand.load(urdf(tmp_path, URDF_LIMIT), hand_file=hand_file)


def test_an_axis_that_is_not_unit(tmp_path) -> None:
    loaded = Hand.load(urdf(tmp_path, URDF_LIMIT, axis="3 0 4"))
    finding = found(loaded, FindingCode.AXIS_NOT_UNIT)
    assert (finding.joints, finding.numbers) == (("a1",), {"length": 5.0})
    assert loaded.joints[loaded.joint_index("a1")].axis == pytest.approx([0.6, 0.0, 0.8], abs=1e-15)


@pytest.mark.parametrize("axis", ["0 0 0", "1 0", "x y z", "nan 0 0"])
def test_an_axis_that_is_none(tmp_path, axis: str) -> None:
    with pytest.raises(FileError, match=f"joint 'a1': axis '{axis}'; expected a direction"):
        Hand.load(urdf(tmp_path, URDF_LIMIT, axis=axis))


def test_limits_that_are_no_numbers(tmp_path) -> None:
    with pytest.raises(FileError, match="joint 'a1': upper limit 'high'; expected a finite number"):
        Hand.load(urdf(tmp_path, '<limit lower="0" upper="high"/>'))


def test_a_joint_type_that_does_not_exist(tmp_path) -> None:
    text = urdf_hand().replace('type="revolute"', 'type="hinge"', 1)
    with pytest.raises(FileError, match="joint 'a1' has type 'hinge'; expected revolute, continuous"):
        Hand.load(written(tmp_path, text, "two.urdf"))


@pytest.mark.parametrize(("tilt", "count"), [(1e-10, 0), (1e-8, 2), (1e-5, 2), (0.01, 2), (0.5, 0)])
def test_axes_that_are_almost_parallel_split_the_planes(tmp_path, tilt: float, count: int) -> None:
    from clench.closing.finger_plan import plan_finger

    fingers = [
        finger(name, (x, 0, 0.05), axes=["1 0 0", f"1 0 {tilt}"]) for name, x in (("index", 0.02), ("ring", -0.02))
    ]
    loaded = Hand.load(written(tmp_path, hand(*fingers)))
    findings = [f for f in loaded.findings if f.code is FindingCode.AXES_ALMOST_PARALLEL]
    assert len(findings) == count
    for finding in findings:
        assert finding.severity is Severity.NOTE
        assert finding.numbers["angle_deg"] == pytest.approx(np.rad2deg(np.arctan(tilt)), rel=1e-6)
    axis_groups = plan_finger(loaded, loaded.fingers[0], loaded.open_angles(), 3, loaded.default_source).axis_groups
    closing = [j for j in loaded.fingers[0].joints if loaded.joints[j].role == "closing"]
    assert len(axis_groups) == (2 if count else 1 if tilt < 0.1 else len(closing))


def test_a_whole_model_in_millimetres(tmp_path) -> None:
    fingers = [finger(n, (x, 0, 50.0), lengths=(50.0, 30.0)) for n, x in (("index", 20.0), ("ring", -20.0))]
    loaded = Hand.load(written(tmp_path, hand(*fingers)))
    assert found(loaded, FindingCode.LENGTHS_TOO_LARGE).numbers["joint_distance_m"] == pytest.approx(50.0)


def test_one_mesh_in_millimetres(tmp_path) -> None:
    import trimesh

    trimesh.creation.box((20.0, 20.0, 50.0)).export(tmp_path / "tip.stl")
    text = urdf_hand(geometry='<mesh filename="tip.stl"/>')
    finding = found(Hand.load(written(tmp_path, text, "two.urdf")), FindingCode.LENGTHS_TOO_LARGE)
    assert finding.links == ("b_2",)
    assert finding.numbers["size_m"] == pytest.approx(50.0)
    assert 'scale="0.001 0.001 0.001"' in finding.advice
    scaled = urdf_hand(geometry='<mesh filename="tip.stl" scale="0.001 0.001 0.001"/>')
    assert Hand.load(written(tmp_path, scaled, "two.urdf")).findings == ()


def test_a_hand_scaled_down_twice(tmp_path) -> None:
    text = three_fingers()
    for a in ("0.02", "0.04", "0.05", "0.03", "0.008", "0.046", "0.026", "0.01"):
        text = text.replace(a, f"{float(a) / 1000:.9f}")
    loaded = Hand.load(written(tmp_path, text))
    assert found(loaded, FindingCode.LENGTHS_TOO_SMALL).numbers["longest_link_m"] < 1e-3


def test_a_joint_that_moves_nothing_with_a_shape(tmp_path) -> None:
    bare = '<body name="nail" pos="0 0 0.03"><joint name="nail_joint" axis="1 0 0" range="0 1"/></body></body></body>'
    long = finger("index", (0.02, 0, 0.05)).replace("</body></body>", bare)
    loaded = Hand.load(written(tmp_path, hand(long, finger("ring", (-0.02, 0, 0.05)))))
    finding = found(loaded, FindingCode.NO_SHAPE)
    assert finding.joints == ("nail_joint",)
    assert 'under [fingers.index]: joints = ["index_j0", "index_j1"]' in finding.advice


def test_three_fingers_alike_have_no_thumb(tmp_path) -> None:
    fingers = [finger(f"f{k}", (0.02 * k, 0, 0.05)) for k in range(3)]
    loaded = Hand.load(written(tmp_path, hand(*fingers)))
    assert found(loaded, FindingCode.NO_THUMB).severity is Severity.NOTE
    assert loaded.warnings == ()


def test_directions_that_only_the_fingertips_tell_are_noted(tmp_path) -> None:
    fingers = [finger(f"f{k}", (0.0, y, 0.05), limits=["-1 1"] * 2) for k, y in enumerate((-0.06, 0.06))]
    loaded = Hand.load(written(tmp_path, hand(*fingers)))
    finding = found(loaded, FindingCode.DIRECTION_UNCERTAIN)
    assert finding.severity is Severity.NOTE
    assert finding.joints == ("f0_j0", "f0_j1", "f1_j0", "f1_j1")
    assert "under [joints.f0_j0]: direction = 1" in finding.advice


def test_names_that_need_quotes_in_the_hand_file() -> None:
    assert in_hand_file("joints", "r2/left", "open = 0") == 'under [joints."r2/left"]: open = 0'
    assert in_hand_file("joints", "rh_FFJ1", "open = 0") == "under [joints.rh_FFJ1]: open = 0"


def test_links_that_are_only_drawn_close_like_those_that_collide(tmp_path) -> None:
    """The shapes that are drawn take the place of missing collision shapes, in the solve as in the report."""
    import clench
    from clench.core.pose import Pose

    text = urdf_hand(mimic="")
    drawn = text.replace("<collision>", "<visual>").replace("</collision>", "</visual>")
    loaded = [Hand.load(written(tmp_path, t, f"{k}.urdf")) for k, t in enumerate((text, drawn))]
    assert found(loaded[1], FindingCode.COLLISION_FROM_VISUALS).links == ("palm", "a_1", "a_2", "b_1", "b_2")
    ball = clench.GraspObject.load("sphere:r=0.02", pose=Pose([0.0, -0.03, 0.09]))
    command = clench.GraspCommand(hand_pose=Pose.identity(), planes=3)
    first, second = (clench.solve(h, ball, command) for h in loaded)
    assert first.contacts
    assert first.joint_angles == pytest.approx(second.joint_angles, abs=1e-5)
    assert first.status == second.status


def test_of_limits_that_are_too_wide_the_widest_is_told(tmp_path) -> None:
    text = hand(finger("a", limits=["-4 4", "-5 6"]), finger("b", (0.03, 0, 0.05)))
    finding = found(Hand.load(written(tmp_path, text)), FindingCode.LIMITS_TOO_WIDE)
    assert finding.joints == ("a_j0", "a_j1")
    assert finding.numbers == {"widest_rad": pytest.approx(11.0)}


def test_a_whole_turn_is_no_placeholder(tmp_path) -> None:
    text = urdf(tmp_path, f'<limit lower="{-np.pi}" upper="{np.pi}"/>')
    assert not [f for f in Hand.load(text).findings if f.code is FindingCode.LIMITS_TOO_WIDE]


def test_of_efforts_that_are_placeholders_the_largest_is_told(tmp_path) -> None:
    text = urdf_hand(mimic="")
    for effort in ("2e4", "5e3", "1000"):
        text = text.replace('effort="2.5"', f'effort="{effort}"', 1)
    finding = found(Hand.load(written(tmp_path, text, "two.urdf")), FindingCode.EFFORT_PLACEHOLDER)
    assert finding.joints == ("a1", "a2")
    assert finding.numbers == {"largest_Nm": 2e4}


def test_limits_in_radians_that_are_read_as_degrees_are_told_by_the_widest_joint(tmp_path) -> None:
    narrow = three_fingers().replace('angle="radian"', 'angle="degree"')
    finding = found(Hand.load(written(tmp_path, narrow.replace("0 1.6", "0 1", 1))), FindingCode.LIMITS_TOO_NARROW)
    assert finding.numbers == {"widest_rad": pytest.approx(np.deg2rad(1.6))}
    one_wide = narrow.replace("0 1.6", "0 90", 1)
    codes = [f.code for f in Hand.load(written(tmp_path, one_wide, "wide.xml")).findings]
    assert FindingCode.LIMITS_TOO_NARROW not in codes
