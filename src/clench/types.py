"""The parts of inputs and answers, and the codes that they use."""

from __future__ import annotations

from typing import TYPE_CHECKING

from clench.core.lazy_names import lazy_names

if TYPE_CHECKING:
    from clench.closing.collision.packed_object import set_object_cache
    from clench.mechanics.grasp.contact_kinds import GraspKind
    from clench.models.hand.findings import Finding, FindingCode
    from clench.models.hand.hand import JointRole
    from clench.models.objects.grasp_object import Body, BodyRole
    from clench.models.objects.stable_poses import StablePose
    from clench.models.shapes import CollisionSource, ShapeKind
    from clench.planner.grasp_plan import PlannedGrasp
    from clench.planner.regions import Region
    from clench.planner.search import GraspSearch
    from clench.solver.batch.grasp_batch import BatchContacts
    from clench.solver.solution import Candidate, Contact, ContactKind, FingerResult, FingerStatus, SolutionStatus

_HOMES = {
    "BatchContacts": "clench.solver.batch.grasp_batch",
    "Body": "clench.models.objects.grasp_object",
    "BodyRole": "clench.models.objects.grasp_object",
    "Candidate": "clench.solver.solution",
    "CollisionSource": "clench.models.shapes",
    "Contact": "clench.solver.solution",
    "ContactKind": "clench.solver.solution",
    "Finding": "clench.models.hand.findings",
    "FindingCode": "clench.models.hand.findings",
    "FingerResult": "clench.solver.solution",
    "FingerStatus": "clench.solver.solution",
    "GraspKind": "clench.mechanics.grasp.contact_kinds",
    "GraspSearch": "clench.planner.search",
    "JointRole": "clench.models.hand.hand",
    "PlannedGrasp": "clench.planner.grasp_plan",
    "Region": "clench.planner.regions",
    "ShapeKind": "clench.models.shapes",
    "SolutionStatus": "clench.solver.solution",
    "StablePose": "clench.models.objects.stable_poses",
    "set_object_cache": "clench.closing.collision.packed_object",
}

__all__ = [
    "BatchContacts",
    "Body",
    "BodyRole",
    "Candidate",
    "CollisionSource",
    "Contact",
    "ContactKind",
    "Finding",
    "FindingCode",
    "FingerResult",
    "FingerStatus",
    "GraspKind",
    "GraspSearch",
    "JointRole",
    "PlannedGrasp",
    "Region",
    "ShapeKind",
    "SolutionStatus",
    "StablePose",
    "set_object_cache",
]

__getattr__, __dir__ = lazy_names(__name__, _HOMES)
