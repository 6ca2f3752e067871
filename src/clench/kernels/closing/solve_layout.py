"""Layout of the arrays that a solve reads and writes (docs/method.md sections 4 to 6).

E finger postures (a finger at one posture), F fingers, I candidates (a finger posture on one plane, or over its full
width), L links, J joints of the hand, G degrees of freedom, M link meshes, N poses, S contacts at most.
"""

from __future__ import annotations

from typing import NamedTuple

from clench.kernels.geometry.bodies import BodyArrays
from clench.kernels.geometry.link_frames import FrameArrays
from clench.kernels.geometry.link_meshes import DepthWork, LinkMeshArrays, ObjectMesh
from clench.kernels.meetings.meeting_layout import FingerLinks, Meetings, MeetingWork
from clench.kernels.toi.full_width import FullWidthArrays
from clench.kernels.toi.toi_work import SweepWork
from clench.kernels.trees.bvh import MeshTree

from .contact_reading import PalmContactArrays, SurfaceArrays
from .layout import CandidateArrays, ClosingArrays, Floats, HandArrays, Ints, RoundArrays, SectionArrays, Work

#: Stages of a solve; their sum says which ones to run.
CLOSE, BLOCK, CHOOSE, FINISH = 1, 2, 4, 8


class ObjectArrays(NamedTuple):
    """Bundle an object as the closing kernels take it: triangles, round primitives, whether closed, and its body."""

    tree: MeshTree
    rounds: RoundArrays
    closed: bool
    bodies: BodyArrays


class Closing(NamedTuple):
    """Bundle what closes candidates at one pose, and their answers; kernels hold each by a pointer.

    Args:
        hand: the fingers. full_width: for full-width sweeps. obj: the object in its own frame, at `T_palm_object` (3,
            4).
        shared, own: sections with every finger posture's first axis group, by global plane; arena for a finger
            posture's later axis groups.
        candidates: see `CandidateArrays`. work, sweep: scratch space. answer: written, cleared at the candidate's row.
    """

    hand: HandArrays
    full_width: FullWidthArrays
    obj: ObjectArrays
    T_palm_object: Floats
    shared: SectionArrays
    own: SectionArrays
    candidates: CandidateArrays
    work: Work
    sweep: SweepWork
    answer: ClosingArrays


class CommandArrays(NamedTuple):
    """Bundle what the command asks for.

    Args:
        start: posture before closing [rad], (J,). start_pose: `T_palm_link` of every link there, (L, 3, 4).
        fixed: whether a mesh is on a link that no finger moves, (M,). fingers: whether it is on a link that a finger
            moves, (M,).
        own, resting: whether a mesh is on a link of the finger, and on one of these that closing does not move, (E, M).
        joints: joints of the finger of each finger posture, palm side first, then -1, (E, K). finger: finger of each
            finger posture, (E,).
        thumb: whether a finger is a thumb, (F,). tip: the link that alone may touch, -1 where every link may, (F,).
        worth: what one unit of a criterion adds to the sum, in the order of the sum. term: which criterion of
            `clench.scoring.criterion_registry.ALWAYS` it is.
        present: candidate of each finger that goes before others up to `margin` better [steps of a sum], or -1, (F,).
        times: number of passes through the degrees of freedom of a finger. together: all joints of a hand move at once.
        full_width: candidates over the full width are among those of the plan. chosen: every finger has one candidate.
        several: finger postures of one finger differ in posture. nested: links lie inside each other at the start.
        idle: fingers asked for that no joint closes. alone: the hand has one finger.
    """

    start: Floats
    start_pose: Floats
    fixed: Ints
    fingers: Ints
    own: Ints
    resting: Ints
    joints: Ints
    finger: Ints
    thumb: Ints
    tip: Ints
    worth: Floats
    term: Ints
    present: Ints
    margin: float
    times: int
    together: bool
    full_width: bool
    chosen: bool
    several: bool
    nested: bool
    idle: int
    alone: bool


