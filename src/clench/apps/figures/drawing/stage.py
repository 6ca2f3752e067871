"""A stage with hand and object that is photographed: by MuJoCo's renderer, or plainly where there is no OpenGL."""

from __future__ import annotations

import warnings
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from types import TracebackType
from typing import Any, Final, Self

import numpy as np
from numpy.typing import NDArray

from clench.core.pose import FloatArray, Pose
from clench.core.rendering.offscreen import Offscreen
from clench.core.rendering.opengl import OpenGLError, import_mujoco
from clench.models.appearance import Solid, SolidKind, hand_solids, object_solids, rgb, solid_pose, thinned
from clench.models.hand.hand import Hand
from clench.models.mesh import TriangleMesh
from clench.models.objects.grasp_object import GraspObject
from clench.models.shapes import CollisionSource
from clench.solver.solution import GraspSolution

from .camera import Camera, Picture, Sight
from .plain import paint

#: A scene of lights alone; the key light follows the camera. Edges are smoothed by drawing twice the size.
_LIGHTS: Final = """
<mujoco>
  <visual>
    <headlight ambient="0.46 0.46 0.47" diffuse="0.36 0.36 0.36" specular="0 0 0"/>
    <quality offsamples="0" shadowsize="4096"/>
  </visual>
  <worldbody>
    <light directional="true" castshadow="true" ambient="0 0 0" diffuse="0.36 0.36 0.35" specular="0.22 0.22 0.22"/>
  </worldbody>
</mujoco>"""
#: Where the key light comes from: shares of towards the viewer, to the right and up in the picture.
_KEY: Final = (1.0, -0.55, 0.95)
#: Size at first; pictures of another size take little more [px].
_SIZE: Final = (640, 640)
_SHININESS: Final = 0.35
#: The camera sees farther than the shown solids by this [m].
_ROOM: Final = 0.02
#: Points that stand for a solid lie on a grid of this width [m]; on a small solid, on a grid of so many cells.
_GRID: Final = 3e-3
_CELLS: Final = 4.0
#: The shadow map of a scene spans this at least [m]: MuJoCo ends the process where it spans nothing.
_LEAST_EXTENT: Final = 1e-6

#: Triangles of a plain picture, about, and of one in which only contacts are looked for.
_PLAIN_TRIANGLES: Final = 40_000
_FEW_TRIANGLES: Final = 3_000
#: A mesh of MuJoCo has at least so many corners.
_LEAST_CORNERS: Final = 4
#: Surfaces of two solids that coincide flicker: one is nearer by a step [m], of so many.
_LAYER: Final = 1e-4
_LAYERS: Final = 7
#: Why pictures are plain, as far as it was said.
_told: set[str] = set()
_KINDS: Final = tuple(SolidKind)


@dataclass(frozen=True, eq=False)
class _Model:
    """A compiled model of a stage: its state, and the solid of every geom; the last one, -1, is of none."""

    model: Any
    data: Any
    solid_of_geom: NDArray[np.int64]


