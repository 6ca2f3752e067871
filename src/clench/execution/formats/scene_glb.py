"""Binary glTF of a posed hand and object: a node for every link and body, and one for every contact."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from clench.core.pose import FloatArray
from clench.models.appearance import Solid, rgb

from .scene_files import PosedScene

#: glTF's y axis is up, ours is z.
Y_UP: Final = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])
_CONTACT: Final = "#d55e00"
#: Radius and length of the mark of a contact [m].
_RADIUS: Final = 1.5e-3
_LENGTH: Final = 0.015
#: The object shows what is behind it [-].
_OBJECT: Final = 0.7


def glb_bytes(scene: PosedScene) -> bytes:
    """Return a scene as a GLB file: y up, in metres; nodes have the names of links and bodies."""
    import trimesh

    made = trimesh.Scene(base_frame="world")
    made.metadata.update(_told(scene))
    for link, T in zip(scene.links, scene.link_poses, strict=True):
        _add(made, link, T, 1.0)
    for body in scene.bodies:
        _add(made, body, scene.object_pose, _OBJECT if body.kind.value == "object" else 1.0)
    for k, contact in enumerate(scene.solution.contacts, start=1):
        mark = trimesh.creation.cone(radius=_RADIUS, height=_LENGTH, sections=16)
        mark.visual = trimesh.visual.TextureVisuals(material=_material(_CONTACT, 1.0))
        T = trimesh.geometry.align_vectors([0.0, 0.0, 1.0], contact.normal)
        T[:3, 3] = contact.position
        made.add_geometry(mark, node_name=f"contact_{k}", geom_name=f"contact_{k}", transform=Y_UP @ T)
    content: bytes = made.export(file_type="glb")
    return content


def _add(made: Any, solid: Solid, T: FloatArray, alpha: float) -> None:
    import trimesh

    if not len(solid.mesh.triangles):
        return
    mesh = trimesh.Trimesh(solid.mesh.vertices, solid.mesh.triangles, process=False)
    mesh.visual = trimesh.visual.TextureVisuals(material=_material(solid.color, alpha))
    name = f"{'hand' if solid.of_hand else 'object'}/{solid.name}"
    made.add_geometry(mesh, node_name=name, geom_name=name, transform=Y_UP @ T)


def _material(color: str, alpha: float) -> Any:
    import trimesh

    return trimesh.visual.material.PBRMaterial(
        baseColorFactor=[*(round(255 * c) for c in rgb(color)), round(255 * alpha)],
        metallicFactor=0.0,
        roughnessFactor=0.6,
        alphaMode="BLEND" if alpha < 1.0 else "OPAQUE",
        doubleSided=True,
    )


def _told(scene: PosedScene) -> dict[str, Any]:
    """Return what the file says of the grasp, besides its shapes."""
    solution = scene.solution
    return {
        "generator": f"clench {solution.clench_version}",
        "hand": solution.hand,
        "object": solution.object,
        "status": solution.status.value,
        "joint_angles": dict(solution.joint_angles),
    }
