"""Read the joints' limits and axes as the model states them, and report doubtful ones."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from clench.models.hand.findings import Finding, FindingCode, in_hand_file, quoted

if TYPE_CHECKING:
    from clench.models.hand.hand_file import JointOverride

    from .compiled import CompiledModel

#: Ranges above a whole turn are placeholders, not limits [rad].
_FULL_TURN = 2 * np.pi
#: Hands whose joints all turn less are likely misread: 2 pi degrees [rad].
_DEGREES_MISREAD = np.deg2rad(2 * np.pi)
#: Efforts above this are placeholders for a finger [Nm].
EFFORT_PLACEHOLDER = 1e3
#: Axes whose length differs from 1 by more than rounding in a file [-].
_UNIT = 1e-3


def joint_limits(compiled: CompiledModel, joint: int) -> tuple[float, float]:
    """Return the limits [rad] that hold for a joint; a whole turn where the model gives none."""
    m = compiled.model
    still = compiled.stated.still.get(compiled.joint_name(joint))
    if still is not None:
        return still, still
    if not m.jnt_limited[joint]:
        return -np.pi, np.pi
    return float(m.jnt_range[joint, 0]), float(m.jnt_range[joint, 1])


def doubtful_joints(
    compiled: CompiledModel, joints: Iterable[int], efforts: Mapping[int, float], overrides: Mapping[str, JointOverride]
) -> list[Finding]:
    """Return a finding for each kind of limit, axis or effort that is missing or looks wrong.

    Args:
        compiled: the model. joints: MuJoCo's indices of the kept ones. efforts: limits [Nm], by number.
        overrides: what the hand file says of joints, by name.
    """
    m = compiled.model
    given = {name for name, joint in overrides.items() if joint.limits is not None}
    driven = {name for name, joint in overrides.items() if joint.effort is not None}
    names = {j: compiled.joint_name(j) for j in joints}
    stated = compiled.stated
    free = [n for j, n in names.items() if not m.jnt_limited[j] and n not in stated.still and n not in given]
    ranges = {n: float(np.ptp(m.jnt_range[j])) for j, n in names.items() if m.jnt_limited[j] and n not in given}
    wide = {n: width for n, width in ranges.items() if width > _FULL_TURN}
    strong = {n: efforts[j] for j, n in names.items() if efforts.get(j, 0.0) > EFFORT_PLACEHOLDER and n not in driven}
    findings = [*_missing(free), *_too_wide(wide), *_strong(strong)]
    for n in names.values():
        if n in stated.reversed and n not in given:
            findings.append(_reversed(n, *stated.reversed[n]))
        if n in stated.still and n not in given:
            findings.append(_still(n, stated.still[n]))
        if abs(stated.axis_lengths.get(n, 1.0) - 1.0) > _UNIT:
            findings.append(_not_unit(n, stated.axis_lengths[n]))
    if ranges and max(ranges.values()) < _DEGREES_MISREAD:
        findings.append(_too_narrow(ranges))
    return findings


def _write(name: str) -> str:
    line = in_hand_file("joints", name, "limits = [lower, upper]")
    return f"Write the true limits [rad] in the model, or in the hand file, {line}."


def write_effort(name: str) -> str:
    """Return the advice to give a joint its effort limit."""
    line = in_hand_file("joints", name, "effort = torque")
    return f"If forces matter to you, write the true effort limits [Nm] in the model, or in the hand file, {line}."


def _missing(names: list[str]) -> list[Finding]:
    if not names:
        return []
    text = f"Joints {quoted(names)}: no limits in the model; -pi to pi is taken."
    advice = f"Fingers close until something stops them, however far that is. {_write(names[0])}"
    return [Finding(FindingCode.LIMITS_MISSING, text, advice, joints=tuple(names))]


def _too_wide(widths: Mapping[str, float]) -> list[Finding]:
    if not widths:
        return []
    text = f"Joints {quoted(list(widths))}: may turn by more than a whole turn: the limits look like placeholders."
    numbers = {"widest_rad": max(widths.values())}
    return [
        Finding(
            FindingCode.LIMITS_TOO_WIDE,
            text,
            _write(next(iter(widths))),
            joints=tuple(widths),
            numbers=numbers,
        )
    ]


def _strong(efforts: Mapping[str, float]) -> list[Finding]:
    if not efforts:
        return []
    text = (
        f"Joints {quoted(list(efforts))}: effort limits above {EFFORT_PLACEHOLDER:.0f} Nm look like placeholders; "
        "taken as none."
    )
    advice = f"{write_effort(next(iter(efforts)))} Contacts do not depend on them."
    numbers = {"largest_Nm": max(efforts.values())}
    return [Finding(FindingCode.EFFORT_PLACEHOLDER, text, advice, joints=tuple(efforts), numbers=numbers)]


def _reversed(name: str, low: float, high: float) -> Finding:
    text = (
        f"Joint '{name}': its limits are reversed in the model ({low:.6g} to {high:.6g} rad); they are taken swapped."
    )
    advice = f"Correct the model: {high:.6g} to {low:.6g} rad. If the sign of the angle was meant, turn the axis round."
    numbers = {"lower_rad": low, "upper_rad": high}
    return Finding(FindingCode.LIMITS_REVERSED, text, advice, joints=(name,), numbers=numbers)


def _still(name: str, angle: float) -> Finding:
    text = f"Joint '{name}': both limits are {angle:.6g} rad, so it does not move."
    advice = f"Nothing to do if it is fixed on the real hand. {_write(name)}"
    numbers = {"angle_rad": angle}
    return Finding(FindingCode.LIMITS_ZERO_WIDTH, text, advice, joints=(name,), numbers=numbers)


def _not_unit(name: str, length: float) -> Finding:
    text = f"Joint '{name}': its axis has length {length:.6g} in the model; its direction is taken."
    advice = "Correct the model if a component was mistyped; other programs may scale the motion by the length."
    return Finding(FindingCode.AXIS_NOT_UNIT, text, advice, joints=(name,), numbers={"length": length})


def _too_narrow(ranges: Mapping[str, float]) -> Finding:
    text = (
        "No joint may turn by more than a few degrees: the limits look like radians read as degrees "
        '(in MJCF, <compiler angle="radian"/>).'
    )
    advice = 'Write <compiler angle="radian"/> in the model, or give the limits in degrees.'
    numbers = {"widest_rad": max(ranges.values())}
    return Finding(FindingCode.LIMITS_TOO_NARROW, text, advice, joints=tuple(ranges), numbers=numbers)
