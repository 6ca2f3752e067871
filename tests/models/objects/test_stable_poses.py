"""Stable poses: closed forms, properties, drops in MuJoCo, and trimesh's poses with their probabilities."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import clench
from clench.core.pose import Pose
from clench.models.mesh import TriangleMesh
from clench.models.objects import stable_poses as module
from clench.models.objects.grasp_object import BodyRole, GraspObject
from clench.models.objects.hull_facets import hull_facets
from clench.models.objects.mass import mass_properties
from clench.models.objects.obstacles import obstacle, table
from clench.models.objects.stable_poses import StablePose, graspable_points, stable_poses
from clench.models.tessellation import BOX_CORNERS, BOX_TRIANGLES, circle, convex_hull, revolve

#: Directions this near are one [rad]; trimesh rounds normals to three digits.
NEAR = 2e-3
#: Objects of every kind: boxes, round, thin, concave, scanned.
SCANNED = (
    *("ycb_banana/textured.obj", "ycb_cracker_box/textured.obj", "ycb_mug/textured.obj"),
    *("ycb_power_drill/textured.obj", "ycb_scissors/textured.obj", "cdb_cubemedium/cubemedium.stl"),
    *("cdb_cylindermedium/cylindermedium.stl", "cdb_teapot/teapot.stl", "cdb_wineglass/wineglass.stl"),
)


def down(stable: StablePose) -> np.ndarray:
    """Return the direction of the object's frame that points down, shape (3,)."""
    return -stable.pose.rotation[2]


def of_points(points: np.ndarray) -> GraspObject:
    hull = convex_hull(TriangleMesh(points, np.empty((0, 3), dtype=np.int64)))
    return GraspObject.from_meshes([(hull.vertices, hull.triangles)])


def random_solid(seed: int, count: int) -> GraspObject:
    rng = np.random.default_rng(seed)
    return of_points(rng.normal(size=(count, 3)) * rng.uniform(0.02, 0.1, size=3))


def cone(radius: float, height: float) -> GraspObject:
    mesh = revolve([(0.0, 0.0), (radius, 0.0), (0.0, height)], circle(72))
    return GraspObject.from_meshes([(mesh.vertices, mesh.triangles)], name="cone")


def solid_angle_share(half_x: float, half_y: float, height: float) -> float:
    """Return the share of all directions that meet a rectangle whose middle is at a height over the eye."""
    x, y, z = half_x, half_y, height
    return 4.0 * math.atan(x * y / (z * math.sqrt(x * x + y * y + z * z))) / (4.0 * math.pi)


def test_a_box_rests_on_its_sides_by_their_solid_angles() -> None:
    found = clench.stable_poses(GraspObject.load("box:x=0.1,y=0.05,z=0.03"))
    assert len(found) == 6
    expected = [solid_angle_share(0.05, 0.025, 0.015), solid_angle_share(0.05, 0.015, 0.025)]
    expected.append(solid_angle_share(0.025, 0.015, 0.05))
    assert [s.probability for s in found] == pytest.approx(np.repeat(expected, 2))
    assert [s.center_height for s in found] == pytest.approx(np.repeat([0.015, 0.025, 0.05], 2))
    assert [s.margin for s in found] == pytest.approx(np.repeat([0.025, 0.015, 0.015], 2))
    assert found[4].tip_angle == pytest.approx(math.atan2(0.015, 0.05))
    assert {s.facets for s in found} == {1}
    assert {s.spread for s in found} == {0.0}
    # Ties are in the order of the down directions: -z comes before +z, so the first pose turns nothing.
    assert np.allclose(found[0].pose.matrix, Pose([0.0, 0.0, 0.015]).matrix, atol=1e-15)
    assert np.allclose(found[1].pose.rotation, np.diag([1.0, -1.0, -1.0]), atol=1e-15)


def test_round_shapes_have_one_pose_where_they_roll() -> None:
    ends = GraspObject.load("cylinder:r=0.03,h=0.1")
    side, low, high = stable_poses(ends)
    assert abs(down(side)[2]) < 1e-9
    assert side.facets > 30
    assert side.spread > math.radians(170.0)
    share = (1.0 - 0.05 / math.hypot(0.05, 0.03)) / 2.0
    assert (low.probability, high.probability) == pytest.approx((share, share), abs=1e-3)
    assert (low.spread, low.facets, low.center_height) == (0.0, 1, pytest.approx(0.05))

    (anyhow,) = stable_poses(GraspObject.load("ball"))
    assert anyhow.probability == pytest.approx(1.0)
    assert anyhow.facets > 1000

    side, base = stable_poses(cone(0.05, 0.06))
    assert np.allclose(down(base), [0.0, 0.0, -1.0], atol=1e-9)
    assert (base.facets, side.facets) == (1, 72)
    # Its line of support, from the tip to the base, lies in the table.
    assert down(side)[2] == pytest.approx(math.sin(math.atan2(0.05, 0.06)), abs=2e-3)


