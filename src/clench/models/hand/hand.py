"""The hand: links, joints, coupling, fingers and roles, as read from a model and understood."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from clench.core.caching.keeping import Keeper
from clench.core.exceptions import CommandError, UnknownNameError
from clench.core.pose import FloatArray
from clench.core.showing import display
from clench.core.showing.display import Displayed
from clench.core.showing.short_repr import described, short_repr
from clench.models.hand.reading.tendons import TendonMap
from clench.models.shapes import CollisionSource, Shape

from .findings import Finding, Severity
from .forward import JointArrays, joint_arrays, poses_at

if TYPE_CHECKING:
    from clench.models.hand.understanding.overlaps import Overlaps, Pairs

#: Speed of joints whose model gives no limit [rad/s].
DEFAULT_SPEED: Final = 2.0


class JointRole(StrEnum):
    """Name the roles of a joint in a grasp (docs/method.md section 1)."""

    CLOSING = "closing"
    """moves its finger in curl planes; its angle is solved for"""
    POSTURE = "posture"
    """abduction, opposition and the like; its angle comes from the command"""
    UPSTREAM = "upstream"
    """between the model's root and the palm (wrist, arm); never closes, set by the preshape"""


@dataclass(frozen=True)
class Joint:
    """Describe a revolute joint; angles are the model's own [rad].

    Args:
        name: as in the model.
        axis: unit axis in the frame of the link it moves, shape (3,).
        anchor: a point on the axis in the frame of the link it moves [m], shape (3,).
        lower, upper: limits [rad].
        reference: the angle [rad] at which `Link.T_parent_link` holds.
        velocity: limit [rad/s], or None when the model gives none.
        effort: limit [Nm], or None when the model gives none.
        stiffness: gain of its position servo [Nm/rad], or None when the model has none. A servo of a fixed tendon with
            gain k_p and coefficients c_i counts for every joint of the tendon as k_p times the sum of c_i².
        servo_share: `stiffness` beside the servo's own gain [-]: the sum of c_i² for a tendon's servo, 1 without one.
        friction_loss: torque that dry friction in the joint takes [Nm].
        role, role_reason: role in a grasp, and the reason for it.
        direction: +1 when its angle grows while the finger closes, else -1.
        direction_reason: why.
        open_value: angle [rad] of the open finger; `open_reason` says why.
    """

    name: str
    axis: FloatArray
    anchor: FloatArray
    lower: float
    upper: float
    reference: float = 0.0
    velocity: float | None = None
    effort: float | None = None
    stiffness: float | None = None
    servo_share: float = 1.0
    friction_loss: float = 0.0
    role: JointRole = JointRole.POSTURE
    role_reason: str = ""
    direction: int = 1
    direction_reason: str = ""
    open_value: float = 0.0
    open_reason: str = ""

    __repr__ = short_repr


@dataclass(frozen=True)
class Link:
    """Describe a rigid link.

    Args:
        name: as in the model.
        parent: index of the parent link, -1 for the root.
        joint: index of the joint that moves it relative to the parent, -1 when fixed.
        T_parent_link: pose in the parent at the joint's reference angle, shape (4, 4).
        shapes: shapes in the link's frame for every collision source.
        mass: [kg], 0 when the model gives none.
        pad_indentation: how far its pad may be indented [m] (hand file).
        friction: sliding friction of its surface, or None.
    """

    name: str
    parent: int
    joint: int
    T_parent_link: FloatArray
    shapes: Mapping[CollisionSource, tuple[Shape, ...]]
    mass: float = 0.0
    pad_indentation: float = 0.0
    friction: float | None = None

    __repr__ = short_repr


@dataclass(frozen=True)
class Coupling:
    """Tie a follower to its leader: `q_follower = ratio * q_leader + offset`, each inside its limits.

    Args:
        leader, follower: joint indices.
        ratio: [-]. offset: [rad].
        breakaway: the follower goes on when the leader is blocked.
        reason: the element of the model or hand file that says so.
    """

    leader: int
    follower: int
    ratio: float
    offset: float
    breakaway: bool = False
    reason: str = ""

    __repr__ = short_repr


@dataclass(frozen=True)
class Finger:
    """Describe a finger: a serial chain of revolute joints from the palm to the tip.

    Args:
        name: short name, e.g. ``"index"``.
        links: indices of the links that move with the finger's own joints, palm side first, tip last;
            links fixed to these are included.
        joints: indices of its own joints, palm side first.
        is_thumb: whether it opposes the others.
        tip_link: index of the most distal link that has a shape.
    """

    name: str
    links: tuple[int, ...]
    joints: tuple[int, ...]
    is_thumb: bool
    tip_link: int

    __repr__ = short_repr

    @cached_property
    def own(self) -> NDArray[np.intp]:
        """Its own joints as an index of postures, shape (n,)."""
        return np.array(self.joints, dtype=np.intp)


