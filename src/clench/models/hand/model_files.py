"""Find a hand's model file and make it self-contained: one XML text and the bytes of every file it names."""

from __future__ import annotations

import os
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from clench.base.errors import FileError, UnknownNameError
from clench.base.files import read_file

from .mesh_files import MeshStore
from .named import find_named, how_to_get_more, known_names

_BUILTIN = Path(__file__).parent / "builtin"
_SUFFIXES = (".urdf", ".xml", ".mjcf")
#: Attributes of MJCF that hold numbers which decide where things are.
_NUMBERS = frozenset(
    (
        "pos",
        "quat",
        "euler",
        "axisangle",
        "xyaxes",
        "zaxis",
        "axis",
        "range",
        "size",
        "fromto",
        "ref",
        "scale",
        "polycoef",
    )
)


@dataclass(frozen=True)
class ModelText:
    """Hold a model that needs no other file.

    Args:
        name: of the model.
        path: the file, None for a built-in hand.
        label: how to name it in messages.
        xml: MJCF or URDF text that MuJoCo compiles with `assets`.
        assets: bytes of meshes and textures by the key that the text uses.
        is_urdf: which of the two formats the file has.
        velocities: velocity limits [rad/s] by joint name (URDF; MuJoCo drops them).
        hand_file: the hand file that a built-in hand brings along, if any.
        still: the angle [rad] of joints whose two limits are equal, by name (URDF; MuJoCo lets them turn freely).
    """

    name: str
    path: Path | None
    label: str
    xml: str
    assets: Mapping[str, bytes]
    is_urdf: bool
    hand_file: Path | None = None
    velocities: Mapping[str, float] = field(default_factory=dict)
    still: Mapping[str, float] = field(default_factory=dict)


def builtin_names() -> tuple[str, ...]:
    """Return the names of the hands that the package brings along."""
    return tuple(sorted(p.stem for p in _BUILTIN.glob("*.xml")))


def find_model(model: str | Path) -> tuple[Path, bool]:
    """Return the model's file, and whether it is a built-in one.

    Raises:
        UnknownNameError: neither a name nor a path. FileError: no such file, or another kind of file.
        HandError: a name whose files cannot be had, see `find_named`.
    """
    path = Path(model)
    if not str(model).strip():
        raise UnknownNameError("hand", str(model), "the built-in hands", builtin_names())
    if os.path.isfile(path):
        if path.suffix.lower() not in _SUFFIXES:
            raise FileError(model, f"expected a hand model ({', '.join(_SUFFIXES)}), got a '{path.suffix}' file.")
        return path, False
    if os.path.isdir(path):
        raise FileError(model, f"is a folder; expected a hand model file ({', '.join(_SUFFIXES)}).")
    if isinstance(model, str) and model in builtin_names():
        return _BUILTIN / f"{model}.xml", True
    if isinstance(model, str) and path.suffix.lower() not in _SUFFIXES:
        named = find_named(model)
        if named is not None:
            return named, False
    if path.suffix.lower() in _SUFFIXES or len(path.parts) > 1:
        raise FileError(model, f"no such file; expected a hand model ({', '.join(_SUFFIXES)}) or the name of a hand.")
    owner = f"the built-in hands, and no such file exists{how_to_get_more()}"
    raise UnknownNameError("hand", str(model), owner, (*builtin_names(), *known_names()))


def read_model(model: str | Path) -> ModelText:
    """Read a hand model and everything it names.

    Args:
        model: a built-in name or a path to URDF or MJCF.

    Raises:
        FileError: missing, unreadable or malformed file. UnknownNameError: no such built-in hand.
    """
    path, builtin = find_model(model)
    root = _parse(path)
    if root.tag == "robot":
        from .urdf import prepare_urdf, take_still_joints, velocity_limits

        velocities, still = velocity_limits(root), take_still_joints(root, path)
        assets = prepare_urdf(root, path)
    elif root.tag == "mujoco":
        velocities, still = {}, {}
        assets = _prepare_mjcf(root, path)
    else:
        raise FileError(path, f"root element <{root.tag}>; expected <robot> (URDF) or <mujoco> (MJCF).")
    own = path.with_suffix(".hand.toml")
    name = root.get("name") or root.get("model") or path.stem
    return ModelText(
        name=path.stem if builtin else name,
        path=None if builtin else path,
        label=f"built-in hand '{path.stem}'" if builtin else str(path),
        xml=ET.tostring(root, encoding="unicode"),
        assets=assets,
        is_urdf=root.tag == "robot",
        hand_file=own if builtin and own.is_file() else None,
        velocities=velocities,
        still=still,
    )