def test_facets_count_by_themselves_when_asked() -> None:
    apart = stable_poses(cone(0.05, 0.06), merge_angle=0.0)
    assert len(apart) == 73
    assert {s.facets for s in apart} == {1}


def leaning(along_x: float, along_y: float) -> GraspObject:
    """Return a prism that leans, by the run for a unit of rise."""
    points = BOX_CORNERS * [0.01, 0.01, 0.05]
    return of_points(points + points[:, 2:] * [along_x, along_y, 0.0])


def bumpy_ball(seed: int) -> GraspObject:
    """Return the hull of random points of a sphere: it rests on about a hundred facets in all directions."""
    points = np.random.default_rng(seed).normal(size=(150, 3))
    return of_points(0.05 * points / np.linalg.norm(points, axis=1, keepdims=True))


@pytest.mark.parametrize("angle", [0.05, 0.1, 0.2])
def test_many_facets_hang_together_as_few_do(angle: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where facets are many, only neighbours on the sphere are compared; the groups are the same."""
    capsule = GraspObject.load("capsule:r=0.02,h=0.1")  # rests on one circle of directions
    objects = [capsule, cone(0.05, 0.06), *map(bumpy_ball, range(4))]
    expected = [stable_poses(obj, merge_angle=angle) for obj in objects]
    assert {1, 2, 3} <= {s.facets for found in expected[2:] for s in found}
    monkeypatch.setattr(module, "_MANY", 4)
    assert [stable_poses(obj, merge_angle=angle) for obj in objects] == expected


def test_a_leaning_prism_falls_on_the_side_it_leans_to() -> None:
    upright, leans = stable_poses(leaning(0.0, 0.0)), stable_poses(leaning(0.5, 0.0))
    assert len(upright) == 6
    # It cannot stand on its ends. From them it falls on the sides it leans to: the two at the front get nothing.
    assert len(leans) == 4
    fronts = [s.probability for s in leans if abs(down(s)[1]) > 0.9]
    obj = leaning(0.5, 0.0)
    assert fronts == pytest.approx([shares_of_normals(obj, [0.0, 1.0, 0.0])] * 2)
    ends = shares_of_normals(obj, [0.0, 0.0, 1.0])
    sides = shares_of_normals(obj, [1.0, 0.0, -0.5])
    assert [s.probability for s in leans if abs(down(s)[1]) < 0.1] == pytest.approx([ends + sides] * 2)


def shares_of_normals(obj: GraspObject, normal: list[float]) -> float:
    """Return the share of all directions from the centre of mass that meet the facet with some normal."""
    hull = hull_facets(graspable_points(obj), "test")
    facet = int(np.argmax(hull.normals @ normal))
    return float(hull.shares(mass_properties(obj).center)[facet])


def test_a_fall_over_either_of_two_edges_is_shared() -> None:
    """The prism leans along a diagonal: from its ends it falls on two sides, one as likely as the other."""
    for seed in range(5):
        turned = graspable_points(leaning(0.5, 0.5)) @ Rotation.random(random_state=seed).as_matrix()
        found = stable_poses(of_points(turned), merge_angle=0.0)
        assert [s.probability for s in found] == pytest.approx([0.25] * 4, abs=1e-9)


def test_rounded_coordinates_make_no_false_rests() -> None:
    """Rounding to 1 µm bends the flat facets of a ball a little: over some of their creases nothing rolls down."""
    ball = GraspObject.load("sphere:r=0.04").bodies[0].shapes[0].to_mesh(3e-5).vertices
    for seed in (2, 3):
        points = np.round(ball @ Rotation.random(random_state=seed).as_matrix(), 6)
        found = stable_poses(of_points(points), merge_angle=0.0)
        assert sum(s.probability for s in found) == pytest.approx(1.0, abs=1e-12)
        assert min(s.margin for s in found) > 0.0


def test_a_given_center_of_mass_decides() -> None:
    box = GraspObject.load("box:x=0.04,y=0.04,z=0.2")
    standing = [s for s in stable_poses(box) if abs(down(s)[2]) > 0.9]
    assert [s.probability for s in standing] == pytest.approx([standing[0].probability] * 2)
    loaded = stable_poses(box, center_of_mass=[0.0, 0.0, -0.09])
    assert np.allclose(down(loaded[0]), [0.0, 0.0, -1.0], atol=1e-9)
    assert loaded[0].probability == pytest.approx(solid_angle_share(0.02, 0.02, 0.01))
    assert loaded[0].center_height == pytest.approx(0.01)


def test_the_object_stands_on_the_table_with_its_center_over_the_origin() -> None:
    mug = GraspObject.load("mug")
    for stable in stable_poses(mug, table_height=0.7):
        z = stable.pose.apply(graspable_points(mug))[:, 2]
        assert z.min() == pytest.approx(0.7, abs=1e-12)
        center = stable.pose.apply(mass_properties(mug).center)
        assert center == pytest.approx([0.0, 0.0, 0.7 + stable.center_height], abs=1e-12)


def test_a_table_is_put_under_it() -> None:
    mug = GraspObject.load("mug")
    stable = next(s for s in stable_poses(mug, table_height=0.3) if down(s)[2] < 0.5)
    placed = stable.on_table(mug, size=(0.5, 0.4), thickness=0.02)
    assert placed.pose == stable.pose
    assert placed.bodies[: len(mug.bodies)] == mug.bodies
    top = placed.bodies[-1]
    assert top.role is BodyRole.OBSTACLE
    corners = placed.pose.apply(top.shapes[0].to_mesh().vertices)
    assert corners.min(axis=0) == pytest.approx([-0.25, -0.2, 0.28], abs=1e-12)
    assert corners.max(axis=0) == pytest.approx([0.25, 0.2, 0.3], abs=1e-12)


def test_obstacles_and_the_pose_of_the_object_do_not_matter() -> None:
    mug = GraspObject.load("mug")
    alone = stable_poses(mug)
    moved = mug.posed(Pose([1.0, 2.0, 3.0], [0.5, 0.5, 0.5, 0.5])).with_body(table())
    assert stable_poses(moved.with_body(obstacle("box:x=1,y=0.1,z=0.1"))) == alone
    assert stable_poses(mug) == alone


def test_parts_count_together() -> None:
    """Two cubes side by side are a bar: it rests on six sides as the bar does."""
    cubes = GraspObject.from_meshes(
        [(BOX_CORNERS * 0.02, BOX_TRIANGLES), (BOX_CORNERS * 0.02, BOX_TRIANGLES, Pose([0.04, 0.0, 0.0]))]
    )
    bar = GraspObject.load("box:x=0.08,y=0.04,z=0.04")
    expected = [s.probability for s in stable_poses(bar)]
    assert [s.probability for s in stable_poses(cubes)] == pytest.approx(expected)


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10_000), count=st.integers(4, 40))
def test_every_pose_is_at_rest_and_something_happens(seed: int, count: int) -> None:
    obj = random_solid(seed, count)
    center, points = mass_properties(obj).center, graspable_points(obj)
    found = stable_poses(obj, merge_angle=0.0)
    assert sum(s.probability for s in found) == pytest.approx(1.0, abs=1e-12)
    assert [s.probability for s in found] == sorted((s.probability for s in found), reverse=True)
    for stable in found:
        p, c = stable.pose.apply(points), stable.pose.apply(center)
        assert p[:, 2].min() == pytest.approx(0.0, abs=1e-12)
        assert c[:2] == pytest.approx([0.0, 0.0], abs=1e-12)
        assert stable.margin > 0.0
        # A small tilt in any direction raises the centre of mass above what the object stands on.
        for angle in np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False):
            tilt = Rotation.from_rotvec(1e-4 * np.array([np.cos(angle), np.sin(angle), 0.0]))
            height = tilt.apply(c)[2] - tilt.apply(p)[:, 2].min()
            assert height > stable.center_height
    # The lowest place of the centre of mass is always a rest.
    assert min(s.center_height for s in found) == pytest.approx(lowest_center(points, center), rel=1e-9)


def lowest_center(points: np.ndarray, center: np.ndarray) -> float:
    import trimesh

    hull = trimesh.Trimesh(points).convex_hull
    return float(np.min(np.einsum("ij,ij->i", hull.triangles[:, 0] - center, hull.face_normals)))


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 10_000), scale=st.floats(1e-3, 1e3))
def test_scale_and_frame_of_the_object_change_nothing_else(seed: int, scale: float) -> None:
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(12, 3)) * 0.05
    turn = Rotation.random(random_state=seed)
    shift = rng.normal(size=3) * scale
    plain = stable_poses(of_points(points), merge_angle=0.0)
    other = stable_poses(of_points(turn.apply(points) * scale + shift), merge_angle=0.0)
    assert [s.probability for s in other] == pytest.approx([s.probability for s in plain], abs=1e-9)
    for a, b in zip(plain, other, strict=True):
        assert turn.apply(down(a)) == pytest.approx(down(b), abs=1e-6)
        assert b.margin == pytest.approx(a.margin * scale, abs=1e-7 * scale)


def test_random_solids_agree_with_trimesh() -> None:
    """Beyond a corner of a facet the two rules may choose different edges; few solids come to that."""
    totals = [compare_with_trimesh(random_solid(seed, 4 + seed % 27)).sum() / 2.0 for seed in range(60)]
    assert np.median(totals) < 1e-6
    assert np.mean(totals) < 0.01
    assert np.max(totals) < 0.2


@pytest.mark.parametrize("model", ["mug", "bottle", "screwdriver", "cylinder:r=0.03,h=0.1", "capsule:r=0.02,h=0.1"])
def test_builtin_objects_agree_with_trimesh(model: str) -> None:
    difference = compare_with_trimesh(GraspObject.load(model))
    assert difference.max() <= 0.001
    assert difference.sum() / 2.0 <= 0.005


@pytest.mark.shared
@pytest.mark.parametrize("model", SCANNED)
def test_real_objects_agree_with_trimesh(model: str, shared_data: Path) -> None:
    difference = compare_with_trimesh(GraspObject.load(shared_data / "objects" / model))
    assert difference.max() <= 0.005
    assert difference.sum() / 2.0 <= 0.015


def compare_with_trimesh(obj: GraspObject) -> np.ndarray:
    """Check that trimesh finds the same directions, and return the differences of their probabilities.

    Both say over which edge a facet rolls, by rules that differ beyond a corner of the facet: trimesh takes the edge
    between the middle of the triangle and the centre of mass, clench the edge that the centre of mass overhangs most.
    """
    import trimesh

    mesh = trimesh.Trimesh(graspable_points(obj)).convex_hull
    transforms, probabilities = trimesh.poses.compute_stable_poses(
        mesh, center_mass=mass_properties(obj).center, sigma=0.0, n_samples=1
    )
    ours = stable_poses(obj, merge_angle=0.0)
    directions = np.array([down(s) for s in ours])
    near = directions @ -transforms[:, 2, :3].T > math.cos(NEAR)
    # Either may find a sliver more. Directions that trimesh reports twice, as it rounds them, count together.
    assert probabilities[~near.any(axis=0)].sum() < 1e-4
    assert sum(s.probability for s, hit in zip(ours, near.any(axis=1), strict=True) if not hit) < 1e-3
    place, which = near.any(axis=1), near.argmax(axis=1)
    summed = np.bincount(which[place], [s.probability for s in np.array(ours)[place]], len(probabilities))
    theirs = np.bincount(near[near.argmax(axis=0)].argmax(axis=1), probabilities, len(probabilities))
    return np.abs(summed - theirs)


@pytest.mark.parametrize(
    "model", ["mug", "bottle", "screwdriver", "box:x=0.1,y=0.05,z=0.03", "ellipsoid:a=0.03,b=0.02,c=0.05"]
)
def test_the_most_probable_pose_stays_in_a_simulation(model: str) -> None:
    check_at_rest(GraspObject.load(model))


@pytest.mark.shared
@pytest.mark.parametrize("model", ["ycb_cracker_box", "ycb_banana", "ycb_power_drill"])
def test_the_most_probable_pose_of_a_scan_stays_in_a_simulation(model: str, shared_data: Path) -> None:
    check_at_rest(GraspObject.load(shared_data / "objects" / model / "textured.obj"))


def check_at_rest(obj: GraspObject) -> None:
    """Set the hull down from 1 mm above a plane, wait for a second of simulation, and look at its tilt."""
    stable = stable_poses(obj)[0]
    assert tilt_after_a_second(obj, stable.pose) < math.radians(2.0)
    # The same check sees an object that does not rest: it stands on a corner.
    corner = Pose(wxyz=Rotation.from_rotvec([0.5, 0.4, 0.0]).as_quat(scalar_first=True))
    raised = corner @ Pose(wxyz=stable.pose.wxyz)
    lift = raised.apply(graspable_points(obj))[:, 2].min()
    assert tilt_after_a_second(obj, Pose([0.0, 0.0, -lift], raised.wxyz)) > math.radians(5.0)


def tilt_after_a_second(obj: GraspObject, pose: Pose) -> float:
    """Return by what angle the vertical of the object has turned [rad]."""
    import mujoco

    points = graspable_points(obj)
    hull = convex_hull(TriangleMesh(points, np.empty((0, 3), dtype=np.int64)))
    center = mass_properties(obj).center
    spec = mujoco.MjSpec()
    spec.option.timestep = 0.001
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[1.0, 1.0, 0.1])
    mesh = spec.add_mesh(name="hull")
    mesh.uservert = ((hull.vertices - center) * 10.0).ravel().tolist()  # ten times as large: the engine likes that
    mesh.userface = hull.triangles.ravel().tolist()
    body = spec.worldbody.add_body(name="object")
    body.add_freejoint()
    body.explicitinertial = True
    size = float(np.abs(points - center).max()) * 10.0
    body.mass, body.ipos, body.inertia = 1.0, [0.0, 0.0, 0.0], [0.2 * size**2] * 3
    body.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname="hull", mass=0.0, friction=[1.0, 0.005, 0.0001])
    model = spec.compile()
    data = mujoco.MjData(model)
    data.qpos[:3] = pose.apply(center) * 10.0 + np.array([0.0, 0.0, 0.01])
    data.qpos[3:7] = pose.wxyz
    for _ in range(1500):
        mujoco.mj_step(model, data)
    before, after = pose.rotation[2], data.body("object").xmat.reshape(3, 3)[2]
    return float(np.arccos(np.clip(before @ after, -1.0, 1.0)))


def test_a_flat_object_has_no_rest() -> None:
    sheet = GraspObject.from_meshes([([[0, 0, 0], [0.1, 0, 0], [0.1, 0.1, 0], [0, 0.1, 0]], [[0, 1, 2], [0, 2, 3]])])
    with pytest.raises(clench.ObjectError, match=r"^object: expected a solid, but the object is flat: all of its"):
        stable_poses(sheet)
    thin = BOX_CORNERS * [0.05, 0.05, 1e-10]
    with pytest.raises(clench.ObjectError, match="the object is flat"):
        stable_poses(GraspObject.from_meshes([(thin, BOX_TRIANGLES)]))


@pytest.mark.parametrize("center", [[0.0, 0.0, 0.2], [0.05, 0.0, 0.0], [0.0, 0.0, -0.015]])
def test_a_center_of_mass_outside_is_refused(center: list[float]) -> None:
    box = GraspObject.load("box:x=0.1,y=0.05,z=0.03")
    sentence = r"center_of_mass: \[.*\] is not inside of the convex hull of box:.*, which reaches from \[-0\.05, -0\.02"
    with pytest.raises(clench.ObjectError, match=sentence):
        stable_poses(box, center_of_mass=center)


def test_a_surface_that_crosses_itself_may_have_its_center_outside() -> None:
    """A prism over a bow tie: its two lobes count with opposite signs."""
    tie = np.array([[0.0, 0.0], [0.1, 0.1], [0.1, 0.0], [0.0, 0.09]])
    points = np.array([[x, y, z] for z in (0.0, 0.03) for x, y in tie])
    sides = [t for i, j in ((0, 1), (1, 2), (2, 3), (3, 0)) for t in ([i, j, j + 4], [i, j + 4, i + 4])]
    obj = GraspObject.from_meshes([(points, [[0, 2, 1], [0, 3, 2], [4, 5, 6], [4, 6, 7], *sides])])
    with pytest.raises(clench.ObjectError, match=r"does its surface cross itself\? Give the centre of mass\.$"):
        stable_poses(obj)
    assert stable_poses(obj, center_of_mass=[0.05, 0.05, 0.015])


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"center_of_mass": [0.0, 1.0]}, r"center_of_mass: expected 3 numbers"),
        ({"center_of_mass": [0.0, 0.0, np.nan]}, r"center_of_mass: expected finite numbers"),
        ({"center_of_mass": "middle"}, r"center_of_mass: expected"),
        ({"table_height": np.inf}, r"table_height: expected a finite number \[m\], got inf"),
        ({"merge_angle": -0.1}, r"merge_angle: expected a number from 0 to pi \[rad\], got -0\.1"),
        ({"merge_angle": np.nan}, r"merge_angle: expected a number from 0 to pi"),
    ],
)
def test_bad_options_are_refused_by_name(options: dict[str, object], sentence: str) -> None:
    with pytest.raises(clench.ClenchError, match=sentence):
        stable_poses(GraspObject.load("ball"), **options)  # type: ignore[arg-type]
