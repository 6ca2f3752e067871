"""Make a hand of a model: compile it, understand it, apply the hand file."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from clench.core.exceptions import FileError, UnknownNameError
from clench.core.pose import FloatArray
from clench.models.hand.reading.compiled import CompiledModel, collide_visuals, compile_model, keep_bodies, refuse_loops
from clench.models.hand.reading.extremes import refuse_extremes
from clench.models.hand.reading.kinematics import Skeleton, build_skeleton
from clench.models.hand.reading.link_geometry import ShapeReader, bodies_without_collision
from clench.models.hand.reading.model_files import ModelText
from clench.models.hand.reading.tendons import TendonMap, model_tendons
from clench.models.hand.understanding.allowed_pairs import allowed_pairs, check_excluded, with_given_pairs
from clench.models.hand.understanding.coupling import FoundCouplings, Relation, find_couplings, flatten
from clench.models.hand.understanding.finger_geometry import built_alike, finger_line, tip_motion
from clench.models.hand.understanding.fingers import find_fingers, find_thumb, fixed_links, name_fingers, row_places
from clench.models.hand.understanding.palm import find_palm, hand_bodies
from clench.models.hand.understanding.roles import assign_roles
from clench.models.shapes import CollisionSource

from .findings import Finding, FindingCode, Severity, quoted
from .hand import Finger, Hand, JointRole, Link
from .hand_checks import check_understood
from .hand_file import HandFile, LinkOverride

#: Tips whose mean closing direction is shorter oppose each other: the palm faces along the fingers [-].
_OPPOSED = 0.4


def make_hand(text: ModelText, overrides: HandFile, palm: str | None, source: CollisionSource) -> Hand:
    """Return the hand that a model describes.

    Args:
        text, overrides: the model, and what a hand file says of it. palm: the palm link's name.
        source: the geometry to use unless a command names one.

    Raises:
        FileError: MuJoCo refuses the model. HandError: an unsupported or contradictory model.
        UnknownNameError: the hand file names what the model does not have.
    """
    compiled, palm_body, findings = _hand_alone(text, palm)
    bodies = hand_bodies(compiled.model, palm_body)
    skeleton = build_skeleton(compiled, bodies, palm_body, text.velocities, overrides.joints)
    found = _with_given_couplings(find_couplings(compiled, skeleton), skeleton, overrides, text.label)
    reader = ShapeReader(compiled)
    links = _links(skeleton, reader, overrides)
    hand = Hand(
        name=text.name,
        path=text.path,
        links=links,
        joints=skeleton.joints,
        couplings=found.couplings,
        fingers=(),
        palm=skeleton.link_of_body[palm_body],
        fixed_links=(),
        allowed_pairs=allowed_pairs(compiled, skeleton, links),
        palm_center=np.zeros(3),
        palm_normal=np.zeros(3),
        default_source=source,
        overlaps_allowed=True,
        tendons=_tendons(compiled, skeleton, overrides),
        findings=(*findings, *skeleton.findings, *found.findings, *reader.findings),
        spec_xml=compiled.xml,
        assets=text.assets,
    )
    return _understood(hand, overrides, found.held)


def _hand_alone(text: ModelText, palm: str | None) -> tuple[CompiledModel, int, list[Finding]]:
    """Compile a model, find its palm, leave out other limbs, and give bare links something to collide with."""
    compiled = compile_model(text)
    refuse_extremes(compiled)
    if palm is None:
        refuse_loops(compiled, None)
    body = find_palm(compiled, palm)
    refuse_loops(compiled, body)
    findings: list[Finding] = []
    kept = {0, *hand_bodies(compiled.model, body)}
    if len(kept) < compiled.model.nbody and body != 0:
        dropped = compiled.model.nbody - len(kept)
        compiled = keep_bodies(compiled, kept)
        body = sorted(kept).index(body)
        findings.append(
            Finding(
                FindingCode.LINKS_LEFT_OUT,
                f"Left out, as neither the hand nor between it and the root: {dropped} of {dropped + len(kept)} links.",
                "Nothing to do, unless the hand itself is incomplete: then name its palm (--palm).",
                Severity.NOTE,
            )
        )
    bare = bodies_without_collision(compiled, hand_bodies(compiled.model, body), body)
    if bare:
        names = tuple(compiled.body_name(b) for b in sorted(bare))
        findings.append(
            Finding(
                FindingCode.COLLISION_FROM_VISUALS,
                f"Links without collision geometry collide with what is drawn: {quoted(names)}.",
                "Nothing to do if the drawn shapes are true; each counts as its convex hull "
                '(collision_source = "raw" in the hand file takes the triangles as they are).',
                links=names,
            )
        )
        compiled = collide_visuals(compiled, bare)
    return compiled, body, findings


def _links(skeleton: Skeleton, reader: ShapeReader, overrides: HandFile) -> tuple[Link, ...]:
    names = [frame.name for frame in skeleton.frames]
    for name in overrides.links:
        if name not in names:
            raise UnknownNameError("link", name, f"the model (links.{name} in {overrides.path})", names)
    nothing: dict[CollisionSource, tuple[()]] = dict.fromkeys(CollisionSource, ())
    links = []
    for frame in skeleton.frames:
        given = overrides.links.get(frame.name, LinkOverride())
        links.append(
            Link(
                name=frame.name,
                parent=frame.parent,
                joint=frame.joint,
                T_parent_link=frame.T_parent_link,
                shapes=reader.shapes(frame.body) if frame.body >= 0 else nothing,
                mass=frame.mass,
                pad_indentation=given.pad_indentation,
                friction=given.friction,
            )
        )
    return tuple(links)


def _tendons(compiled: CompiledModel, skeleton: Skeleton, overrides: HandFile) -> TendonMap | None:
    """Return the tendons of the hand file, or else those of the model."""
    names = [j.name for j in skeleton.joints]
    if overrides.tendons is None:
        return model_tendons(compiled.model, {j: names[k] for j, k in skeleton.joint_of_model.items()})
    for name in overrides.tendons.joints:
        if name not in names:
            raise UnknownNameError("joint", name, f"the model (tendons.joints in {overrides.path})", names)
    return overrides.tendons


def _with_given_couplings(found: FoundCouplings, skeleton: Skeleton, overrides: HandFile, label: str) -> FoundCouplings:
    """Return the couplings with the hand file's additions, replacements and removals."""
    names = [j.name for j in skeleton.joints]
    given = {name: o for name, o in overrides.joints.items() if o.follows is not None}
    if not given:
        return found
    relations = [
        Relation(c.leader, c.follower, c.ratio, c.offset, c.reason, c.breakaway)
        for c in found.couplings
        if names[c.follower] not in given
    ]
    for name, o in given.items():
        for joint in (name, o.follows):
            if joint and joint not in names:
                raise UnknownNameError("joint", joint, f"the model (joints.{name} in {overrides.path})", names)
        if o.follows == name:
            raise FileError(overrides.path, f"joints.{name}.follows: a joint cannot follow itself.")
        if o.follows:
            leader, follower = names.index(o.follows), names.index(name)
            relations.append(Relation(leader, follower, o.ratio, o.offset, "hand file", o.breakaway))
    return replace(found, couplings=flatten(relations, names, label))


