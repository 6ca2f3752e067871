"""Find a hand's model file and make it self-contained: one XML text and the bytes of every file it names."""

from __future__ import annotations

import os
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from clench.core.exceptions import FileError, UnknownNameError
from clench.core.files.file_bytes import expanded
from clench.core.files.file_limits import MODEL_BYTES
from clench.core.files.xml_files import check_xml, read_xml

from .mesh_files import MeshStore
from .mjcf_checks import check_mjcf
from .named import find_named, how_to_get_more, known_names
from .odd_numbers import refuse_odd_numbers

_BUILTIN = Path(__file__).parents[1] / "builtin"
_SUFFIXES = (".urdf", ".xml", ".mjcf")
_EXPECTED = "URDF or MJCF"
#: Elements of MJCF that name files, and the attributes that do.
_FILES = {
    **dict.fromkeys(("mesh", "hfield", "skin", "flexcomp"), ("file",)),
    "texture": ("file", *(f"file{side}" for side in ("right", "left", "up", "down", "front", "back"))),
}


@dataclass(frozen=True)
class ModelText:
    """The text of a hand model with all its assets, so that it needs no other file.

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
        UnknownNameError: the text is neither a name nor a path. FileError: no such file, or another kind of file.
        HandError: a name whose files cannot be had, see `find_named`.
    """
    path = expanded(model)
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
    root, size = read_xml(path, _EXPECTED)
    if root.tag == "robot":
        from .urdf import prepare_urdf, take_still_joints, velocity_limits

        velocities, still = velocity_limits(root), take_still_joints(root, path)
        assets = prepare_urdf(root, path)
        refuse_odd_numbers(root, path)
    elif root.tag == "mujoco":
        velocities, still = {}, {}
        assets = _prepare_mjcf(root, path, size)
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


def _prepare_mjcf(root: ET.Element, path: Path, size: int) -> dict[str, bytes]:
    """Expand includes and rename every file of an MJCF tree to a key of the returned assets."""
    _expand_includes(root, path, {path.resolve(): size})
    check_xml(root, path)
    refuse_odd_numbers(root, path)
    check_mjcf(root, path)
    _name_bodies(root)
    folders = _asset_folders(root)
    store = MeshStore(path)
    for element in root.iter():
        for attribute in _FILES.get(element.tag, ()):
            if attribute in element.attrib:
                _store_file(element, attribute, path.parent, folders, store)
    return store.assets


def _store_file(element: ET.Element, attribute: str, parent: Path, folders: dict[str, str], store: MeshStore) -> None:
    """Read the file that an attribute names, and put its key in the attribute."""
    file = element.get(attribute, "")
    if folders["strip"]:
        file = Path(file).name
    folder = folders["texture" if element.tag == "texture" else "mesh"]
    owner = f"<{element.tag}> '{element.get('name', Path(file).stem)}'"
    if element.tag == "mesh" and element.get("name") is None:
        element.set("name", Path(file).stem)
    element.set(attribute, store.add(file, [parent / folder / file], owner, is_mesh=element.tag == "mesh"))
    element.attrib.pop("content_type", None)


def _name_bodies(root: ET.Element) -> None:
    """Name nameless elements, so that links and joints are found again in the compiled model."""
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


def _expand_includes(root: ET.Element, main: Path, sizes: dict[Path, int]) -> None:
    """Replace `<include file=…/>` by the children of the included root; each file is included once, as in MuJoCo.

    Args:
        root: of the tree that is changed. main: the model file. sizes: of the files so far [bytes].
    """
    waiting = [root]
    while waiting:
        element = waiting.pop()
        while (child := element.find("include")) is not None:
            place = list(element).index(child)
            element[place : place + 1] = list(_included(child.get("file", ""), main, sizes))
        waiting.extend(element)


def _included(named: str, main: Path, sizes: dict[Path, int]) -> ET.Element:
    file = main.parent / named
    if not os.path.isfile(file):  # a name from a file may be one that no file can have
        raise FileError(main, f"included file '{named}' is missing; looked for {file}.")
    if file.resolve() in sizes:
        raise FileError(main, f"file '{named}' is included twice; MuJoCo allows each file once.")
    included, sizes[file.resolve()] = read_xml(file, _EXPECTED)
    if sum(sizes.values()) > MODEL_BYTES:
        raise FileError(main, f"has more than {MODEL_BYTES >> 20} MB together with the files that it includes.")
    return included
