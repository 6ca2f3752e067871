"""Good files of every kind that clench reads, each with what reads it."""

import io
import json
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import clench
from clench.core.files.array_files import read_array
from clench.core.pose_arrays import pose_rows
from clench.execution.hardware.joint_map import JointMap
from clench.execution.trajectory_checks import check_for_hand
from clench.scoring.calibration import load_calibration
from clench.solver.batch.saved_question import SavedBatch
from fuzz.file_trials import GRASPS, JOINT_MAP
from fuzz.originals import CALIBRATION, COMMAND, HAND_FILE, MJCF, URDF, link_stl
from fuzz.trials import good

from .meshes import glb

MTL = "newmtl m\nKd 0.8 0.1 0.1\nNs 10.0\nd 1.0\nillum 2\nmap_Kd picture.png\n"


@dataclass(frozen=True)
class Original:
    """Hold a good file: where changed ones are written, and what reads them.

    Args:
        kind: of file. path: of the changed file. data: of the good one. reader: is given the path of the file to load.
        main: the file to load, where it is another one, which names this one.
    """

    kind: str
    path: Path
    data: bytes
    reader: Callable[[Path], Any]
    main: Path | None = None

    def write(self, data: bytes) -> Path:
        """Write a changed file, and return the file to load."""
        self.path.write_bytes(data)
        return self.main or self.path

    def read(self, path: Path) -> None:
        """Read a file as a program would; raise what reading it raises."""
        self.reader(path)


def _hand(path: Path) -> Any:
    return clench.Hand.load(path)


def _object(path: Path) -> Any:
    return clench.GraspObject.load(path)


def _grasps(path: Path) -> Any:
    return [grasp.joint_angles for grasp in clench.import_grasps(path)]


def _poses(path: Path) -> Any:
    return pose_rows(read_array(path), str(path))


def _batch(path: Path) -> Any:
    hand, obj, _, _ = good()
    return list(SavedBatch(path).solutions(hand, obj))


def _solution(path: Path) -> Any:
    return clench.plan_trajectory(clench.GraspSolution.load(path), good()[0])


def _trajectory(path: Path) -> Any:
    hand, _, solution, _ = good()
    check_for_hand(clench.Trajectory.load(path), solution, hand)


def _record(path: Path) -> Any:
    with clench.Record(path) as record:
        found = record.find(limit=5)
        return found, [record.read(1), record.outcomes()], record.append(good()[2])


def _hand_file(path: Path) -> Any:
    return clench.Hand.load(path.parent / "pincer.urdf", hand_file=path)


def _arrays(folder: Path) -> dict[str, bytes]:
    """Return files of NumPy: poses, a batch, and a pickled dictionary of grasps."""
    hand, obj, _, _ = good()
    rows = np.tile([1.0, 0, 0, 0, 0, 0, -0.05], (2, 1))
    poses, grasps = io.BytesIO(), io.BytesIO()
    np.save(poses, rows)
    clench.solve_batch(hand, obj, rows, clench.GraspCommand(clench.Pose.identity(), planes=1, preshape="open")).save(
        folder / "b.npz"
    )
    qpos = np.tile([0.0, 0.0, -0.05, 1.0, 0.0, 0.0, 0.0, 0.1, 0.08, 0.2], (2, 1))
    document = {"grasp_qpos": qpos, "obj_pose": np.array([0.0, 0, 0, 1, 0, 0, 0]), "obj_scale": 1.0}
    np.save(grasps, np.array(document, dtype=object), allow_pickle=True)
    return {"poses": poses.getvalue(), "batch": (folder / "b.npz").read_bytes(), "grasps": grasps.getvalue()}


def _archive_of_a_mesh() -> bytes:
    """Return a tetrahedron as 3MF."""
    points = "".join(f'<vertex x="{x}" y="{y}" z="{z}"/>' for x, y, z in ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)))
    faces = "".join(
        f'<triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3))
    )
    mesh = f"<mesh><vertices>{points}</vertices><triangles>{faces}</triangles></mesh>"
    model = f'<model unit="meter"><resources><object id="1">{mesh}</object></resources></model>'
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        archive.writestr("3D/3dmodel.model", model)
    return out.getvalue()


