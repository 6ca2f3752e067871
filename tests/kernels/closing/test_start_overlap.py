"""Whether fixed links overlap the object is told the same by planes around their hulls and by depths of triangles."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import clench
from chain_hands import HandBuilder, along_x, mount
from clench.closing.collision.depths import hand_depths
from clench.closing.collision.packed_object import pack_object
from clench.core.pose import Pose, invert
from clench.models.mesh import TriangleMesh
from clench.models.shapes import CollisionSource, Shape, ShapeKind


def meshes():
    """Return surfaces: closed and open, convex and not, in one piece and in several."""
    import trimesh

    ball, box = trimesh.creation.icosphere(2, 0.02), trimesh.creation.box((0.05, 0.03, 0.02))
    inner = trimesh.creation.icosphere(2, 0.016)
    inner.invert()
    lid = trimesh.creation.box((0.05, 0.05, 0.05))
    lid.update_faces(lid.triangles_center[:, 2] < 0.02)
    pair = [trimesh.creation.icosphere(1, 0.008).apply_translation((x, 0.0, 0.0)) for x in (-0.025, 0.025)]
    return {
        "ball": ball,
        "box": box,
        "shell": trimesh.util.concatenate([ball, inner]),
        "ring": trimesh.creation.torus(0.02, 0.006, major_sections=16, minor_sections=8),
        "open box": lid,
        "pair": trimesh.util.concatenate(pair),
        "large ball": trimesh.creation.icosphere(2, 0.3),
    }


def hand_with(palm):
    """Return a hand far from its palm's middle but for the palm, which is a mesh."""
    chain = HandBuilder().finger("a", [along_x(0.006, 0.04)], [0.04], base=mount((1.0, 0.0, 0.0))).hand()
    shapes = [(palm,), *(link.shapes[CollisionSource.ENGINE] for link in chain.links[1:])]
    links = [replace(x, shapes={CollisionSource.RAW: s}) for x, s in zip(chain.links, shapes, strict=True)]
    return replace(chain, links=tuple(links), default_source=CollisionSource.RAW)


@pytest.mark.parametrize("link", meshes())
@pytest.mark.parametrize(
    "thing", [*meshes(), "sphere:r=0.01", "cylinder:r=0.02,h=0.03", "box:x=0.02,y=0.02,z=0.02", "sphere:r=0.3"]
)
def test_a_palm_that_overlaps_blocks_and_one_that_does_not_does_not(link, thing):
    made = meshes()
    mesh = TriangleMesh(np.asarray(made[link].vertices), np.asarray(made[link].faces))
    hand = hand_with(Shape(ShapeKind.MESH, mesh=mesh))
    if thing in made:
        obj = clench.GraspObject.from_meshes([(np.asarray(made[thing].vertices), np.asarray(made[thing].faces))])
    else:
        obj = clench.GraspObject.load(thing)
    rng, packed = np.random.default_rng(sum(map(ord, link + thing))), pack_object(obj)
    poses = []
    for _ in range(24):
        turn = Rotation.random(random_state=int(rng.integers(1 << 30))).as_quat(scalar_first=True)
        poses.append(Pose(0.06 * rng.uniform(0.0, 1.0) * rng.normal(size=3) / 1.7, wxyz=turn))
    command = clench.GraspCommand(hand_pose=poses[0], preshape="open", measure=False)
    status = [str(s) for s in clench.solve_batch(hand, obj, poses, command, threads=1).status]
    deep = [max(d.depth for d in hand_depths(hand, hand.open_angles(), packed, invert(p.matrix))) > 1e-6 for p in poses]
    assert [s == "blocked" for s in status] == deep
    assert any(deep) or link == "pair"
