"""Look at a hand that was understood: axes, lengths, shapes and thumb, as an engineer would before using it."""

from __future__ import annotations

import itertools

import numpy as np

from clench.core.showing.visible_text import visible
from clench.core.tolerances import CLOSING_ANGLE, PARALLEL_ANGLE
from clench.models.hand.reading.limits import write_effort
from clench.models.hand.understanding.finger_geometry import axis_angle, finger_line
from clench.models.hand.understanding.known_couplings import check_couplings
from clench.models.shapes import CollisionSource

from .findings import Finding, FindingCode, Severity, in_hand_file, quoted
from .hand import Finger, Hand, JointRole

#: Links of fingers that are longer, or joints farther apart, are no hand's [m].
_LARGE = 1.0
#: Fingers that are shorter are no hand's [m].
_SMALL = 2e-3
#: A mesh this many times longer than its finger's joints are apart has another unit [-].
_OUT_OF_SCALE = 50.0


def check_understood(hand: Hand) -> list[Finding]:
    """Return findings about axes, lengths, shapes and thumb of a hand."""
    found = [*_lengths(hand), *check_couplings(hand), *_without_effort(hand)]
    for finger in hand.fingers:
        found += _axes(hand, finger)
        found += _bare_joints(hand, finger)
    if len(hand.fingers) > 2 and not any(finger.is_thumb for finger in hand.fingers):
        found.append(_no_thumb(hand))
    return found


def _axes(hand: Hand, finger: Finger) -> list[Finding]:
    """Compare the axes of neighbouring closing joints at the open posture."""
    line = finger_line(hand, finger, hand.open_angles())
    places = [k for k, j in enumerate(finger.joints) if hand.joints[j].role is JointRole.CLOSING]
    found = []
    for a, b in itertools.pairwise(places):
        angle = axis_angle(line.axes[a], line.axes[b])
        if PARALLEL_ANGLE < angle <= CLOSING_ANGLE:
            found.append(_almost_parallel(hand, finger, finger.joints[a], finger.joints[b], angle))
    return found


def _almost_parallel(hand: Hand, finger: Finger, a: int, b: int, angle: float) -> Finding:
    names = (hand.joints[a].name, hand.joints[b].name)
    leaders = {c.follower: c.leader for c in hand.couplings}
    coupled = leaders.get(a, a) == leaders.get(b, b)
    degrees = float(np.rad2deg(angle))
    if coupled:
        what = "they are coupled, and no plane tells where links touch that both move: only the full width is closed"
    else:
        what = "each closes in curl planes of its own, and outlines after the second are cut anew for every posture"
    return Finding(
        FindingCode.AXES_ALMOST_PARALLEL,
        f"Joints '{names[0]}' and '{names[1]}' of finger '{finger.name}' are {degrees:.2g} deg from parallel: {what}.",
        "If they are parallel on the real hand, write their frames with more digits in the model; else nothing to do.",
        Severity.WARNING if coupled else Severity.NOTE,
        joints=names,
        numbers={"angle_deg": degrees},
    )


def _lengths(hand: Hand) -> list[Finding]:
    """Compare the sizes of links and the distances between joints with those of real hands."""
    spans: dict[str, float] = {}
    sizes: dict[int, float] = {}
    for finger in hand.fingers:
        line = finger_line(hand, finger, hand.open_angles())
        steps = np.linalg.norm(np.diff(line.anchors, axis=0), axis=1)
        spans[finger.name] = float(steps.max(initial=0.0))
        sizes |= {i: _size(hand, i) for i in finger.links}
    sizes[hand.palm] = _size(hand, hand.palm)
    largest = max(sizes, key=lambda i: sizes[i])
    span = max(spans.values())
    if span > _LARGE:
        text = f"Joints of a finger are {span:.4g} m apart: the model's lengths look like millimetres."
        advice = "Scale the model by 0.001: origins or positions of links and joints, and meshes."
        return [Finding(FindingCode.LENGTHS_TOO_LARGE, text, advice, numbers={"joint_distance_m": span})]
    if sizes[largest] > _LARGE or (span > 0.0 and sizes[largest] > _OUT_OF_SCALE * span):
        return [_large_mesh(hand, [i for i in sizes if sizes[i] > 0.5 * sizes[largest]], sizes[largest], span)]
    longest = max(sizes[i] for finger in hand.fingers for i in finger.links)
    if longest < _SMALL:
        text = f"The longest link of a finger is {longest:.4g} m: the lengths look as if they were scaled down twice."
        advice = "Look at the scale of the meshes in the model (scale=...): URDF and MJCF are in metres."
        return [Finding(FindingCode.LENGTHS_TOO_SMALL, text, advice, numbers={"longest_link_m": longest})]
    return []


