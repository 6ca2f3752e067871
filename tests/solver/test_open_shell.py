"""A finger that stands in an open shell is blocked, whatever else is far away, alone, in a batch and in full."""

import numpy as np
import pytest

import clench
from chain_hands import one_link
from clench.core.pose import Pose

CORNERS = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
#: The faces of a cube but for that towards -x.
FACES = [[4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]


@pytest.mark.parametrize("beside", [None, "sphere:r=0.01", "cylinder:r=0.01,h=0.02"])
def test_an_open_shell_blocks_what_stands_in_it_whatever_is_far_away(beside):
    shell = clench.GraspObject.from_meshes([(0.2 * CORNERS, np.array(FACES))], pose=Pose([0.23, 0.0, 0.0]))
    if beside is not None:
        shell = shell.with_object(clench.GraspObject.load(beside), pose=Pose([5.0, 5.0, 5.0]))
    hand, command = one_link(0.008, 0.1), clench.GraspCommand(hand_pose=Pose.identity(), planes=3, preshape="open")
    solution = clench.solve(hand, shell, command)
    assert solution.status == "blocked"
    assert solution.fingers["index"].status == "blocked"
    checked = clench.solve(
        hand, shell, clench.GraspCommand(hand_pose=Pose.identity(), planes=3, check_candidates=True, preshape="open")
    )
    assert checked.fingers["index"].status == "blocked"
    assert clench.solve_batch(hand, shell, [Pose.identity()], command).status[0] == "blocked"
