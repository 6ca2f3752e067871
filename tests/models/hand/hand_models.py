"""Small hand models written as text, for the loader's tests."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

PALM = '<geom name="palm_box" type="box" size="0.04 0.01 0.05"/>'


def finger(
    name: str,
    at: Sequence[float] = (0.0, 0.0, 0.05),
    lengths: Sequence[float] = (0.05, 0.03),
    axes: Sequence[str] | None = None,
    limits: Sequence[str] | None = None,
    attributes: str = "",
) -> str:
    """Return nested MJCF bodies along z, one hinge each; angles in rad."""
    axes = axes or ["1 0 0"] * len(lengths)
    limits = limits or ["0 1.6"] * len(lengths)
    text, place = "", " ".join(map(str, at))
    for k, (length, axis, limit) in enumerate(zip(lengths, axes, limits, strict=True)):
        text += (
            f'<body name="{name}_link{k}" pos="{place}">'
            f'<joint name="{name}_j{k}" axis="{axis}" range="{limit}" {attributes}/>'
            f'<geom type="capsule" size="0.008" fromto="0 0 0.008 0 0 {length - 0.004}"/>'
        )
        place = f"0 0 {length}"
    return text + "</body>" * len(lengths)


def hand(*fingers: str, extra: str = "", palm: str = PALM, before: str = "", after: str = "") -> str:
    """Return MJCF of a palm with fingers; `before` and `after` wrap the palm in bodies, `extra` follows the world."""
    return (
        '<mujoco model="test hand"><compiler angle="radian" autolimits="true"/><worldbody>'
        f'{before}<body name="palm">{palm}{"".join(fingers)}</body>{after}</worldbody>{extra}</mujoco>'
    )


def three_fingers(extra: str = "") -> str:
    """Return index and middle with two joints each, and a thumb that faces them."""
    return hand(
        finger("index", (0.02, 0.0, 0.05)),
        finger("middle", (-0.02, 0.0, 0.05)),
        finger("thumb", (0.0, -0.04, 0.03), axes=["-1 0 0"] * 2),
        extra=extra,
    )


def urdf_joint(
    name: str, parent: str, child: str, at: str = "0 0 0.05", extra: str = "", kind: str = "revolute"
) -> str:
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{at}" rpy="0.1 -0.2 0.3"/><axis xyz="1 0 0"/>'
        f'<limit lower="-0.2" upper="1.5" effort="2.5" velocity="3.5"/>{extra}</joint>'
    )


def urdf_link(name: str, geometry: str = '<box size="0.02 0.02 0.05"/>') -> str:
    return (
        f'<link name="{name}"><inertial><mass value="0.1"/><inertia ixx="1e-5" iyy="1e-5" izz="1e-5" ixy="0" '
        f'ixz="0" iyz="0"/></inertial><collision><geometry>{geometry}</geometry></collision></link>'
    )


def urdf_hand(mimic: str = '<mimic joint="a1" multiplier="0.8" offset="0.1"/>', geometry: str = "") -> str:
    """Return URDF of two fingers `a` and `b`; the last joint of `a` mimics its first."""
    box = '<box size="0.02 0.02 0.05"/>'
    links = "".join(urdf_link(n, box) for n in ("palm", "a_1", "a_2", "b_1"))
    return (
        f'<robot name="two">{links}{urdf_link("b_2", geometry or box)}{urdf_joint("a1", "palm", "a_1", "0.03 0 0.05")}'
        f"{urdf_joint('a2', 'a_1', 'a_2', extra=mimic)}{urdf_joint('b1', 'palm', 'b_1', '-0.03 0 0.05')}"
        f"{urdf_joint('b2', 'b_1', 'b_2')}</robot>"
    )


def written(folder: Path, text: str, name: str = "hand.xml") -> Path:
    """Write a model file and return its path."""
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
    return path