def _json_files(folder: Path) -> dict[str, str]:
    hand, obj, solution, _ = good()
    clench.export_grasps(folder / "grasp.json", [solution], hand=hand, obj=obj)
    return {
        "command": json.dumps(COMMAND),
        "solution": json.dumps(solution.to_dict()),
        "trajectory": json.dumps(clench.plan_trajectory(solution, hand).to_dict()),
        "moveit": (folder / "grasp.json").read_text(),
    }


def _recorded(folder: Path) -> bytes:
    with clench.Record(folder / "good.sqlite") as record:
        record.extend([good()[2]] * 2)
    return (folder / "good.sqlite").read_bytes()


def originals(folder: Path) -> dict[str, Original]:
    """Write what good files need beside them into a folder, and return one of every kind."""
    meshes, arrays, texts = good()[3], _arrays(folder), _json_files(folder)
    (folder / "link.stl").write_bytes(link_stl())
    (folder / "pincer.urdf").write_text(URDF)
    obj = b"mtllib thing.mtl\nusemtl m\n" + meshes["obj"]
    (folder / "with_mtl.obj").write_bytes(obj)
    (folder / "with_mesh.xml").write_text(MJCF.replace("link.stl", "changed.stl"))
    (folder / "with_obj.urdf").write_text(URDF.replace("link.stl", "changed.obj"))
    files: list[tuple[str, bytes | str, Callable[[Path], Any], str | None]] = [
        ("poses.npy", arrays["poses"], _poses, None),
        ("grasps.npy", arrays["grasps"], _grasps, None),
        ("batch.npz", arrays["batch"], _batch, None),
        ("thing.3mf", _archive_of_a_mesh(), _object, None),
        ("thing.obj", obj, _object, None),
        ("thing.mtl", MTL, _object, "with_mtl.obj"),
        ("thing.stl", meshes["stl"], _object, None),
        ("thing.ply", meshes["ply"], _object, None),
        ("thing.off", meshes["off"], _object, None),
        ("thing.glb", meshes["glb"], _object, None),
        ("tetra.glb", glb(), _object, None),
        ("changed.stl", link_stl(), _hand, "with_mesh.xml"),
        ("changed.obj", meshes["obj"], _hand, "with_obj.urdf"),
        ("hand.urdf", URDF, _hand, None),
        ("hand.xml", MJCF, _hand, None),
        ("hand.toml", HAND_FILE, _hand_file, None),
        ("weights.toml", CALIBRATION, load_calibration, None),
        ("map.toml", JOINT_MAP, JointMap.load, None),
        ("grasps.yaml", GRASPS, _grasps, None),
        ("command.json", texts["command"], clench.load_command, None),
        ("solution.json", texts["solution"], _solution, None),
        ("trajectory.json", texts["trajectory"], _trajectory, None),
        ("moveit.json", texts["moveit"], _grasps, None),
        ("solves.sqlite", _recorded(folder), _record, None),
    ]
    assert tuple(name for name, *_ in files) == KINDS
    return {
        name: Original(
            name, folder / name, data.encode() if isinstance(data, str) else data, read, folder / main if main else None
        )
        for name, data, read, main in files
    }


#: Kinds of files, by the name that a file has.
KINDS = (
    *("poses.npy", "grasps.npy", "batch.npz", "thing.3mf", "thing.obj", "thing.mtl", "thing.stl", "thing.ply"),
    *("thing.off", "thing.glb", "tetra.glb", "changed.stl", "changed.obj", "hand.urdf", "hand.xml", "hand.toml"),
    *("weights.toml", "map.toml", "grasps.yaml", "command.json", "solution.json", "trajectory.json", "moveit.json"),
    "solves.sqlite",
)