class Stage:
    """Hand and object to be photographed; close it, or use it in a `with` statement.

    Without OpenGL, pictures are plain, and a warning says so once.

    Args:
        solids: the solids on the stage. poses: of the solids in the world, shape (N, 4, 4).
    """

    def __init__(self, solids: Sequence[Solid], poses: FloatArray) -> None:
        self.solids = tuple(solid for solid in solids if len(solid.mesh.triangles))
        self._numbers = [k for k, solid in enumerate(solids) if len(solid.mesh.triangles)]
        self._samples = [_sampled(solid.mesh.vertices) for solid in self.solids]
        self._renderer: Offscreen | None = None
        self._thinned: dict[int, list[TriangleMesh]] = {}
        try:
            self._model = _compiled(self.solids)
            self._renderer = Offscreen(self._model.model, *_SIZE)
        except OpenGLError as error:
            _warn_plain(f"OpenGL cannot draw here ({error}). Without a screen, install Mesa's libegl1.")
        except ValueError as error:
            _warn_plain(f"MuJoCo cannot draw these meshes ({' '.join(str(error).split())}).")
        self.pose(poses)

    @classmethod
    def of(cls, hand: Hand, obj: GraspObject, solution: GraspSolution) -> Stage:
        """Return the stage of a solution: the geometry that was solved, closed."""
        solids = solution_solids(hand, obj, solution)
        return cls(solids, solution_poses(hand, solids, solution))

    @classmethod
    def open(cls, hand: Hand, source: CollisionSource | None = None) -> Stage:
        """Return the stage of an open hand in the frame of its palm, with its default geometry or another one."""
        solids = hand_solids(hand, hand.default_source if source is None else source)
        links = hand.link_poses(hand.open_angles())
        return cls(solids, np.array([links[solid.index] for solid in solids]).reshape(-1, 4, 4))

    def pose(self, poses: FloatArray) -> None:
        """Move the solids, shape (N, 4, 4)."""
        self.poses = np.asarray(poses)[self._numbers]
        if self._renderer is None:
            return
        data = self._model.data
        for k, T in enumerate(self.poses):
            data.mocap_quat[k] = Pose.from_matrix(T).wxyz
        near = self.points(SolidKind.HAND, SolidKind.OBJECT)
        low, high = (near.min(axis=0), near.max(axis=0)) if len(near) else (np.zeros(3), np.ones(3))
        self._middle = 0.5 * (low + high)
        # The shadow map spans this extent.
        self._model.model.stat.extent = max(float(np.linalg.norm(high - low)), _LEAST_EXTENT)

    def points(self, *kinds: SolidKind) -> FloatArray:
        """Return points of the solids of some kinds in the world [m], one of every few millimetres, shape (N, 3)."""
        return self.points_of([k for k, solid in enumerate(self.solids) if solid.kind in kinds])

    def points_of(self, numbers: Sequence[int]) -> FloatArray:
        """Return the same of some solids by number."""
        placed = [self._samples[k] @ self.poses[k][:3, :3].T + self.poses[k][:3, 3] for k in numbers]
        return np.concatenate([np.empty((0, 3)), *placed])

    def sight(self, camera: Camera, without: Collection[SolidKind] = ()) -> Sight:
        """Return the nearest solids of a camera's pixels, without some kinds; much quicker than a picture."""
        if self._renderer is None:
            return self._painted(camera, without, _FEW_TRIANGLES)
        near, far = self._aim(camera, without)
        geom, nearness = self._renderer.draw_geoms()
        solid = self._model.solid_of_geom[geom]
        return Sight(np.where(solid >= 0, far + nearness.astype(np.float64) * (near - far), -np.inf), solid)

    def picture(self, camera: Camera, without: Collection[SolidKind] = ()) -> Picture:
        """Return the picture of a camera, without the solids of some kinds."""
        if self._renderer is None:
            return self._painted(camera, without, _PLAIN_TRIANGLES)
        sight = self.sight(camera, without)
        image = self._renderer.draw()[0].astype(np.float32) * np.float32(1.0 / 255.0)
        image[sight.solid < 0] = 1.0
        return Picture(sight.nearness, sight.solid, image)

    def _painted(self, camera: Camera, without: Collection[SolidKind], most: int) -> Picture:
        if most not in self._thinned:
            share = most / max(sum(len(solid.mesh.triangles) for solid in self.solids), 1)
            self._thinned[most] = [thinned(s.mesh, max(int(share * len(s.mesh.triangles)), 40)) for s in self.solids]
        shown = [k for k, solid in enumerate(self.solids) if solid.kind not in without]
        return paint(self.solids, self._thinned[most], self.poses, shown, camera)

    def close(self) -> None:
        """Free the memory of the graphics library."""
        if self._renderer is not None:
            self._renderer.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _depths(self, camera: Camera) -> tuple[float, float]:
        """Return nearness of the nearest and of the farthest point that may be seen [m]."""
        along = np.concatenate([*(self.points(kind) for kind in _KINDS), camera.center[None]]) - camera.center
        depth = along @ camera.towards
        return float(depth.max()) + _ROOM, float(depth.min()) - _ROOM

    def _aim(self, camera: Camera, without: Collection[SolidKind]) -> tuple[float, float]:
        """Point MuJoCo's camera and its key light; return the limits of `_depths`."""
        assert self._renderer is not None
        mujoco, data, scene = import_mujoco(), self._model.data, self._renderer.scene
        steps = np.arange(len(self.solids)) % _LAYERS
        data.mocap_pos[:] = self.poses[:, :3, 3] + _LAYER * steps[:, None] * camera.towards
        mujoco.mj_kinematics(self._model.model, data)
        key = np.array(_KEY) @ np.array([camera.towards, camera.right, camera.up])
        key = key / np.linalg.norm(key)
        data.light_xdir[0], data.light_xpos[0] = -key, self._middle + key
        self._renderer.resize(camera.width, camera.height)
        self._renderer.update(data, hidden=frozenset(_KINDS.index(kind) for kind in without))
        near, far = self._depths(camera)
        half = 0.5 / camera.scale
        for eye in scene.camera:
            eye.pos, eye.forward, eye.up = camera.center + (near + 1.0) * camera.towards, -camera.towards, camera.up
            eye.orthographic, eye.frustum_center, eye.frustum_width = 1, 0.0, half * camera.width
            eye.frustum_bottom, eye.frustum_top = -half * camera.height, half * camera.height
            eye.frustum_near, eye.frustum_far = 1.0, 1.0 + near - far
        for flag in (mujoco.mjtRndFlag.mjRND_SKYBOX, mujoco.mjtRndFlag.mjRND_CULL_FACE):
            scene.flags[int(flag)] = 0
        return near, far


