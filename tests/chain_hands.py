"""Hands of capsule links, written down by hand, whose contacts have closed forms."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from clench.core.pose import FloatArray, Pose, rotation_about
from clench.models.hand.hand import Coupling, Finger, Hand, Joint, JointRole, Link
from clench.models.mesh import TriangleMesh
from clench.models.shapes import CollisionSource, Shape, ShapeKind

X, Y, Z = np.eye(3)


def along_x(radius: float, length: float) -> Shape:
    """Return a capsule whose core runs from the link's origin to (length, 0, 0)."""
    half = np.sqrt(0.5)
    return Shape(ShapeKind.CAPSULE, (radius, length / 2, 0.0), Pose([length / 2, 0, 0], wxyz=[half, 0, half, 0]))


def bipyramid(steep: float, flat: float, corners: int = 4, radius: float = 0.01) -> Shape:
    """Return a body of two pyramids on one ring, with these slopes up and down [degrees]."""
    around = 2.0 * np.pi * np.arange(corners) / corners
    ring = radius * np.column_stack([np.cos(around), np.sin(around), np.zeros(corners)])
    tips = [[0.0, 0.0, radius * np.tan(np.radians(steep))], [0.0, 0.0, -radius * np.tan(np.radians(flat))]]
    k = np.arange(corners)
    up = np.column_stack([k, (k + 1) % corners, np.full(corners, corners)])
    down = np.column_stack([(k + 1) % corners, k, np.full(corners, corners + 1)])
    mesh = TriangleMesh(np.vstack([ring, tips]), np.vstack([up, down]))
    return Shape(ShapeKind.MESH, mesh=mesh)


def mount(position: ArrayLike = (0.0, 0.0, 0.0), rotation: FloatArray | None = None) -> FloatArray:
    """Return the pose of a finger's base in the palm, shape (4, 4)."""
    T = np.eye(4)
    T[:3, 3] = position
    if rotation is not None:
        T[:3, :3] = rotation
    return T


class HandBuilder:
    """Put a hand together finger by finger; the palm's origin is the hand's."""

    def __init__(self, palm: Shape | None = None) -> None:
        shapes = {CollisionSource.ENGINE: (palm,)} if palm else {}
        self.links = [Link("palm", -1, -1, np.eye(4), shapes)]
        self.joints: list[Joint] = []
        self.fingers: list[Finger] = []
        self.couplings: list[Coupling] = []

    def finger(
        self,
        name: str,
        shapes: Sequence[Shape | tuple[Shape, ...] | None],
        lengths: Sequence[float],
        *,
        base: FloatArray | None = None,
        axes: Sequence[FloatArray] | None = None,
        roles: Sequence[JointRole] | None = None,
        direction: int = 1,
        lower: float = 0.0,
        upper: float = 3.0,
        thumb: bool = False,
    ) -> "HandBuilder":
        """Add a chain: link i turns about an axis through its origin and carries shape i; the next is at x = length."""
        parent, links, joints = 0, [], []
        T = np.eye(4) if base is None else base
        for i, shape in enumerate(shapes):
            carried = () if shape is None else shape if isinstance(shape, tuple) else (shape,)
            role = JointRole.CLOSING if roles is None else roles[i]
            axis = -Y if axes is None else np.asarray(axes[i], dtype=float)
            self.joints.append(
                Joint(f"{name}_{i}", axis, np.zeros(3), lower, upper, role=role, direction=direction, open_value=0.0)
            )
            self.links.append(
                Link(f"{name}_link_{i}", parent, len(self.joints) - 1, T, {CollisionSource.ENGINE: carried})
            )
            parent = len(self.links) - 1
            links.append(parent)
            joints.append(len(self.joints) - 1)
            T = mount((lengths[i], 0.0, 0.0))
        self.fingers.append(Finger(name, tuple(links), tuple(joints), thumb, links[-1]))
        return self

    def couple(
        self, leader: str, follower: str, ratio: float, offset: float = 0.0, *, breakaway: bool = False
    ) -> "HandBuilder":
        """Let a joint follow another."""
        names = [j.name for j in self.joints]
        found = Coupling(names.index(leader), names.index(follower), ratio, offset, breakaway, reason="test")
        self.couplings.append(found)
        return self

    def hand(self, name: str = "chain", normal: FloatArray = Z) -> Hand:
        """Return the hand."""
        return Hand(
            name=name,
            path=None,
            links=tuple(self.links),
            joints=tuple(self.joints),
            couplings=tuple(self.couplings),
            fingers=tuple(self.fingers),
            palm=0,
            fixed_links=(0,),
            allowed_pairs=tuple((link.parent, i) for i, link in enumerate(self.links) if link.parent >= 0),
            palm_center=np.zeros(3),
            palm_normal=np.asarray(normal, dtype=float),
        )


def one_link(radius: float = 0.008, length: float = 0.1, *, up: bool = True, upper: float = 3.0) -> Hand:
    """Return a finger of one capsule from the origin along x that turns from x towards z, or towards -z."""
    axis = -Y if up else Y
    return HandBuilder().finger("index", [along_x(radius, length)], [length], axes=[axis], upper=upper).hand()


def three_links(radius: float = 0.007, lengths: Sequence[float] = (0.05, 0.035, 0.025), **options: Any) -> Hand:
    """Return a finger of three capsules along x that closes from x towards z."""
    shapes = [along_x(radius, length) for length in lengths]
    return HandBuilder().finger("index", shapes, lengths, **options).hand()


def turned(axis: FloatArray, angle: float) -> FloatArray:
    """Return a rotation matrix, shape (3, 3)."""
    return rotation_about(np.asarray(axis, dtype=float), angle)
