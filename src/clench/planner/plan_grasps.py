"""Plan grasps: from a hand and an object to the best wrist poses, preshapes, forces and paths."""

from __future__ import annotations

from typing import Unpack

from clench.core.argument_types import check_type
from clench.core.exceptions import CommandError, guessed
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import GraspObject

from .grasp_plan import GraspPlan
from .options import PlanArguments, PlanOptions
from .search import GraspSearch


def plan_grasps(hand: Hand, obj: GraspObject, count: int = 10, **options: Unpack[PlanArguments]) -> GraspPlan:
    """Plan grasps of an object at its present pose; no wrist pose and no preshape are needed (docs/method.md section
    9).

    The hand's pads face each other in some zones. The planner puts these zones on opposing places of the object and
    brings the open hand up along the palm's normal. It closes the hand over the full width, and keeps the grasps whose
    contacts resist every wrench. Every returned grasp is certified. It has a squeeze within the limits of the joints,
    and a path from its preshape that is proven free. No two grasps are alike.

    Args:
        hand: the hand. obj: the object at its pose, with obstacles as other bodies (`GraspObject.with_body`).
        count: how many grasps are wanted.
        friction: of all contacts [-]: a number, or a range (least, largest) over which every grasp holds. None takes
            the friction of links and object, or 0.6 if unknown.
        mass: of the object [kg], a number or a range.
        gravity: its direction in the world; None: the object is held in any direction.
        task_wrenches: rows (force [N], torque [Nm]) in the world about the centre of mass, each of which is resisted
            together with the weight, (N, 6).
        contact_model: "point", or "soft" for fingers that also resist a twist about the normal, with the coefficient
            torsion [m]. None is soft for pinches, which hold nothing otherwise, and point for the rest.
        kinds: some of "pinch", "tripod", "precision", "power"; None is any.
        fingers: names of the fingers that may close; None is all. min_fingers: how many touch at least.
        approach: direction in the world in which the palm comes; approach_angle: how far off it may be [rad].
        touch, avoid: parts of the object where all contacts, or no contacts, are to be; see `clench.types.Region`.
        reachable: a function from poses of the palm, `T_world_palm` of shape (N, 4, 4), to N truth values.
        pose_sigma: standard deviation of the object's position [m], and of its rotation [rad] as a second number
            (default 0.6° per mm). The planner prefers grasps that hold when the object is displaced.
        apart: least distance of two grasps [m]: the root mean square, over all links, of how far a link is moved.
        effort: proposals per wanted grasp; the planner returns the best one of so many.
        most: proposals at most; 2000 or 4 times `count` times `effort` by default.
        seconds: the search ends after this time, but not before a first round and its first grasp. `GraspPlan.proposed`
            gives the number of proposals.
        seed: the same seed gives the same grasps, to the bit, for any number of threads.
        threads: how many are used; all cores by default. path: whether paths are planned, which takes longest.

    Raises:
        CommandError: an option of a wrong type or out of range; no two fingers of the hand oppose each other.
        ObjectError: no graspable surface, or none in the regions.
        UnknownNameError: no such finger.
    """
    search = iter_grasps(hand, obj, count, **options)
    for _ in search:
        pass
    return search.plan()


def iter_grasps(hand: Hand, obj: GraspObject, count: int = 10, **options: Unpack[PlanArguments]) -> GraspSearch:
    """Return a search that yields grasps as they are found: the first ones long before the last.

    Iterate over it. `search.plan()` then has all grasps, the best ones first, and the reasons of all rejections.

    Args, errors: as for `plan_grasps`.
    """
    check_type(hand, Hand, "hand")
    check_type(obj, GraspObject, "obj")
    known = PlanArguments.__annotations__
    for name in options:
        if name not in known:
            raise CommandError(f"plan_grasps: unknown option '{name}'.{guessed(name, known)} See help(plan_grasps).")
    return GraspSearch(hand, obj, PlanOptions(count=count, **options))
