"""How far links go on that are near each other: by fcl's distance, and by looking at many places of a step."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import clench
from chain_hands import HandBuilder, mount, turned
from clench.core.pose import Pose
from clench.kernels.geometry.bodies import Elements, pack_bodies
from clench.kernels.meetings import near_links as near
from clench.kernels.toi import sides as measured
from clench.kernels.toi import toi_work
from clench.models.mesh import TriangleMesh
from clench.models.shapes import CollisionSource, Shape, ShapeKind
from kernels.kernel_entries import entry
from kernels.kernel_solids import bounding_volumes, gap, star, torus

links_gap, stay_apart, lowest_on = entry(near.links_gap), entry(near.stay_apart), entry(near.lowest_on)
sides_of, gap_over = entry(measured.sides_of), entry(measured.gap_over)
make_sweep_work = entry(toi_work.make_sweep_work)
Y, Z = np.eye(3)[1:]


def rigid(rotation, place):
    return np.column_stack([rotation, place])


def surface(mesh, radius):
    return Elements(mesh.vertices, mesh.triangles.astype(np.int32), np.full(len(mesh.triangles), radius))


@pytest.mark.parametrize("seed", range(10))
def test_the_gap_of_links_is_that_of_their_nearest_elements(seed):
    rng = np.random.default_rng(seed)
    one, other = (star(seed, 0.05), torus(0.05, 0.015)) if seed % 2 else (torus(0.04, 0.01), star(seed, 0.03))
    radii = rng.uniform(0.0, 0.004, 2)
    links = pack_bodies([surface(one, radii[0]), surface(other, radii[1])])
    volumes, work, found = (bounding_volumes(one), bounding_volumes(other)), make_sweep_work(2, 0), 0
    for _ in range(30):
        T, R = (Rotation.random(random_state=int(rng.integers(1 << 30))).as_matrix() for _ in range(2))
        work.moving[:] = rigid(T, 0.12 * rng.normal(size=3))
        work.resting[:] = rigid(R, np.zeros(3))
        true = gap(volumes[0], work.moving, volumes[1], work.resting) - radii.sum()
        if true <= 1e-9:
            continue
        for bound in (math.inf, 1.5 * true, 0.5 * true):
            nearest, n = np.array([-1, -1]), rng.normal(size=3)
            seen = links_gap(links, 0, 1, bound, tuple(n / np.linalg.norm(n)), nearest, work)
            assert seen == pytest.approx(min(true, bound), abs=1e-9)
            assert (nearest[0] >= 0) == (true < bound)
        found += 1
    assert found > 5


@pytest.mark.parametrize("seed", range(8))
def test_what_is_told_to_stay_apart_on_a_step_does_so_at_every_place_of_it(seed):
    """One item turns about an axis, the other rests. Some of them come down on the way, some at its end."""
    rng = np.random.default_rng(seed)
    links = pack_bodies([surface(star(seed, 0.03), 0.001), surface(star(seed + 1, 0.03), 0.0)])
    resting, told, dips = rigid(np.eye(3), np.zeros(3)), 0, 0
    arm = float(np.linalg.norm(links.vertices, axis=1).max()) + 0.2
    for _ in range(400):
        pivot, rate = 0.1 * rng.normal(size=3), float(rng.uniform(0.2, 6.5))
        begin, axis = rng.normal(size=3), rng.normal(size=3)
        axis /= np.linalg.norm(axis)
        begin *= 0.1 / np.linalg.norm(begin)

        def at(s, begin=begin, axis=axis, rate=rate, pivot=pivot):
            R = Rotation.from_rotvec(rate * s * axis).as_matrix()
            return rigid(R, R @ begin + pivot)

        n = rng.normal(size=3)
        n /= np.linalg.norm(n)
        ends = [sides_of(tuple(n), np.ascontiguousarray(at(s)), resting) for s in (0.0, 1.0)]
        a, b = (
            int(rng.integers(-20, len(links.node) // 4)),
            int(rng.integers(-len(links.elements), -len(links.elements) // 2)),
        )
        plane = near.StepPlane(ends[0], ends[1], rate * rate * arm)
        between = [
            gap_over(links, a, links, b, sides_of(tuple(n), np.ascontiguousarray(at(s)), resting))
            for s in np.linspace(0.0, 1.0, 60)
        ]
        if stay_apart(links, a, b, plane, 1.0):
            told += 1
            assert min(between) > 0.0
        dips += between[0] > 0.0 and between[-1] > 0.0 and min(between) < 0.0
        if between[0] > 0.0 > between[-1]:
            assert not stay_apart(links, a, b, plane, 1.0)
    assert told > 20
    assert dips > 0


def test_the_lowest_place_of_a_parabola():
    for margin, left, bend in ((1.0, 1.0, 8.0), (1.0, 0.2, 3.0), (0.3, 0.3, 0.0), (0.1, 2.0, 1.0)):
        u = np.linspace(0.0, 0.5, 2001)
        heights = margin + (left - margin) * u / 0.5 - 0.5 * bend * u * (0.5 - u)
        assert lowest_on(0.5, margin, left, bend) == pytest.approx(heights.min(), abs=1e-6)
        assert lowest_on(0.5, margin, left, bend) <= heights.min() + 1e-15


def facing_rings(rng):
    """Return a hand of two fingers of one link each that swing towards each other: rings and stars, not their hulls."""
    fingers, meshes = HandBuilder(), []
    for k, name in enumerate(("a", "b")):
        ring = rng.random() < 0.7
        mesh = torus(0.02, float(rng.uniform(0.003, 0.006))) if ring else star(int(rng.integers(99)), 0.015)
        turn = Rotation.random(random_state=int(rng.integers(1 << 30))).as_matrix()
        meshes.append(TriangleMesh(mesh.vertices @ turn.T + [0.05, 0.0, 0.0], mesh.triangles))
        place = mount((0.06 * (2 * k - 1), 0.01 * rng.normal(), 0.0), turned(Z, k * np.pi) @ turned(Y, 1.4))
        fingers.finger(name, [Shape(ShapeKind.MESH, mesh=meshes[-1])], [0.05], base=place, upper=2.5)
    hand = fingers.hand()
    shapes = [link.shapes.get(CollisionSource.ENGINE, ()) for link in hand.links]
    links = tuple(replace(x, shapes={CollisionSource.RAW: s}) for x, s in zip(hand.links, shapes, strict=True))
    return replace(hand, links=links, default_source=CollisionSource.RAW), meshes


@pytest.mark.parametrize("seed", range(12))
def test_fingers_of_rings_that_close_at_once_stop_where_small_steps_first_touch(seed):
    rng = np.random.default_rng(seed)
    hand, meshes = facing_rings(rng)
    far = clench.GraspObject.load("sphere:r=0.01", pose=Pose([1.0, 0.0, 0.0]))
    speeds = {"b_0": float(rng.uniform(0.3, 1.0))}
    command = clench.GraspCommand(
        hand_pose=Pose.identity(), preshape="open", order="together", speeds=speeds, measure=False
    )
    solution = clench.solve(hand, far, command)
    q = np.array(list(solution.joint_angles.values()))
    volumes = [bounding_volumes(mesh) for mesh in meshes]

    def apart(s):
        poses = hand.link_poses(np.minimum(s * np.array([1.0, speeds["b_0"]]), 2.5))
        return gap(volumes[0], poses[1], volumes[1], poses[2])

    assert apart(0.0) > 0.0
    # Each joint stops at its limit by itself; those that meet stop at once.
    held = (q < 2.5 - 1e-9).all()
    end = q[0] if held else 2.5 / speeds["b_0"]
    ways = np.arange(0.0, end - 1e-4, 2e-3)
    assert min(apart(s) for s in ways) > 0.0
    if held:
        assert q[1] == pytest.approx(speeds["b_0"] * q[0], abs=1e-9)
        assert apart(q[0] - 1e-5) > 0.0
        assert apart(q[0]) < 1e-8
    assert solution.certified
