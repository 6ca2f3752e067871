"""Refuse errors of a URDF tree, and name the link or joint."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections import Counter
from pathlib import Path

from clench.core.exceptions import FileError, UnknownNameError
from clench.core.files.file_limits import MODEL_BODIES

_JOINT_TYPES = ("revolute", "continuous", "prismatic", "fixed", "floating", "planar")
_SHAPES = {
    "box": ("size", 3),
    "cylinder": ("radius length", 1),
    "sphere": ("radius", 1),
    "capsule": ("radius length", 1),
}


def check_urdf(root: ET.Element, path: Path) -> None:
    """Look at names, joints, axes, origins, mimic joints and shapes of a URDF tree.

    Raises:
        FileError: something is missing, there twice or no number. UnknownNameError: a joint mimics an unknown joint.
    """
    if any("xacro" in element.tag for element in root.iter() if isinstance(element.tag, str)):
        raise FileError(path, "is a xacro template; expected plain URDF (expand it with the xacro program first).")
    links = _names(root, "link", path)
    if not links:
        raise FileError(path, "has no <link>; expected a URDF hand.")
    if len(links) > MODEL_BODIES:
        raise FileError(path, f"has {len(links)} links; expected a hand, or a robot of up to {MODEL_BODIES} links.")
    joints = _names(root, "joint", path)
    for joint in root.findall("joint"):
        _check_ends(joint, links, path)
        if joint.get("type") not in _JOINT_TYPES:
            expected = ", ".join(_JOINT_TYPES)
            raise FileError(path, f"joint '{joint.get('name')}' has type '{joint.get('type')}'; expected {expected}.")
        if joint.get("type") != "fixed":
            _check_axis(joint, path)
        _check_mimic(joint, joints, path)
        _check_origin(joint, f"joint '{joint.get('name')}'", path)
    _check_tree(root, links, path)
    for link in root.findall("link"):
        _check_mass(link, path)
        for kind in ("visual", "collision"):
            for element in link.findall(kind):
                where = f"{kind} of link '{link.get('name')}'"
                _check_origin(element, where, path)
                _check_shape(element.find("geometry"), where, path)


def _names(root: ET.Element, kind: str, path: Path) -> list[str]:
    """Return the names of all links or joints, each there once."""
    names = []
    for number, element in enumerate(root.findall(kind), start=1):
        name = element.get("name")
        if not name:
            raise FileError(path, f"{kind} number {number} has no name.")
        names.append(name)
    twice = [name for name, count in Counter(names).items() if count > 1]
    if twice:
        raise FileError(path, f"{kind} '{twice[0]}' is there twice; names have to differ.")
    return names


def _check_ends(joint: ET.Element, links: list[str], path: Path) -> None:
    for end in ("parent", "child"):
        element = joint.find(end)
        link = None if element is None else element.get("link")
        if link not in links:
            known = ", ".join(sorted(links))
            what = f"no {end} link" if link is None else f"the {end} link '{link}', which does not exist"
            raise FileError(path, f"joint '{joint.get('name')}' names {what}. Links: {known}.")


def _check_tree(root: ET.Element, links: list[str], path: Path) -> None:
    """Refuse a link that two joints move, and joints that go round in a circle."""
    parents: dict[str, tuple[str, str]] = {}
    for joint in root.findall("joint"):
        parent, child = (_link_of(joint, end) for end in ("parent", "child"))
        name = joint.get("name", "")
        if child in parents:
            raise FileError(
                path,
                f"link '{child}' is the child of two joints, '{parents[child][1]}' and '{name}': a closed linkage; "
                "model it as coupled joints (mimic) instead.",
            )
        parents[child] = (parent, name)
    if all(link in parents for link in links):
        raise FileError(path, "every link is the child of a joint: the joints go round in a circle, there is no root.")


def _link_of(joint: ET.Element, end: str) -> str:
    element = joint.find(end)
    return "" if element is None else element.get("link", "")


def _check_axis(joint: ET.Element, path: Path) -> None:
    axis = joint.find("axis")
    text = "1 0 0" if axis is None else axis.get("xyz", "1 0 0")
    numbers = _numbers(text)
    if len(numbers) != 3 or not any(numbers):
        name = joint.get("name")
        raise FileError(path, f"joint '{name}': axis '{text}'; expected a direction, three numbers that are not all 0.")


def _check_mimic(joint: ET.Element, joints: list[str], path: Path) -> None:
    mimic = joint.find("mimic")
    if mimic is None:
        return
    name, leader = joint.get("name", ""), mimic.get("joint", "")
    if leader not in joints:
        raise UnknownNameError("joint", leader, f"{path} (mimicked by '{name}')", joints)
    if leader == name:
        raise FileError(path, f"joint '{name}' mimics itself.")
    for key in ("multiplier", "offset"):
        text = mimic.get(key)
        if text is not None and len(_numbers(text)) != 1:
            raise FileError(path, f"joint '{name}': {key} '{text}' of its mimic; expected a finite number.")


def _check_mass(link: ET.Element, path: Path) -> None:
    mass = link.find("inertial/mass")
    text = "0" if mass is None else mass.get("value", "")
    numbers = _numbers(text)
    if len(numbers) != 1 or numbers[0] < 0.0:
        raise FileError(path, f"mass of link '{link.get('name')}' is '{text}'; expected a number of at least 0 [kg].")


def _check_origin(element: ET.Element, where: str, path: Path) -> None:
    origin = element.find("origin")
    for key in () if origin is None else ("xyz", "rpy"):
        text = None if origin is None else origin.get(key)
        if text is not None and len(_numbers(text)) != 3:
            raise FileError(path, f"{where}: origin {key} '{text}'; expected three finite numbers.")


def _check_shape(geometry: ET.Element | None, where: str, path: Path) -> None:
    kinds = [] if geometry is None else [child for child in geometry if child.tag in (*_SHAPES, "mesh")]
    if not kinds:
        raise FileError(path, f"{where}: no geometry; expected one of {', '.join((*_SHAPES, 'mesh'))}.")
    shape = kinds[0]
    if shape.tag == "mesh":
        scale = _numbers(shape.get("scale", "1 1 1"))
        if not shape.get("filename"):
            raise FileError(path, f"{where}: its mesh names no file (filename).")
        if len(scale) != 3 or not all(scale):
            raise FileError(path, f"{where}: mesh scale '{shape.get('scale')}'; expected three numbers other than 0.")
        return
    keys, count = _SHAPES[shape.tag]
    for key in keys.split():
        numbers = _numbers(shape.get(key, ""))
        if len(numbers) != count or min(numbers) <= 0.0:
            expected = "three positive numbers" if count == 3 else "a positive number"
            raise FileError(path, f"{where}: {shape.tag} {key} '{shape.get(key, '')}'; expected {expected} [m].")


def _numbers(text: str) -> list[float]:
    """Return the numbers of a text, or nothing if a word is no finite number."""
    try:
        numbers = [float(word) for word in text.split()]
    except ValueError:
        return []
    return numbers if all(map(math.isfinite, numbers)) else []