def _understood(hand: Hand, overrides: HandFile, held: Mapping[int, float]) -> Hand:
    """Return the hand with fingers, roles, thumb, fixed links and the palm's centre and normal."""
    fingers, findings = find_fingers(hand, overrides)
    bare = replace(hand, fingers=fingers, findings=(*hand.findings, *findings))
    hand = assign_roles(bare, overrides, held)
    bases, tips, stretch, closing = _directions(hand)
    thumb = find_thumb(hand.fingers, stretch, closing)
    told = [finger.is_thumb for finger in fingers]
    places = row_places(bases, thumb, tips[thumb or 0])
    fingers = name_fingers(hand, thumb, places, overrides)
    called = _called_thumbs(fingers, told, overrides)
    swinging = [
        f.is_thumb and (named or (_closes_before_it_turns(hand, f) and (f.name in called or _unlike_others(hand, f))))
        for f, named in zip(fingers, told, strict=True)
    ]
    if swinging != told:
        # The base of a thumb has another role than that of a finger, which was not known before.
        known = tuple(replace(f, is_thumb=swings) for f, swings in zip(fingers, swinging, strict=True))
        hand = assign_roles(replace(bare, fingers=known), overrides, held)
        bases, tips, stretch, closing = _directions(hand)
    hand = replace(hand, fingers=fingers, fixed_links=fixed_links(hand.links, fingers, hand.palm))
    excluded = check_excluded(hand)
    hand = replace(
        hand,
        allowed_pairs=with_given_pairs(hand, overrides),
        palm_center=bases.mean(axis=0),
        palm_normal=_normal(hand, stretch, closing, gripper=not called),
    )
    return replace(hand, findings=(*hand.findings, *excluded, *check_understood(hand)))