@dataclass(frozen=True)
class Hand(Keeper, Displayed):
    """A robot hand, as read from a model file: links, joints, couplings, and the fingers found in them.

    Links are sorted so that parents come first. Palm-frame quantities are at the reference posture.

    Args:
        name: the model's name. path: the file, or None for a built-in hand.
        links, joints, couplings, fingers: see their types.
        palm: index of the palm link.
        fixed_links: indices of links that no finger moves (palm included) and that objects can hit.
        allowed_pairs: sorted link index pairs that may always overlap (adjacent, or excluded by the model or the hand
            file); see `allowed_pairs_for`.
        palm_center: centroid of the finger bases in the palm frame [m]; palm_normal: mean closing direction
            of the tips, unit.
        default_source: the collision source unless a command names one.
        overlaps_allowed: whether links may also overlap, besides `allowed_pairs`, if they do so in every posture or in
            the open hand. This holds for hands that are read from a model.
        tendons: of the hand file, or else of the model; None when joints are driven by themselves.
        findings: problems and notes of the loader; `clench.check_hand` looks for more.
        spec_xml: MJCF or URDF text for simulation that MuJoCo compiles with `assets`. It has the model's own numbers,
            or six digits of them if other limbs were removed or visual geometry had to collide.
    """

    name: str
    path: Path | None
    links: tuple[Link, ...]
    joints: tuple[Joint, ...]
    couplings: tuple[Coupling, ...]
    fingers: tuple[Finger, ...]
    palm: int
    fixed_links: tuple[int, ...]
    allowed_pairs: tuple[tuple[int, int], ...]
    palm_center: FloatArray
    palm_normal: FloatArray
    default_source: CollisionSource = CollisionSource.ENGINE
    overlaps_allowed: bool = False
    tendons: TendonMap | None = None
    findings: tuple[Finding, ...] = ()
    spec_xml: str = ""
    assets: Mapping[str, bytes] = field(default_factory=dict)

    def show(self) -> Path | None:
        """Show the hand as a page, on which it closes; see `GraspSolution.show`."""
        return display.show(self)

    def __repr__(self) -> str:
        return described(
            self,
            name=self.name,
            fingers=[finger.name for finger in self.fingers],
            joints=len(self.joints),
            links=len(self.links),
            palm=self.links[self.palm].name,
        )

    @classmethod
    def load(
        cls,
        model: str | Path,
        *,
        hand_file: str | Path | None = None,
        palm: str | None = None,
        collision_source: CollisionSource | str | None = None,
    ) -> Hand:
        """Read a hand by name or from a `.urdf` / `.xml` / `.mjcf` file.

        Args:
            model: a built-in name (``"robonaut2"``), a path, or a name of mujoco_menagerie or robot_descriptions
                (``"shadow_hand/right_hand"``; these packages come with ``clench[hands]``).
            hand_file: TOML overrides; by default `<model>.hand.toml` beside the model when it exists.
            palm: the palm link's name, to pick a hand inside a whole robot.
            collision_source: the geometry to use unless a command names one.

        Raises:
            FileError: missing, unreadable or malformed file. HandError: unsupported or contradictory model.
            UnknownNameError: no such link, joint or built-in hand.
        """
        from .hand_loading import load_hand

        return load_hand(model, hand_file=hand_file, palm=palm, collision_source=collision_source)

    def mirrored(self) -> Hand:
        """Return the mirror image of the hand, e.g. a left hand from the model of a right one.

        Every frame is mirrored at its own plane y = 0. Names, joint angles, limits, couplings and tendons stay the
        same; the hand's name gets the suffix ``_mirrored``. A mirrored object and a mirrored pose (position
        ``[x, -y, z]``, quaternion ``[w, -x, y, -z]``) give the same joint angles. The model for simulation is mirrored,
        too, with six digits. A mirrored hand has no file: commands that load a hand by its name cannot load it.

        Raises:
            HandError: MuJoCo cannot compile the mirror image of the model.
        """
        from .mirroring import mirrored_hand

        return mirrored_hand(self)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Sentences about problems: the findings above notes."""
        return tuple(finding.text for finding in self.findings if finding.severity is Severity.WARNING)

    @cached_property
    def joint_arrays(self) -> JointArrays:
        """The joints as arrays, for forward kinematics."""
        return joint_arrays(self)

    @cached_property
    def joint_names(self) -> tuple[str, ...]:
        """Names of all joints, in model order."""
        return tuple(j.name for j in self.joints)

    @property
    def solid_links(self) -> tuple[int, ...]:
        """Indices of the links that can touch, ascending: fixed links and links of the fingers."""
        return tuple(sorted({*self.fixed_links, *(link for finger in self.fingers for link in finger.links)}))

    def allowed_pairs_for(self, source: CollisionSource) -> tuple[tuple[int, int], ...]:
        """Return the pairs of link indices that may overlap when links have the shapes of one source, sorted.

        These are `allowed_pairs` and the pairs whose shapes overlap in the open posture and in every other sampled
        posture. They are found once and kept.
        """
        return self._with_overlapping(source, self._overlaps(source).always)

    def allowed_pairs_from(self, source: CollisionSource, q: FloatArray) -> tuple[tuple[int, int], ...]:
        """Return the pairs of link indices that may overlap in a motion that starts at a posture, sorted.

        These are `allowed_pairs_for` and the pairs that overlap there because they overlap in the open hand: a link and
        the palm, or links of one finger. A motion that starts with them apart must keep them apart.

        Args:
            source: which shapes the links have. q: angles of all joints [rad], shape (J,).
        """
        found = self._overlaps(source)
        if not found.when_open:
            return self._with_overlapping(source, found.always)
        from clench.models.hand.understanding.overlaps import overlapping

        at_start = overlapping(self, CollisionSource(source), found.when_open, q)
        return self._with_overlapping(source, found.always | at_start)

    def _overlaps(self, source: CollisionSource) -> Overlaps:
        from clench.models.hand.understanding.overlaps import NO_OVERLAPS, find_overlaps

        if not self.overlaps_allowed:
            return NO_OVERLAPS
        return self.kept(("overlaps", source), lambda: find_overlaps(self, CollisionSource(source)))

    def _with_overlapping(self, source: CollisionSource, pairs: Pairs) -> tuple[tuple[int, int], ...]:
        return self.kept(("pairs", source, pairs), lambda: tuple(sorted({*self.allowed_pairs, *pairs})))

    def joint_index(self, name: str) -> int:
        """Return the index of a joint.

        Raises:
            UnknownNameError: no such joint.
        """
        try:
            return self.joint_names.index(name)
        except ValueError:
            raise UnknownNameError("joint", name, f"hand '{self.name}'", self.joint_names) from None

    def finger(self, name: str) -> Finger:
        """Return a finger by name.

        Raises:
            UnknownNameError: no such finger.
        """
        for finger in self.fingers:
            if finger.name == name:
                return finger
        raise UnknownNameError("finger", name, f"hand '{self.name}'", [f.name for f in self.fingers])

    def link_index(self, name: str) -> int:
        """Return the index of a link.

        Raises:
            UnknownNameError: no such link.
        """
        names = [link.name for link in self.links]
        try:
            return names.index(name)
        except ValueError:
            raise UnknownNameError("link", name, f"hand '{self.name}'", names) from None

    def open_angles(self) -> FloatArray:
        """Return the open posture of all joints [rad], shape (J,); couplings hold."""
        return self.coupled(np.array([j.open_value for j in self.joints]))

    def coupled(self, q: FloatArray) -> FloatArray:
        """Return a posture whose followers obey their couplings, each inside its limits, shape (J,) [rad]."""
        return self._tied(q, self.couplings)

    def tied(self, q: FloatArray) -> FloatArray:
        """Return a posture as `coupled` does, but keep the angles of followers with `breakaway`."""
        return self._tied(q, [c for c in self.couplings if not c.breakaway])

    def _tied(self, q: FloatArray, couplings: Iterable[Coupling]) -> FloatArray:
        q = np.array(q, dtype=np.float64)
        for c in couplings:
            j = self.joints[c.follower]
            q[c.follower] = min(max(c.ratio * q[c.leader] + c.offset, j.lower), j.upper)
        return q

    def followers_of(self, joint: int) -> tuple[int, ...]:
        """Return the indices of the joints that follow a joint, directly or over others, in the order of couplings."""
        found: list[int] = []
        for c in self.couplings:
            if c.leader == joint or c.leader in found:
                found.append(c.follower)
        return tuple(found)

    def link_poses(self, q: FloatArray) -> FloatArray:
        """Return `T_palm_link` of every link at a posture, shape (L, 4, 4).

        Args:
            q: angles of all joints [rad], shape (J,).
        """
        q = np.asarray(q, dtype=np.float64)
        if q.shape != (len(self.joints),):
            raise CommandError(f"posture: expected {len(self.joints)} angles, got shape {q.shape}.")
        placed: FloatArray = poses_at(self, q[None])[0]
        return placed
