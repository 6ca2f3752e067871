"""The patent's conditions hold for every side contact on smooth objects (docs/method.md section 3)."""

import numpy as np
import pytest

import clench
from chain_hands import HandBuilder, along_x, mount, turned
from clench.core.pose import Pose
from clench.models.mesh import TriangleMesh
from clench.models.shapes import Shape, ShapeKind

THICK = 0.006
LENGTHS = (0.045, 0.03, 0.024)
AROUND = 96


def finger():
    return HandBuilder().finger("index", [along_x(THICK, n) for n in LENGTHS], LENGTHS, upper=2.5).hand()


def tapered():
    """Return a finger whose links narrow towards the tip: their sides slope by 0.06 rad."""
    links = []
    for length in LENGTHS:
        rows = [
            (x, y, z)
            for x, z in ((0.0, 0.006), (length, 0.006 - 0.06 * length))
            for y in (-0.005, 0.005)
            for z in (-z, z)
        ]
        import trimesh

        hull = trimesh.convex.convex_hull(np.array(rows))
        links.append(Shape(ShapeKind.MESH, mesh=TriangleMesh(hull.vertices, hull.faces)))
    return HandBuilder().finger("index", links, LENGTHS, upper=2.5).hand()


def smooth(kind):
    """Return a fine mesh and the largest angle between neighbouring facets [rad]."""
    import trimesh

    if kind == "ball":
        mesh = trimesh.creation.uv_sphere(radius=0.022, count=[AROUND // 2, AROUND])
    elif kind == "egg":
        mesh = trimesh.creation.uv_sphere(radius=1.0, count=[AROUND // 2, AROUND])
        mesh.apply_scale([0.03, 0.02, 0.024])
    else:
        mesh = trimesh.creation.torus(0.03, 0.012, major_sections=AROUND, minor_sections=AROUND // 2)
    return mesh, float(mesh.face_adjacency_angles.max())


def apart(a, b):
    """Return how far two angles are apart, whole turns left out [rad]."""
    return abs(np.angle(np.exp(1j * (a - b))))


def tangent(angle):
    return np.array([np.cos(angle), 0.0, np.sin(angle)])


@pytest.mark.parametrize("make", [finger, tapered])
@pytest.mark.parametrize("kind", ["ball", "egg", "ring"])
def test_conditions_of_side_contacts(make, kind):
    hand = make()
    mesh, facet = smooth(kind)
    rng = np.random.default_rng(5)
    seen = 0
    for _ in range(12):
        place = mount(
            [rng.uniform(0.03, 0.06), rng.uniform(-0.006, 0.006), rng.uniform(0.045, 0.05)],
            turned([0.6, 0.0, 0.8], rng.uniform(0, 3)),
        )
        obj = clench.GraspObject.from_meshes([(mesh.vertices, mesh.faces)], pose=Pose.from_matrix(place))
        solution = clench.solve(hand, obj, clench.GraspCommand(hand_pose=Pose.identity(), preshape="open"))
        for candidate in solution.fingers["index"].candidates:
            for contact in candidate.contacts:
                if contact.kind == "side" and not contact.passed and candidate.status == "touch":
                    seen += check(hand, candidate, contact, facet, slope=0.06 if make is tapered else 0.0)
    assert seen > 40


def check(hand, candidate, contact, facet, slope):
    """Check one contact; contacts of a link that later joints move as well are not counted."""
    link = int(contact.link[-1])
    if contact.stops_joint != f"index_{link}":
        return 0
    q = np.array(list(candidate.joint_angles.values()))
    total = float(q[: link + 1].sum())
    pivot = sum((LENGTHS[i] * tangent(q[: i + 1].sum()) for i in range(link)), np.zeros(3))
    # The end face of a box-like link is a side too: it looks along the link.
    slopes = [-np.arctan(slope), -np.pi / 2] if slope else [0.0]
    assert min(apart(contact.link_angle, total + s) for s in slopes) < 1e-9
    # A plane that cuts the surface at a slant sees its facets meet at larger angles.
    seen = facet / np.hypot(contact.normal[0], contact.normal[2])
    assert apart(contact.curve_angle, contact.link_angle) <= 1.1 * seen
    # The surface's own normal, seen in the plane, is that of the curve up to a facet.
    assert apart(np.arctan2(contact.normal[0], -contact.normal[2]), contact.link_angle) <= 1.1 * seen
    away = contact.position - pivot
    along, up = tangent(total), np.array([-np.sin(total), 0.0, np.cos(total)])
    assert -1e-9 <= away @ along <= LENGTHS[link] + 1e-9
    if slope == 0.0:
        offset = contact.offset
        assert away @ up == pytest.approx(np.sqrt(THICK**2 - offset**2), abs=1e-7)
    assert contact.position[1] == pytest.approx(contact.offset, abs=1e-12)
    return 1


def test_tips_and_corners_meet_the_weaker_form():
    """The object's normal lies in the normal cone of the touching corner: against both sides next to it."""
    link = Shape(ShapeKind.BOX, (0.03, 0.01, 0.008), Pose([0.03, 0.0, 0.0]))
    # A second joint at the tip makes the axis group's x axis run along the link.
    hand = HandBuilder().finger("index", [link, None], [0.06, 0.0]).hand()
    mesh, _ = smooth("ball")
    seen = 0
    for height in np.linspace(0.055, 0.07, 6):
        obj = clench.GraspObject.from_meshes([(mesh.vertices, mesh.faces)], pose=Pose([0.035, 0.0, height]))
        solution = clench.solve(hand, obj, clench.GraspCommand(hand_pose=Pose.identity(), planes=3, preshape="open"))
        turn = solution.joint_angles["index_0"]
        for contact in (c for c in solution.contacts if c.kind == "edge"):
            inward = np.array([-np.sin(contact.curve_angle), 0.0, np.cos(contact.curve_angle)])
            assert inward @ tangent(turn) >= -1e-9
            assert inward @ np.array([-np.sin(turn), 0.0, np.cos(turn)]) >= -1e-9
            seen += 1
    assert seen >= 3