def _called_thumbs(fingers: Sequence[Finger], told: Sequence[bool], overrides: HandFile) -> set[str]:
    """Return the names of fingers that the model or the hand file calls thumbs; others only stand against the rest."""
    called = {finger.name for finger, named in zip(fingers, told, strict=True) if named}
    return called | {name for name, finger in overrides.fingers.items() if finger.thumb}


def _closes_before_it_turns(hand: Hand, finger: Finger) -> bool:
    """Return whether a posture joint comes after a closing one, so that a thumb's base may be parallel by chance."""
    closing = [hand.joints[j].role is JointRole.CLOSING for j in finger.joints]
    return any(a and not b for a, b in itertools.combinations(closing, 2))


def _unlike_others(hand: Hand, finger: Finger) -> bool:
    """Return whether no other finger is built like this one: several of one kind close alike."""
    return not any(built_alike(hand, finger, other) for other in hand.fingers if other.joints != finger.joints)


def _directions(hand: Hand) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return the geometry of every open finger, each of shape (F, 3).

    The arrays are: base (anchor of its first joint) and tip [m]; unit direction from its first closing joint to the
    tip; unit direction in which the tip closes.
    """
    q = hand.open_angles()
    bases, tips, stretch, closing = [], [], [], []
    for finger in hand.fingers:
        line = finger_line(hand, finger, q)
        own = [hand.joints[j] for j in finger.joints]
        rates = np.array([j.direction if j.role is JointRole.CLOSING else 0.0 for j in own], dtype=np.float64)
        bases.append(line.anchors[0])
        tips.append(line.tip)
        root = next((k for k, j in enumerate(own) if j.role is JointRole.CLOSING), 0)
        stretch.append(_unit(line.tip - line.anchors[root]))
        closing.append(_unit(tip_motion(line, rates)))
    return np.array(bases), np.array(tips), np.array(stretch), np.array(closing)


def _normal(hand: Hand, stretch: FloatArray, closing: FloatArray, *, gripper: bool) -> FloatArray:
    """Return the palm's normal: the mean closing direction of the fingers' tips, without the thumb.

    Fingers that close towards each other (claws, grippers) have no common side: their palm faces along them. In a
    gripper the finger that stands against the others counts as much as they do together.
    """
    others = [i for i, f in enumerate(hand.fingers) if not f.is_thumb]
    against = [i for i, f in enumerate(hand.fingers) if f.is_thumb]
    groups = [group for group in (others, against) if group]
    mean = closing[groups[0]].mean(axis=0)
    if len(groups) == 1 or not gripper:
        return _unit(mean if np.linalg.norm(mean) >= _OPPOSED else stretch[groups[0]].mean(axis=0))
    if stretch[others].mean(axis=0) @ stretch[against].mean(axis=0) < -_OPPOSED:
        mean = np.mean([closing[group].mean(axis=0) for group in groups], axis=0)
    if np.linalg.norm(mean) < _OPPOSED or any(_unit(mean) @ closing[i] < -_OPPOSED for i in against):
        mean = np.mean([stretch[group].mean(axis=0) for group in groups], axis=0)
    return _unit(mean)


def _unit(v: FloatArray) -> FloatArray:
    norm = float(np.linalg.norm(v))
    return v / norm if norm > 0.0 else np.array([0.0, 0.0, 1.0])
