"""OpenUSD of a posed hand and object, with contacts and the grasp lines by which simulators know a graspable prop.

A grasp line is a linear `UsdGeom.BasisCurves` of two points that goes through the object, below the default prim
(SimReady's feature FET_005, requirement GSP.001).
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterable
from pathlib import Path
from typing import Any, Final

import numpy as np

from clench.core.pose import FloatArray, invert
from clench.models.appearance import Solid, rgb

from .scene_files import PosedScene

_CONTACT: Final = "#d55e00"
_LINE: Final = "#0072b2"
#: Width of contacts and of grasp lines [m].
_DOT: Final = 0.004
_WIDTH: Final = 0.002


def usd_bytes(scene: PosedScene, ending: str) -> bytes:
    """Return a scene as a USD file: z up, in metres, hand and object below the default prim `/World`.

    Args:
        scene: to write. ending: .usd and .usdc are binary, .usda is text.
    """
    from pxr import Usd, UsdGeom

    stage = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    world = UsdGeom.Xform.Define(stage, "/World")
    stage.SetDefaultPrim(world.GetPrim())
    solution = scene.solution
    hand = _frame(stage, "/World/hand", np.eye(4), solution.hand)
    hand.GetPrim().SetCustomDataByKey("status", solution.status.value)
    for name, angle in zip(_names(solution.joint_angles), solution.joint_angles.values(), strict=True):
        hand.GetPrim().SetCustomDataByKey(f"joint_angles:{name}", float(angle))
    for name, link, T in zip(_names(s.name for s in scene.links), scene.links, scene.link_poses, strict=True):
        _mesh(stage, f"/World/hand/{name}", link, T)
    _frame(stage, "/World/object", scene.object_pose, solution.object)
    bodies = [body for body in scene.bodies if len(body.mesh.triangles)]
    for name, body in zip(_names((b.name for b in bodies), taken=_line_names(scene)), bodies, strict=True):
        _mesh(stage, f"/World/object/{name}", body, np.eye(4))
    _contacts(stage, scene)
    _grasp_lines(stage, scene)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / f"scene{ending}"
        stage.GetRootLayer().Export(str(file))
        return file.read_bytes()


def _frame(stage: Any, path: str, T: FloatArray, told: str) -> Any:
    from pxr import Gf, UsdGeom

    frame = UsdGeom.Xform.Define(stage, path)
    frame.AddTransformOp().Set(Gf.Matrix4d(np.asarray(T).T.tolist()))  # USD multiplies rows from the left
    frame.GetPrim().SetDisplayName(told)
    return frame


def _mesh(stage: Any, path: str, solid: Solid, T: FloatArray) -> None:
    from pxr import UsdGeom, Vt

    frame = _frame(stage, path, T, solid.name)
    frame.GetPrim().SetCustomDataByKey("kind", solid.kind.value)
    mesh = UsdGeom.Mesh.Define(stage, f"{path}/mesh")
    mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(solid.mesh.vertices.astype(np.float32)))
    triangles = solid.mesh.triangles.astype(np.int32)
    mesh.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(np.full(len(triangles), 3, dtype=np.int32)))
    mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(np.ascontiguousarray(triangles.ravel())))
    mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    mesh.CreateDisplayColorAttr([rgb(solid.color)])


def _contacts(stage: Any, scene: PosedScene) -> None:
    """Write all contacts as points with normals, and the finger and link of each."""
    from pxr import Sdf, UsdGeom, Vt

    contacts = scene.solution.contacts
    points = UsdGeom.Points.Define(stage, "/World/contacts")
    places = np.array([c.position for c in contacts], dtype=np.float32).reshape(-1, 3)
    normals = np.array([c.normal for c in contacts], dtype=np.float32).reshape(-1, 3)
    points.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(places))
    points.CreateNormalsAttr(Vt.Vec3fArray.FromNumpy(normals))
    points.CreateWidthsAttr([_DOT] * len(contacts))
    points.CreateDisplayColorAttr([rgb(_CONTACT)])
    primvars = UsdGeom.PrimvarsAPI(points)
    for name, values in (("finger", [c.finger for c in contacts]), ("link", [c.link for c in contacts])):
        primvars.CreatePrimvar(name, Sdf.ValueTypeNames.StringArray, UsdGeom.Tokens.vertex).Set(values)


def _grasp_lines(stage: Any, scene: PosedScene) -> None:
    """Write the grasp lines below the object, in its frame: they move with it."""
    from pxr import UsdGeom, Vt

    T = invert(scene.object_pose)
    for name, line in zip(_line_names(scene), scene.grasp_lines, strict=True):
        curve = UsdGeom.BasisCurves.Define(stage, f"/World/object/{name}")
        curve.CreateTypeAttr(UsdGeom.Tokens.linear)
        curve.CreateCurveVertexCountsAttr([2])
        ends = (line @ T[:3, :3].T + T[:3, 3]).astype(np.float32)
        curve.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(ends)))
        curve.CreateWidthsAttr([_WIDTH])
        curve.SetWidthsInterpolation(UsdGeom.Tokens.constant)
        curve.CreateDisplayColorAttr([rgb(_LINE)])


def _line_names(scene: PosedScene) -> list[str]:
    return [f"grasp_identifier_{k}" if k else "grasp_identifier" for k in range(len(scene.grasp_lines))]


def _names(given: Iterable[str], taken: Iterable[str] = ()) -> list[str]:
    """Return names that USD allows, each once; the prims keep the given ones as what is displayed."""
    from pxr import Tf

    names: list[str] = []
    used = set(taken)
    for each in given:
        name = base = Tf.MakeValidIdentifier(each)
        k = 0
        while name in used:
            k += 1
            name = f"{base}_{k}"
        used.add(name)
        names.append(name)
    return names
