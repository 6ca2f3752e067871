"""What is said of an object: numbers against closed forms, and every field in words."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import clench
from clench.core.pose import Pose
from clench.models.objects import object_report
from clench.models.objects.object_report import describe_object
from clench.models.objects.obstacles import table
from clench.models.tessellation import BOX_CORNERS, BOX_TRIANGLES


def test_a_box() -> None:
    report = describe_object(clench.GraspObject.load("box:x=0.1,y=0.05,z=0.03").with_body(table(-0.015)))
    assert report.size == pytest.approx((0.1, 0.05, 0.03))
    assert report.lower == pytest.approx((-0.05, -0.025, -0.015))
    assert report.volume == pytest.approx(0.1 * 0.05 * 0.03)
    assert report.center_of_mass == pytest.approx((0.0, 0.0, 0.0), abs=1e-12)
    assert report.watertight
    assert [(body.name, body.role) for body in report.bodies] == [
        ("box:x=0.1,y=0.05,z=0.03", "graspable"),
        ("table", "obstacle"),
    ]
    assert report.stable_poses == clench.stable_poses(clench.GraspObject.load("box:x=0.1,y=0.05,z=0.03"))
    rows = dict(report.summary_rows())
    assert rows["size"] == "100 x 50 x 30 mm, from [-0.05, -0.025, -0.015] to [0.05, 0.025, 0.015] m"
    assert rows["volume"] == "150 cm³"
    assert rows["centre of mass"] == "[0, 0, 0] m"
    assert report.pose_rows()[0] == ("30.7 %", "[0, 0, -1]", "15.0", "flat, tips at 59.0°")


def test_a_cylinder_rolls() -> None:
    rows = describe_object(clench.GraspObject.load("cylinder:r=0.03,h=0.1")).pose_rows()
    assert rows[0][-1].startswith("rolls, ")
    assert rows[0][-1].endswith(" facets in 180°")


def test_an_open_mesh_is_named_so_and_its_hull_counts() -> None:
    obj = clench.GraspObject.from_meshes([(BOX_CORNERS * 0.02, BOX_TRIANGLES[:-2], Pose(), "graspable", "crate")])
    report = describe_object(obj)
    assert not report.watertight
    assert dict(report.summary_rows())["volume"] == "64 cm³ (of the convex hull: the mesh is not watertight)"
    assert dict(report.summary_rows())["graspable"] == "crate: mesh, 10 triangles in all"
    assert report.warnings == obj.warnings != ()


def test_a_flat_object_has_a_reason_instead_of_poses() -> None:
    sheet = clench.GraspObject.from_meshes([([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0]], [[0, 1, 2]])], name="sheet")
    report = describe_object(sheet)
    assert report.stable_poses == ()
    assert report.no_stable_pose is not None
    assert "the object is flat" in report.no_stable_pose
    with pytest.raises(clench.ObjectError, match="the object is flat"):
        describe_object(sheet, [0.01, 0.01, 0.0])


def test_a_given_center_of_mass_is_told_and_used() -> None:
    box = clench.GraspObject.load("box:x=0.04,y=0.04,z=0.2")
    report = describe_object(box, np.array([0.0, 0.0, -0.09]))
    assert report.center_of_mass == (0.0, 0.0, -0.09)
    assert report.stable_poses == clench.stable_poses(box, center_of_mass=[0.0, 0.0, -0.09])
    with pytest.raises(clench.ObjectError, match="center_of_mass"):
        describe_object(box, [1.0, 0.0, 0.0])


def test_the_document_holds_plain_values() -> None:
    document = describe_object(clench.GraspObject.load("mug")).to_dict()
    assert document["schema"] == "clench.object/1"
    first = document["stable_poses"][0]
    assert set(first) == {
        *("pose", "probability", "margin", "center_height", "facets", "spread", "table_height", "tip_angle"),
    }
    assert clench.Pose.from_dict(first["pose"]) == clench.stable_poses(clench.GraspObject.load("mug"))[0].pose
    assert first["tip_angle"] == pytest.approx(math.atan2(first["margin"], first["center_height"]))


@pytest.mark.parametrize(
    ("probability", "share"), [(0.305, "30.5 %"), (0.001, "0.1 %"), (0.0009, "below 0.1 %"), (1e-9, "below 0.1 %")]
)
def test_a_rare_pose_has_no_share_of_nothing(probability: float, share: str) -> None:
    stable = clench.stable_poses(clench.GraspObject.load("ball"))[0]
    assert object_report._pose_row(replace(stable, probability=probability))[0] == share
