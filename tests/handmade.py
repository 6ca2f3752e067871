"""Solutions written by hand, for tests of what is done with them."""

from __future__ import annotations

import numpy as np

from clench.core.pose import Pose
from clench.solver.solution import (
    Candidate,
    Contact,
    ContactKind,
    FingerResult,
    FingerStatus,
    GraspSolution,
    SolutionStatus,
)


def make_contact(**changes: object) -> Contact:
    values: dict[str, object] = {
        "finger": "index",
        "link": "index_distal",
        "body": "ball",
        "stops_joint": "index_curl",
        "plane": 1,
        "offset": -0.0025,
        "kind": ContactKind.SIDE,
        "passed": False,
        "position": np.array([0.1, 0.2 / 3.0, 0.3]),
        "normal": np.array([0.0, 0.6, 0.8]),
        "gap": 3e-13,
        "curve_angle": 0.7,
        "link_angle": 0.7,
    }
    return Contact(**{**values, **changes})  # type: ignore[arg-type]


def make_candidate(**changes: object) -> Candidate:
    values: dict[str, object] = {
        "plane": None,
        "offset": None,
        "order": "proximal-first",
        "posture": 0,
        "joint_angles": {"index_curl": 1.0 / 3.0, "index_tip": 0.2},
        "status": FingerStatus.TOUCH,
        "reason": "index_distal touches ball",
        "feasible": True,
        "penetration": 2e-12,
        "scores": {"range_of_motion": 0.3, "touching_links": 1.0},
        "contacts": (make_contact(plane=None, offset=None),),
    }
    return Candidate(**{**values, **changes})  # type: ignore[arg-type]


def make_solution(**changes: object) -> GraspSolution:
    on_plane = make_candidate(
        plane=1, offset=-0.0025, feasible=False, penetration=0.001, contacts=(make_contact(), make_contact(passed=True))
    )
    unchecked = make_candidate(
        plane=0, offset=0.0025, feasible=None, penetration=None, contacts=(), status=FingerStatus.LIMIT
    )
    index = FingerResult("index", FingerStatus.TOUCH, "touches", 2, (unchecked, on_plane, make_candidate()))
    thumb = FingerResult("thumb", FingerStatus.NO_MOTION, "no closing joint can move", 0, ())
    values: dict[str, object] = {
        "clench_version": "0.1.0",
        "hand": "pincer",
        "object": "ball",
        "hand_model": "pincer.xml",
        "object_model": "ball",
        "geometry_hash": "0123abcd",
        "seed": 7,
        "status": SolutionStatus.PARTIAL,
        "reason": {"code": "partial", "text": "index touches, thumb does not"},
        "hand_pose": Pose([0.1, -0.2, 0.3], wxyz=np.array([0.3, -0.5, 0.7, 0.1]) / np.sqrt(0.84)),
        "object_pose": Pose.identity(),
        "decomposition": {"posture": {"index_yaw": 0.1}, "closing": {"index_curl": 1.0 / 3.0, "index_tip": 0.2}},
        "joint_angles": {"index_yaw": 0.1, "index_curl": 1.0 / 3.0, "index_tip": 0.2},
        "open_angles": {"index_yaw": 0.1, "index_curl": 0.0, "index_tip": 0.0},
        "certified": False,
        "collision_source": "engine",
        "object_collision_source": "raw",
        "max_penetration": 4e-9,
        "fingers": {"index": index, "thumb": thumb},
        "contacts": (make_contact(plane=None, offset=None),),
        "timing": {"total": 0.0012},
        "joint_limits": {"index_yaw": (-0.3, 0.3), "index_curl": (0.0, 1.6), "index_tip": (0.0, 1.6)},
    }
    return GraspSolution(**{**values, **changes})  # type: ignore[arg-type]