def _large_mesh(hand: Hand, links: list[int], size: float, span: float) -> Finding:
    names = tuple(hand.links[i].name for i in links)
    apart = f" while joints are at most {span * 1e3:.3g} mm apart" if span > 0.0 else ""
    return Finding(
        FindingCode.LENGTHS_TOO_LARGE,
        f"Links {quoted(names)} are up to {size:.4g} m across{apart}: their meshes look like millimetres.",
        'Give the meshes a scale in the model: scale="0.001 0.001 0.001" (the same attribute in URDF and MJCF).',
        links=names,
        numbers={"size_m": size, "joint_distance_m": span},
    )


def _without_effort(hand: Hand) -> list[Finding]:
    """Name the joints of fingers whose torque nothing limits: no effort limit, and no largest tension of tendons."""
    pulled = hand.tendons.bounded if hand.tendons else ()
    led = {coupling.follower for coupling in hand.couplings}
    own = [j for finger in hand.fingers for j in finger.joints if j not in led and hand.joints[j].effort is None]
    said = {n for f in hand.findings if f.code is FindingCode.EFFORT_PLACEHOLDER for n in f.joints}
    names = tuple(name for name in (hand.joints[j].name for j in own) if name not in pulled and name not in said)
    if not names:
        return []
    text = f"Joints {quoted(names)}: no effort limits in the model; forces are planned as if there were none."
    advice = f"Nothing to do for contacts. {write_effort(names[0])}"
    return [Finding(FindingCode.EFFORT_MISSING, text, advice, Severity.NOTE, joints=names)]


def _size(hand: Hand, link: int) -> float:
    """Return the largest extent of a link along the axes of its frame, over all its shapes [m]."""
    shapes = [s for source in CollisionSource for s in hand.links[link].shapes.get(source, ())]
    if not shapes:
        return 0.0
    points = np.vstack([shape.to_mesh(1e-3).vertices for shape in shapes])
    return float(np.ptp(points, axis=0).max())


def _bare_joints(hand: Hand, finger: Finger) -> list[Finding]:
    """Name the closing joints that move nothing with a shape."""
    found = []
    for place, j in enumerate(finger.joints):
        after = set(finger.joints[place:])
        moved = [i for i in finger.links if _joint_of(hand, i) in after]
        if hand.joints[j].role is JointRole.CLOSING and not any(any(hand.links[i].shapes.values()) for i in moved):
            name = hand.joints[j].name
            text = f"Joint '{name}' of finger '{finger.name}' moves nothing that has a shape; it cannot touch."
            names = ", ".join(f'"{visible(hand.joints[k].name)}"' for k in finger.joints[:place])
            line = in_hand_file("fingers", finger.name, f"joints = [{names}]")
            advice = f"Give its link a shape in the model, or leave the joint out in the hand file, {line}."
            found.append(Finding(FindingCode.NO_SHAPE, text, advice, joints=(name,)))
    return found


def _joint_of(hand: Hand, link: int) -> int:
    """Return the nearest joint before a link, -1 when there is none."""
    while link >= 0 and hand.links[link].joint < 0:
        link = hand.links[link].parent
    return hand.links[link].joint if link >= 0 else -1


def _no_thumb(hand: Hand) -> Finding:
    line = in_hand_file("fingers", hand.fingers[0].name, "thumb = true")
    return Finding(
        FindingCode.NO_THUMB,
        "No finger could be told to be the thumb; an answer counts as a grasp only when every finger touches.",
        f"If one finger opposes the others, write in the hand file, for example {line}.",
        Severity.NOTE,
    )