def solution_solids(hand: Hand, obj: GraspObject, solution: GraspSolution) -> list[Solid]:
    """Return hand and object with the geometry that was solved."""
    return [
        *hand_solids(hand, solution.collision_source),
        *object_solids(obj, solution.object_collision_source),
    ]


def solution_poses(hand: Hand, solids: Sequence[Solid], solution: GraspSolution) -> FloatArray:
    """Return where solids are at the touch, shape (N, 4, 4)."""
    q = np.array([solution.joint_angles.get(j.name, j.open_value) for j in hand.joints])
    links = solution.hand_pose.matrix @ hand.link_poses(q)
    return np.array([solid_pose(solid, links, solution.object_pose.matrix) for solid in solids]).reshape(-1, 4, 4)


def _compiled(solids: Sequence[Solid]) -> _Model:
    """Return a model with a free body for every solid.

    Raises:
        ValueError: MuJoCo refuses a mesh.
    """
    mujoco = import_mujoco()
    spec = mujoco.MjSpec.from_string(_LIGHTS)
    for k, solid in enumerate(solids):
        missing = max(_LEAST_CORNERS - len(solid.mesh.vertices), 0)
        corners = np.vstack([solid.mesh.vertices, np.repeat(solid.mesh.vertices[:1], missing, axis=0)])
        faces = np.ascontiguousarray(solid.mesh.triangles, dtype=np.int32)
        mesh = spec.add_mesh(name=f"{k}", uservert=corners.ravel(), userface=faces.ravel())
        mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL
        shine = 0.5 if solid.of_hand else 0.25
        spec.add_material(name=f"{k}", rgba=[*rgb(solid.color), 1.0], specular=shine, shininess=_SHININESS)
        body = spec.worldbody.add_body(name=f"{k}", mocap=True)
        geom = body.add_geom(name=f"{k}", type=mujoco.mjtGeom.mjGEOM_MESH, meshname=f"{k}", material=f"{k}")
        geom.contype, geom.conaffinity, geom.group = 0, 0, _KINDS.index(solid.kind)
    model = spec.compile()
    names = [int(model.geom(g).name) for g in range(model.ngeom)]
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return _Model(model, data, np.array([*names, -1], dtype=np.int64))


def _sampled(vertices: FloatArray) -> FloatArray:
    """Return one vertex of every cell of a grid, shape (n, 3)."""
    width = min(_GRID, float(np.ptp(vertices, axis=0).max()) / _CELLS) or _GRID
    _, kept = np.unique(np.round(vertices / width).astype(np.int64), axis=0, return_index=True)
    found: FloatArray = vertices[kept]
    return found


def _warn_plain(reason: str) -> None:
    """Say once why pictures are plain."""
    if reason not in _told:
        _told.add(reason)
        warnings.warn(f"Pictures are plain: {reason}", stacklevel=3)