class ProblemArrays(NamedTuple):
    """Bundle what does not change from pose to pose.

    Args:
        hand, full_width, candidates: see `close_candidate`. target: the object; nothing: none. frames: kinematics of
            the hand.
        surface, mesh: the object, as contacts are read and depths measured. meshes: of the links.
        across: whether a moving link (row) may not overlap a resting one, of any finger, (L, L). apart: the same for
            links of different fingers alone, (L, L). command: see `CommandArrays`.
        fingers: the links of fingers that close at once; empty where they close one after another.
    """

    hand: HandArrays
    full_width: FullWidthArrays
    candidates: CandidateArrays
    target: ObjectArrays
    nothing: ObjectArrays
    frames: FrameArrays
    surface: SurfaceArrays
    mesh: ObjectMesh
    meshes: LinkMeshArrays
    across: Ints
    apart: Ints
    command: CommandArrays
    fingers: FingerLinks


class Arena(NamedTuple):
    """Bundle the arenas for sections of the object; they grow with the object.

    Args:
        shared, own: sections of all first axis groups, and of a finger posture's later ones. no_shared, no_own: of no
            object.
    """

    shared: SectionArrays
    own: SectionArrays
    no_shared: SectionArrays
    no_own: SectionArrays


class Workspace(NamedTuple):
    """Bundle the scratch space of a solve at one pose.

    Args:
        arena: see `Arena`. work, sweep, depth: of the closing, of full-width sweeps, of depths. spare: answers, (F,).
        picked: the candidates that the fingers take, (F,). swept: whether each is swept over the full width, (F,).
        placed: `T_palm_link` when each finger posture begins to close, (E, L, 3, 4). length: travel of all degrees of
            freedom, (G,).
        q, angles: of all joints, (J,). poses: (L + 2, 3, 4).
        palm_contacts: see `PalmContactArrays`. rows: fingers that are swept over the full width, (F,). meeting: of
            fingers that close at once.
    """

    arena: Arena
    work: Work
    sweep: SweepWork
    depth: DepthWork
    spare: ClosingArrays
    picked: CandidateArrays
    swept: Ints
    placed: Floats
    length: Floats
    q: Floats
    angles: Floats
    poses: Floats
    palm_contacts: PalmContactArrays
    rows: Ints
    meeting: MeetingWork


class Closed(NamedTuple):
    """Bundle how the fingers closed.

    Args:
        free: answers of all candidates, each without the other fingers, with the poses first.
        crossed: an outline of each finger posture that overlaps the object at the start, or -1, (N, E).
        blocked: reason why a finger posture overlaps the object before anything moves, see `start_overlap`; `CROSSED` +
            link if a plane or a sweep tells the link; 0 without an overlap, (N, E).
        nested: whether links lie inside each other at the start of the chosen candidates, (N,).
        final: answers of the chosen candidates, each with the other fingers in its way, (N, F).
        anew: whether a finger closed again, as another one was in its way, (N, F).
        overlapping: whether a finger that closes at once with the others overlaps one of them at the start, (N, F).
        met: where fingers that close at once held each other, with the poses first.
        overflow: 0 for a pose that is solved; else the capacity wanted, or anything before the first try, (N,).
    """

    free: ClosingArrays
    crossed: Ints
    blocked: Ints
    nested: Ints
    final: ClosingArrays
    anew: Ints
    overlapping: Ints
    met: Meetings
    overflow: Ints


class Solved(NamedTuple):
    """Bundle the answers.

    Args:
        angles: of all joints [rad], (N, J). status, certified: (N,). fingers: status of each finger, (N, F).
        chosen: candidate of each finger, (N, F). contacts: how many each finger has, (N, F).
        number, value: of the contacts, see `PalmContactArrays`, (N, F, S, ...).
    """

    angles: Floats
    status: Ints
    certified: Ints
    fingers: Ints
    chosen: Ints
    contacts: Ints
    number: Ints
    value: Floats
