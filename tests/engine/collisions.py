"""Whether posed fingers collide with an object, by python-fcl, along their closing path."""

import fcl
import numpy as np
import numpy.typing as npt

import clench
from clench.models.hand.hand import Finger, Hand, JointRole
from clench.models.shapes import Shape

from .surfaces import volume_tree

Floats = npt.NDArray[np.float64]

#: How far each joint is backed off along its path, and how far it is advanced beyond its contact [rad].
BACK, FURTHER = 1e-5, 1e-3
_LOOKS = 12


def tree_of(shape: Shape) -> fcl.BVHModel:
    """Return a shape's triangles; round ones are inscribed and off by 1 um at most."""
    mesh = shape.to_mesh(1e-6)
    return volume_tree(mesh.vertices, mesh.triangles)


class Collisions:
    """Look for colliding triangles of one hand's fingers and one object."""

    def __init__(self, hand: Hand, obj: clench.GraspObject) -> None:
        self.hand = hand
        self.objects = [fcl.CollisionObject(tree_of(s)) for body in obj.bodies for s in body.shapes]
        self.links = [[tree_of(s) for s in link.shapes.get(hand.default_source, ())] for link in hand.links]
        self.followers = {c.follower for c in hand.couplings}

    def collide(self, q: Floats, T_object_palm: Floats, finger: Finger) -> list[str]:
        """Return the names of the finger's links that collide at a posture."""
        poses = T_object_palm @ self.hand.link_poses(self.hand.coupled(q))
        names = []
        for link in finger.links:
            placed = fcl.Transform(poses[link][:3, :3], poses[link][:3, 3])
            trees = [fcl.CollisionObject(tree, placed) for tree in self.links[link]]
            if any(fcl.collide(tree, obj) for tree in trees for obj in self.objects):
                names.append(self.hand.links[link].name)
        return names

    def path(self, finger: Finger, start: Floats, end: Floats) -> list[Floats]:
        """Return postures along the proximal-first path; where a joint stops it is backed off."""
        q, postures = start.copy(), []
        for j in finger.joints:
            if self.hand.joints[j].role is JointRole.CLOSING and j not in self.followers:
                run = end[j] - start[j]
                for part in np.linspace(0.0, 1.0, _LOOKS)[1:]:
                    at = q.copy()
                    at[j] = start[j] + part * run
                    if part == 1.0 and abs(run) > 2.0 * BACK:
                        at[j] -= BACK * np.sign(run)
                    postures.append(at)
                q[j] = end[j]
        return postures

    def check(self, solution: clench.GraspSolution) -> int:
        """Assert that nothing collides on the way and that every contact stops its joint; return how many do."""
        T_object_palm = np.linalg.inv(solution.object_pose.matrix) @ solution.hand_pose.matrix
        start = np.array([solution.open_angles[name] for name in self.hand.joint_names])
        end = np.array([solution.joint_angles[name] for name in self.hand.joint_names])
        for name in solution.fingers:
            finger = self.hand.finger(name)
            for q in [*self.path(finger, start, end), end]:
                assert not self.collide(q, T_object_palm, finger), name
        seen = 0
        for contact in solution.contacts:
            if not contact.passed:
                joint = self.hand.joint_index(contact.stops_joint)
                q = end.copy()
                q[joint] += FURTHER * self.hand.joints[joint].direction
                assert self.collide(q, T_object_palm, self.hand.finger(contact.finger)), contact
                seen += 1
        return seen
