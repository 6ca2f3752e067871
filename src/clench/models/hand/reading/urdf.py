"""Make a URDF tree fit for MuJoCo: mesh paths, repeated elements, compiler settings."""

from __future__ import annotations

import math
import os
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from pathlib import Path

from clench.core.exceptions import FileError

from .mesh_files import MeshStore
from .urdf_checks import check_urdf

#: Keep every link and visual, accept the inertias that CAD exports leave.
_COMPILER = {
    "balanceinertia": "true",
    "fusestatic": "false",
    "discardvisual": "false",
    "strippath": "false",
    "boundmass": "1e-6",
    "boundinertia": "1e-12",
}


def prepare_urdf(root: ET.Element, path: Path) -> dict[str, bytes]:
    """Change a URDF tree in place so that MuJoCo reads it with the returned assets.

    Raises:
        FileError: see `check_urdf`; or a file is missing.
    """
    check_urdf(root, path)
    for link in root.iter("link"):
        for extra in link.findall("inertial")[1:]:
            link.remove(extra)
    mesh_folders = [c.get("meshdir", "") for m in root.findall("mujoco") for c in m.findall("compiler")]
    for tag in ("mujoco", "gazebo", "transmission", "ros2_control"):
        for element in root.findall(tag):
            root.remove(element)
    for material in root.iter("material"):
        for texture in material.findall("texture"):
            material.remove(texture)
    store = MeshStore(path)
    for link in root.iter("link"):
        for mesh in link.iter("mesh"):
            named = mesh.get("filename", "")
            places = _places(named, path) + [path.parent / d / Path(named).name for d in mesh_folders]
            mesh.set("filename", store.add(named, places, f"link '{link.get('name')}'"))
    extension = ET.Element("mujoco")
    ET.SubElement(extension, "compiler", _COMPILER)
    root.insert(0, extension)
    return store.assets


def velocity_limits(root: ET.Element) -> dict[str, float]:
    """Return the velocity limits [rad/s] that a URDF tree gives, by joint name."""
    limits: dict[str, float] = {}
    for joint in root.findall("joint"):
        limit = joint.find("limit")
        text = None if limit is None else limit.get("velocity")
        try:
            value = float(text) if text is not None else 0.0
        except ValueError:
            value = 0.0
        if 0.0 < value < math.inf:
            limits[joint.get("name", "")] = value
    return limits


def take_still_joints(root: ET.Element, path: Path) -> dict[str, float]:
    """Return the angle [rad] of revolute joints whose two limits are equal, and take these limits out of the tree.

    Raises:
        FileError: a limit is no number.
    """
    still: dict[str, float] = {}
    for joint in root.findall("joint"):
        limit = joint.find("limit")
        if limit is None or joint.get("type") != "revolute":
            continue
        ends = [_limit(joint, limit, key, path) for key in ("lower", "upper") if limit.get(key) is not None]
        if len(ends) == 2 and ends[0] == ends[1]:
            still[joint.get("name", "")] = ends[0]
            del limit.attrib["lower"], limit.attrib["upper"]
    return still


def _limit(joint: ET.Element, limit: ET.Element, key: str, path: Path) -> float:
    text = limit.get(key, "")
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise FileError(path, f"joint '{joint.get('name')}': {key} limit '{text}'; expected a finite number [rad].")
    return value


def _places(named: str, path: Path) -> list[Path]:
    """Return where a mesh may be, most likely first; `package://` is looked for upwards from the model."""
    if named.startswith("file://"):
        named = named.removeprefix("file://")
    if not named.startswith("package://"):
        return [path.parent / named] if not os.path.isabs(named) else [Path(named)]
    whole = named.removeprefix("package://")
    inside = whole.partition("/")[2]
    return list(_package_places(whole, inside, path.resolve().parent))


def _package_places(whole: str, inside: str, folder: Path) -> Iterator[Path]:
    for ancestor in (folder, *folder.parents):
        yield ancestor / inside
        yield ancestor / whole
    for root in os.environ.get("ROS_PACKAGE_PATH", "").split(os.pathsep):
        if root:
            yield Path(root) / whole
            yield Path(root) / inside