def _parse(path: Path) -> ET.Element:
    try:
        return ET.fromstring(read_file(path))
    except FileError:
        raise
    except (ET.ParseError, ValueError, LookupError) as error:
        raise FileError(path, f"not well-formed XML ({error}); expected URDF or MJCF.") from None


def _prepare_mjcf(root: ET.Element, path: Path) -> dict[str, bytes]:
    """Expand includes and rename every file of an MJCF tree to a key of the returned assets."""
    _expand_includes(root, path, depth=0)
    _refuse_nan(root, path)
    _name_bodies(root)
    folders = _asset_folders(root)
    store = MeshStore(path)
    for element in root.iter():
        file = element.get("file")
        if file is None or element.tag not in ("mesh", "texture", "hfield", "skin"):
            continue
        if folders["strip"]:
            file = Path(file).name
        folder = folders["texture" if element.tag == "texture" else "mesh"]
        owner = f"<{element.tag}> '{element.get('name', Path(file).stem)}'"
        if element.tag == "mesh" and element.get("name") is None:
            element.set("name", Path(file).stem)
        key = store.add(file, [path.parent / folder / file], owner, is_mesh=element.tag == "mesh")
        element.set("file", key)
        element.attrib.pop("content_type", None)
    return store.assets


def _refuse_nan(root: ET.Element, path: Path) -> None:
    """Refuse numbers that are none, which MuJoCo would take."""
    for element in root.iter():
        for key, text in element.attrib.items():
            if key in _NUMBERS and any(word.lower().lstrip("+-") == "nan" for word in text.split()):
                name = element.get("name", "")
                raise FileError(path, f"<{element.tag}> '{name}': {key} '{text}'; expected finite numbers.")


def _name_bodies(root: ET.Element) -> None:
    """Name what has no name, so that links and joints are found again in the compiled model."""
    bodies = [b for world in root.iter("worldbody") for b in world.iter("body")]
    taken = {b.get("name") for b in bodies} | {j.get("name") for b in bodies for j in b.findall("joint")}
    for number, body in enumerate(bodies, start=1):
        _name(body, f"body{number}", taken)
        for joint in body.findall("joint"):
            _name(joint, f"{body.get('name')}_joint", taken)


def _name(element: ET.Element, wanted: str, taken: set[str | None]) -> None:
    while element.get("name") is None:
        if wanted not in taken:
            element.set("name", wanted)
            taken.add(wanted)
        wanted += "_"


def _asset_folders(root: ET.Element) -> dict[str, str]:
    """Read and remove the compiler's folder settings, which the renamed files no longer need."""
    folders = {"mesh": "", "texture": "", "strip": ""}
    for compiler in root.iter("compiler"):
        both = compiler.attrib.pop("assetdir", None)
        mesh = compiler.attrib.pop("meshdir", both)
        texture = compiler.attrib.pop("texturedir", both)
        strip = compiler.attrib.pop("strippath", None)
        folders["mesh"] = folders["mesh"] if mesh is None else mesh
        folders["texture"] = folders["texture"] if texture is None else texture
        folders["strip"] = folders["strip"] if strip is None else strip.replace("false", "")
    return folders


def _expand_includes(element: ET.Element, main: Path, depth: int) -> None:
    """Replace `<include file=…/>` by the children of the included root, as MuJoCo does."""
    if depth > 20:
        raise FileError(main, "includes are nested more than 20 deep; a file seems to include itself.")
    for child in list(element):
        if child.tag != "include":
            _expand_includes(child, main, depth)
            continue
        file = main.parent / child.get("file", "")
        if not file.is_file():
            raise FileError(main, f"included file '{child.get('file', '')}' is missing; looked for {file}.")
        included = _parse(file)
        _expand_includes(included, main, depth + 1)
        place = list(element).index(child)
        element.remove(child)
        for offset, grandchild in enumerate(list(included)):
            element.insert(place + offset, grandchild)
