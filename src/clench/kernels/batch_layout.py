"""Layout of the arrays that a batch of solves reads and writes."""

from __future__ import annotations

from typing import NamedTuple

from .bodies import BodyArrays
from .layout import Floats, Ints, RoundArrays
from .tree import MeshTree


class Wanted(NamedTuple):
    """Hold what a batch is asked for; E entries, M link meshes, L links, J joints of the hand.

    Args:
        start: posture before closing [rad], (J,). start_pose: `T_palm_link` of every link there, (L, 3, 4).
        fixed: meshes of links that no finger moves, (M,). fingers: of those that fingers move, (M,).
        own, resting: meshes of each finger's links, and of those of them that closing does not move, (E, M).
        joints: of each entry's finger, palm side first, then -1, (E, K). thumb: of each entry, (E,).
        worth: what 1 rad of motion, one touching link and the whole range of a joint add to the sum, in the order in
            which they are added, (3,). term: which of the three each is, (3,).
        present: item of each entry that goes before others up to `margin` better [steps of a sum], or -1, (E,).
        whole: the items are the full width. nested: links lie inside each other before anything moves.
        idle: fingers asked for that no joint closes.
    """

    start: Floats
    start_pose: Floats
    fixed: Ints
    fingers: Ints
    own: Ints
    resting: Ints
    joints: Ints
    thumb: Ints
    worth: Floats
    term: Ints
    present: Ints
    margin: float
    whole: bool
    nested: bool
    idle: int


class ObjectArrays(NamedTuple):
    """Hold an object as the closing kernels take it: triangles, round primitives, whether closed, and its body."""

    tree: MeshTree
    rounds: RoundArrays
    closed: bool
    bodies: BodyArrays


class Solved(NamedTuple):
    """Hold the answers; N poses, E entries, S contacts at most.

    Args:
        angles: of all joints [rad], (N, J). status, certified: (N,). fingers: status of each entry, (N, E).
        chosen: item of each entry, (N, E). contacts: how many each entry has, (N, E).
        number, value: of the touches, see `TouchArrays`, (N, E, S, ...).
    """

    angles: Floats
    status: Ints
    certified: Ints
    fingers: Ints
    chosen: Ints
    contacts: Ints
    number: Ints
    value: Floats
