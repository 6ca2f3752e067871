"""Kernels that Python and other kernels call are compiled for one kind of arguments."""

import subprocess
import sys

#: Calls the kernels of the geometry from Python, and prints for how many kinds of arguments each was made ready, and
#: which arguments were tuples by value.
PROGRAM = """
import clench
from clench.closing.collision.containment import contained_link
from clench.closing.collision.packed_object import pack_object
from clench.kernels.geometry import link_frames, link_meshes, mesh_distance, penetration
from clench.closing.collision.self_check import open_overlaps
from clench.solver.problem import make_problem
hand, mug = clench.Hand.load("robonaut2"), clench.GraspObject.load("mug")
problem = make_problem(hand, mug, clench.GraspCommand(clench.Pose([0.0, 0.0, 0.1]), preshape="open"))
open_overlaps(hand, problem.source)
clench.solve(hand, mug, problem.command).to_dict()
contained_link(hand, problem.start, problem.packed, problem.T_palm_object, problem.source, hand.solid_links)
for kernel in (link_frames.place_links, link_meshes.find_contained, mesh_distance.is_inside, penetration.penetration):
    tuples = [a for kinds in kernel.signatures for a in kinds if hasattr(a, "fields")]
    print(kernel.__name__, len(kernel.signatures) <= 1, tuples)
"""


def test_python_hands_pointers_as_kernels_do() -> None:
    out = subprocess.run([sys.executable, "-c", PROGRAM], capture_output=True, text=True, check=True).stdout
    assert out.splitlines() == [
        f"{name} True []" for name in ("place_links", "find_contained", "is_inside", "penetration")
    ]
