"""The answer while the user drags: status, posture, contacts and a bound of the hold margin, in milliseconds."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clench.core.exceptions import CommandError
from clench.core.pose import FloatArray, Pose
from clench.mechanics.epsilon.batch_bounds import epsilon_bounds
from clench.mechanics.grasp.contacts import pair_friction
from clench.models.hand.hand import Hand
from clench.models.objects.grasp_object import BodyRole, GraspObject
from clench.models.objects.mass import mass_properties
from clench.solver.batch.tracking import Tracker
from clench.solver.solution import GraspSolution
from clench.solver.solve import solve

from .shelf import Shelf
from .view_state import ViewState


@dataclass(frozen=True, eq=False)
class QuickAnswer:
    """The numbers of a closing, without sentences.

    Args:
        state: the question. hand, obj: the models.
        status: by name. certified: see `GraspSolution`. fingers: status of every finger asked for, by name.
        joint_angles: of all joints [rad], shape (J,).
        links, fingers_at: link and finger of every contact that counts. positions: [m], normals: out of the object;
            in the world, shape (C, 3). friction: [-], shape (C,).
        bound: lower bound of the hold margin (epsilon, L1) [N per N]; 0 without force closure.
        seconds: time of the closing [s].
        solution: the whole answer, where it was computed at once.
    """

    state: ViewState
    hand: Hand
    obj: GraspObject
    status: str
    certified: bool
    fingers: dict[str, str]
    joint_angles: FloatArray
    links: tuple[int, ...]
    fingers_at: tuple[str, ...]
    positions: FloatArray
    normals: FloatArray
    friction: FloatArray
    bound: float
    seconds: float
    solution: GraspSolution | None = None


class QuickSolver:
    """Answer states one after another; pack anew only the inputs that changed.

    Args:
        shelf: what names of hands and objects mean.
    """

    def __init__(self, shelf: Shelf) -> None:
        self._shelf = shelf
        self._key: tuple[Any, ...] = ()
        self._tracker: Tracker | None = None

    def answer(self, state: ViewState) -> QuickAnswer:
        """Return the answer for a state, whose posture is kept as it is.

        Raises:
            ClenchError: a model cannot be loaded, or the command does not fit it.
        """
        hand, obj = self._shelf.hand(state.hand), self._shelf.object(state.object)
        tracker = self._tracker_of(state, hand, obj)
        began = time.perf_counter()
        if tracker is None:
            solution = solve(hand, obj, state.command)
            return _of_solution(state, hand, obj, solution, time.perf_counter() - began)
        command = state.command
        batch = tracker.update(hand_pose=command.hand_pose, object_pose=command.object_pose)
        seconds = time.perf_counter() - began
        contacts = batch.contacts
        kept = ~contacts.passed
        return _finished(
            QuickAnswer(
                state,
                hand,
                obj,
                status=str(batch.status[0]),
                certified=bool(batch.certified[0]),
                fingers=dict(zip(batch.finger_names, batch.finger_status[0].tolist(), strict=True)),
                joint_angles=batch.joint_angles[0],
                links=tuple(contacts.link[kept].tolist()),
                fingers_at=tuple(batch.finger_names[k] for k in contacts.finger[kept]),
                positions=contacts.position[kept],
                normals=contacts.normal[kept],
                friction=np.empty(0),
                bound=0.0,
                seconds=seconds,
            ),
            contacts.body[kept],
        )

    def _tracker_of(self, state: ViewState, hand: Hand, obj: GraspObject) -> Tracker | None:
        """Return what answers a command at many poses, None where no kernel of a batch covers it."""
        command = replace(state.command, hand_pose=Pose.identity(), object_pose=Pose.identity())
        key = (state.hand, state.object, command)
        if key != self._key:
            self._key, self._tracker = (), None
            # With an empty preshape, clench would choose again at every change. The viewer keeps its preshape.
            kept = command if command.preshape else replace(command, preshape="open")
            try:
                self._tracker = Tracker(hand, obj, replace(kept, hand_pose=state.command.hand_pose))
            except CommandError as error:
                if "Tracker" not in str(error):
                    raise
            self._key = key
        return self._tracker


def _of_solution(
    state: ViewState, hand: Hand, obj: GraspObject, solution: GraspSolution, seconds: float
) -> QuickAnswer:
    kept = [contact for contact in solution.contacts if not contact.passed]
    names = [body.name for body in obj.bodies]
    return _finished(
        QuickAnswer(
            state,
            hand,
            obj,
            status=solution.status.value,
            certified=solution.certified,
            fingers={name: finger.status.value for name, finger in solution.fingers.items()},
            joint_angles=np.array([solution.joint_angles[name] for name in hand.joint_names]),
            links=tuple(hand.link_index(contact.link) for contact in kept),
            fingers_at=tuple(contact.finger for contact in kept),
            positions=np.array([contact.position for contact in kept]).reshape(-1, 3),
            normals=np.array([contact.normal for contact in kept]).reshape(-1, 3),
            friction=np.empty(0),
            bound=0.0,
            seconds=seconds,
            solution=solution,
        ),
        np.array([names.index(contact.body) for contact in kept], dtype=np.int64),
    )


def _finished(answer: QuickAnswer, bodies: NDArray[np.int64]) -> QuickAnswer:
    """Return an answer with the friction of its contacts and the bound of the hold margin."""
    state, obj = answer.state, answer.obj
    pairs = zip(answer.links, bodies.tolist(), strict=True)
    mu = [state.friction or pair_friction(answer.hand, link, obj.bodies[body]) for link, body in pairs]
    friction = np.array(mu, dtype=np.float64)
    carrying = np.array([obj.bodies[body].role is BodyRole.GRASPABLE for body in bodies.tolist()], dtype=np.bool_)
    bound = 0.0
    if answer.status in ("grasp", "partial") and carrying.any():
        mass = mass_properties(obj)
        pose = state.command.object_pose or obj.pose
        where = answer.positions[carrying], answer.normals[carrying], friction[carrying]
        bound = float(epsilon_bounds([0, int(carrying.sum())], *where, pose.apply(mass.center)[None], mass.length)[0])
    return replace(answer, friction=friction, bound=bound)
