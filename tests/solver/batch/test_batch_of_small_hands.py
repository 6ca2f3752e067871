"""A batch gives the answers of single solves for hands of few links, whatever they meet at the start and on the way."""

import numpy as np
import pytest

import clench
from chain_hands import HandBuilder, along_x, mount
from clench.core.pose import Pose
from clench.models.shapes import Shape, ShapeKind

POSES = {
    "between": Pose([0.045, 0.0, 0.03]),
    "aside": Pose([0.045, 0.012, 0.045]),
    "only the index": Pose([0.03, 0.0, 0.022]),
    "out of reach": Pose([1.0, 0.0, 0.0]),
    "in the palm": Pose([-0.02, 0.0, 0.03]),
    "across the index": Pose([0.06, 0.0, 0.0]),
    "across both": Pose([0.08, 0.0, 0.03]),
}


def pincer(second: float = 1.2):
    """Return a palm, two fingers that close towards each other, and one that is fixed."""
    palm = Shape(ShapeKind.BOX, (0.006, 0.02, 0.04), Pose([-0.02, 0.0, 0.03]))
    lengths, up, down = [0.045, 0.03], [np.array([0.0, -1.0, 0.0])] * 2, [np.array([0.0, 1.0, 0.0])] * 2
    plate = Shape(ShapeKind.BOX, (0.014, 0.006, 0.003), Pose([0.016, 0.0, 0.0]))
    builder = HandBuilder(palm).finger("index", [along_x(0.006, 0.045), plate], lengths, axes=up, upper=1.5)
    builder.finger(
        "thumb", [along_x(0.006, 0.045), None], lengths, base=mount((0, 0, 0.06)), axes=down, upper=second, thumb=True
    )
    return builder.couple("thumb_0", "thumb_1", 0.5).hand()


@pytest.mark.parametrize("full_width", [True, False], ids=["certified", "planes"])
@pytest.mark.parametrize("model", ["box:x=0.02,y=0.03,z=0.012", "sphere:r=0.014"])
def test_a_batch_gives_what_single_solves_give(model, full_width):
    hand, obj, pose = pincer(), clench.GraspObject.load(model), Pose.identity()
    command = clench.GraspCommand(hand_pose=pose, full_width=full_width, planes=2, measure=False, preshape="open")
    hands = [Pose(-place.position) for place in POSES.values()]
    batch = clench.solve_batch(hand, obj, hands, command)
    alone = [
        clench.solve(
            hand, obj, clench.GraspCommand(hand_pose=p, full_width=full_width, planes=2, measure=False, preshape="open")
        )
        for p in hands
    ]
    for i, solution in enumerate(alone):
        assert batch.status[i] == solution.status
        assert list(solution.joint_angles.values()) == batch.joint_angles[i].tolist()
        assert batch.certified[i] == solution.certified
        assert batch.finger_status[i].tolist() == [solution.fingers[name].status for name in batch.finger_names]
        part = slice(*batch.contacts.first[i : i + 2])
        assert len(solution.contacts) == part.stop - part.start
        for values, key in ((batch.contacts.position, "position"), (batch.contacts.normal, "normal")):
            expected = np.array([getattr(c, key) for c in solution.contacts]).reshape(-1, 3)
            np.testing.assert_allclose(values[part], expected, atol=1e-13)
    seen = dict(zip(POSES, batch.status, strict=True))
    assert seen["between"] == "grasp"
    assert seen["out of reach"] == "no_contact"
    assert seen["in the palm"] == "blocked"
    assert "partial" in seen.values()
    assert batch.finger_status[list(POSES).index("across the index")].tolist()[0] == "blocked"
